#include "sidestep/constraints/motion_program.hpp"

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>

#include "support/allocations.hpp"
#include "support/numbers.hpp"
#include "support/random.hpp"
#include "support/serial_arm.hpp"
#include "support/without_torque.hpp"

using namespace sidestep;
using test::not_a_number;
using test::nv;
using test::Random;

namespace {

/// Half-spaces of the joint space, each moving along its normal: h_k = n_k·q + b_k + s_k t.
struct Walls {
  Walls(Random& random, int num, double speed)
      : normals(0.3 * random.matrix(nv, num)), offsets(num), speeds(speed * random.vector(num)) {
    for (int k = 0; k < num; ++k) {
      offsets[k] = random.uniform(0.3, 0.6);
    }
  }

  Clearances at(const Eigen::VectorXd& q, const Eigen::VectorXd& v, double time) const {
    const auto num = static_cast<int>(offsets.size());
    Clearances clearances(nv, num);
    clearances.values = normals.transpose() * q + offsets + time * speeds;
    clearances.rates = normals.transpose() * v + speeds;
    clearances.gradients = normals;
    clearances.nearest.setLinSpaced(num, 0, num - 1);
    clearances.mind_nearest();
    return clearances;
  }

  Eigen::MatrixXd normals;
  Eigen::VectorXd offsets, speeds;
};

}  // namespace

BOOST_AUTO_TEST_CASE(walls_in_joint_space_are_never_passed) {
  // A double integrator that is driven at random walls by accelerations far beyond its limits.
  Random random(0);
  const JointLimits limits = test::arm_limits(nv);
  const double margin = SafetySettings().margin;
  MotionSolution solution(nv);
  for (int trial = 0; trial < 40; ++trial) {
    MotionProgram filter(test::serial_arm(limits), test::without_torque());
    const Walls walls(random, random.integer(1, 12), 0.0);
    Eigen::VectorXd q = Eigen::VectorXd::Zero(nv), v = q, wanted = q;
    double lowest = 1.0;
    for (int k = 0; k < 3000; ++k) {
      if (k % 600 == 0) {
        wanted = 100.0 * random.vector(nv);
      }
      const Clearances clearances = walls.at(q, v, 0.0);
      lowest = std::min(lowest, clearances.values.minCoeff());
      static_cast<void>(filter.solve({.q = q, .v = v, .acceleration = wanted, .clearances = &clearances}, solution));
      BOOST_REQUIRE((solution.acceleration.array() <= solution.upper.array()).all());
      BOOST_REQUIRE((solution.acceleration.array() >= solution.lower.array()).all());
      v += 0.001 * solution.acceleration;
      q += 0.001 * v;
    }
    // Where a corner of several walls asks for more than the joints have, what is missing costs a little.
    BOOST_TEST(lowest >= margin - (filter.count(ProgramStatus::relaxed_safety) > 0 ? 2e-3 : 1e-9));
    BOOST_TEST(filter.count(ProgramStatus::limited) > 100);
    BOOST_TEST(filter.count(ProgramStatus::fallback_solver) == 0);
  }
}

BOOST_AUTO_TEST_CASE(the_arm_yields_to_a_wall_that_moves) {
  Random random(1);
  const JointLimits limits = test::arm_limits(nv);
  MotionSolution solution(nv);
  for (int trial = 0; trial < 40; ++trial) {
    MotionProgram filter(test::serial_arm(limits), test::without_torque());
    Walls walls(random, 1, 0.0);
    walls.speeds.setConstant(-0.2);  // [m/s] towards the arm, for 2 s: 0.4 m
    Eigen::VectorXd q = Eigen::VectorXd::Zero(nv), v = q;
    double lowest = 1.0;
    for (int k = 0; k < 2000; ++k) {
      const Clearances clearances = walls.at(q, v, 0.001 * k);
      lowest = std::min(lowest, clearances.values[0]);
      const Eigen::VectorXd wanted = -100.0 * q - 20.0 * v;  // wants to stay
      BOOST_REQUIRE(filter.solve({.q = q, .v = v, .acceleration = wanted, .clearances = &clearances}, solution) <=
                    ProgramStatus::limited);
      v += 0.001 * solution.acceleration;
      q += 0.001 * v;
    }
    // The line speed = rate (h - margin) under a wall of 0.2 m/s never asks the arm to go below the margin.
    BOOST_TEST(lowest >= SafetySettings().margin - 1e-9);
  }
}

BOOST_AUTO_TEST_CASE(joint_limits_stand_above_clearances) {
  const JointLimits limits = test::arm_limits(nv);
  MotionProgram filter(test::serial_arm(limits), test::without_torque());
  MotionSolution solution(nv);
  Clearances clearances(nv, 2);
  clearances.nearest << -1, 5;
  clearances.values[1] = 0.01;
  clearances.rates[1] = -1.0;  // 1 m/s, 5 mm before the margin
  clearances.curvatures[1] = -1.0;
  clearances.gradients(2, 1) = 0.5;
  clearances.mind_nearest();
  const Eigen::VectorXd q = Eigen::VectorXd::Zero(nv), v = q, a = q;  // something comes
  BOOST_TEST((filter.solve({.q = q, .v = v, .acceleration = a, .clearances = &clearances}, solution) ==
              ProgramStatus::relaxed_safety));
  BOOST_TEST(solution.acceleration[2] == 10.0);
  BOOST_TEST(contains(solution.active[2], Limit::acceleration_upper));
  BOOST_REQUIRE(solution.num_safety_rows == 1);
  // 5 m/s² are asked for against the closing speed, which is all there is, and 1 more against the curvature.
  BOOST_TEST(solution.safety[0].required == 6.0, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(solution.safety[0].slack == 1.0, boost::test_tools::tolerance(1e-12));
}

BOOST_AUTO_TEST_CASE(without_clearances_only_the_joint_limits_count) {
  Random random(2);
  const JointLimits limits = test::arm_limits(nv);
  MotionProgram filter(test::serial_arm(limits), test::without_torque());
  MotionSolution solution(nv);
  for (int trial = 0; trial < 1000; ++trial) {
    const Eigen::VectorXd q = (2.0 * random.vector(nv)).cwiseMax(limits.lower).cwiseMin(limits.upper);
    const Eigen::VectorXd v = random.vector(nv).cwiseMax(-limits.velocity).cwiseMin(limits.velocity);
    const Eigen::VectorXd a = 10.0 * random.vector(nv);
    static_cast<void>(filter.solve({.q = q, .v = v, .acceleration = a}, solution));
    const Eigen::VectorXd clipped = a.cwiseMax(solution.lower).cwiseMin(solution.upper);
    BOOST_REQUIRE_SMALL((solution.acceleration - clipped).norm(), 1e-12);  // rounding of accelerations around 10
  }
}

BOOST_AUTO_TEST_CASE(whatever_comes_in_the_acceleration_is_finite_and_nothing_is_allocated) {
  Random random(3);
  const JointLimits limits = test::arm_limits(nv);
  MotionProgram filter(test::serial_arm(limits), test::without_torque());
  MotionSolution solution(nv);
  for (int trial = 0; trial < 2000; ++trial) {
    const Walls walls(random, random.integer(0, 40), 0.3);
    Eigen::VectorXd q = 0.6 * random.vector(nv), v = random.vector(nv), a = 20.0 * random.vector(nv);
    Clearances clearances = walls.at(q, v, random.uniform(-1.0, 1.0));
    switch (random.integer(0, 8)) {
      case 0: q[1] = not_a_number; break;
      case 1: v[1] = not_a_number; break;
      case 2: a[1] = not_a_number; break;
      case 3: clearances.approach.gradients.setConstant(not_a_number); break;
      default: break;
    }
    BOOST_REQUIRE_EQUAL(
        test::allocations_of(
            [&] { static_cast<void>(filter.solve({.q = q, .v = v, .acceleration = a, .clearances = &clearances}, solution)); }),
        0u);
    BOOST_REQUIRE(solution.acceleration.allFinite());
    BOOST_REQUIRE((solution.acceleration.array().abs() <= limits.acceleration.array()).all());
  }
  for (const ProgramStatus status :
       {ProgramStatus::ok, ProgramStatus::limited, ProgramStatus::relaxed_safety, ProgramStatus::fallback_invalid_input}) {
    BOOST_TEST(filter.count(status) > 0, name(status));
  }
  BOOST_TEST(filter.count(ProgramStatus::relaxed) == 0);
  BOOST_TEST(filter.count(ProgramStatus::fallback_solver) == 0);
}

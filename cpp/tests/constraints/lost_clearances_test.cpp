// An arm that is in contact, or where it cannot keep its clearances: there always is a command, and the status says so.
#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <limits>
#include <tuple>

#include "sidestep/constraints/motion_program.hpp"
#include "support/allocations.hpp"
#include "support/numbers.hpp"
#include "support/random.hpp"
#include "support/serial_arm.hpp"
#include "support/without_torque.hpp"

using namespace sidestep;
using test::nv;
using test::Random;

namespace {

/// Up to 40 clearances, many far below zero, some that no joint changes; most have an exact value below their mean.
Clearances hopeless(Random& random) {
  const int num = random.integer(1, 40);
  Clearances clearances(nv, num);
  for (int k = 0; k < num; ++k) {
    clearances.gradients.col(k) = (random.chance(0.1) ? 0.0 : random.magnitude(1e-6, 0.5)) * random.vector(nv);
    clearances.values[k] = random.chance(0.3) ? random.uniform(-0.3, 0.0) : random.magnitude(0.003, 0.3);
    clearances.rates[k] = random.uniform(-1.0, 1.0);
    clearances.curvatures[k] = random.uniform(-5.0, 5.0);
    clearances.nearest[k] = random.chance(0.8) ? k : -1;
  }
  clearances.mind_nearest();
  for (int k = 0; k < num; ++k) {
    clearances.least[k] -= random.uniform(0.0, 0.004);
  }
  return clearances;
}

double least_of(const Clearances& clearances) {
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index k = 0; k < clearances.nearest.size(); ++k) {
    least = clearances.nearest[k] < 0 ? least : std::min(least, clearances.least[k]);
  }
  return least;
}

/// Two walls that want opposite things of joint 0, each `depth` beyond it at zero.
Clearances pressed(double q, double v, double depth) {
  Clearances clearances(nv, 2);
  clearances.values << q - depth, -q - depth;
  clearances.rates << v, -v;
  clearances.gradients(0, 0) = 1.0;
  clearances.gradients(0, 1) = -1.0;
  clearances.nearest << 0, 1;
  clearances.mind_nearest();
  clearances.least = clearances.values;
  return clearances;
}

/// Of a filtered motion among clearances h = begin + gradientsᵀ q.
struct FilteredMotion {
  double jerk = 0.0;   // the most, as a share of its limit
  double least = 1.0;  // of the clearances, on the way [m]
  double last = 0.0;   // the least of them at the end [m]
};

/// From q = 0 with velocity v after acceleration a, wanting none.
FilteredMotion filtered_motion(const Eigen::MatrixXd& gradients, const Eigen::VectorXd& begin, double margin, Eigen::VectorXd v,
                               Eigen::VectorXd a, int steps) {
  JointLimits limits = test::arm_limits(nv);
  limits.jerk.setConstant(1000.0);
  MotionProgram filter(test::serial_arm(limits), test::without_torque());
  MotionSolution solution(nv);
  const double T = filter.settings().period;
  const auto num = static_cast<int>(begin.size());
  const Eigen::VectorXd wanted = Eigen::VectorXd::Zero(nv);
  Eigen::VectorXd q = wanted, h = begin;
  FilteredMotion found;
  for (int k = 0; k < steps; ++k) {
    Clearances clearances(nv, num);
    clearances.values = h;
    clearances.rates = gradients.transpose() * v;
    clearances.gradients = gradients;
    clearances.nearest = Eigen::VectorXi::LinSpaced(num, 0, num - 1);
    clearances.margins.setConstant(margin);
    clearances.mind_nearest();
    found.least = std::min(found.least, h.minCoeff());
    static_cast<void>(
        filter.solve({.q = q, .v = v, .acceleration = wanted, .clearances = &clearances, .last = {&a}}, solution));
    found.jerk = std::max(found.jerk, (solution.acceleration - a).cwiseAbs().maxCoeff() / (T * limits.jerk[0]));
    a = solution.acceleration;
    q += T * v + 0.5 * T * T * a;
    v += T * a;
    h = begin + gradients.transpose() * q;
  }
  found.last = h.minCoeff();
  return found;
}

}  // namespace

BOOST_AUTO_TEST_CASE(there_is_a_command_within_the_overruns_whatever_is_lost) {
  Random random(11);
  const JointLimits limits = test::arm_limits(nv);
  MotionProgram controller(test::serial_arm(limits));
  MotionProgram filter(test::serial_arm(limits), test::without_torque());
  MotionSolution solution(nv), filtered(nv);
  const double T = controller.settings().period, rounding = 1.0 + 1e-6;
  const double fastest = controller.settings().velocity_overrun * 2.5 * rounding;
  for (int trial = 0; trial < 3000; ++trial) {
    const Clearances clearances = hopeless(random);
    Eigen::VectorXd q(nv), v(nv), h(nv);
    for (int i = 0; i < nv; ++i) {
      q[i] = random.uniform(-2.0, 2.0);
      v[i] = random.uniform(-2.5, 2.5);
      h[i] = random.uniform(-0.5, 0.5) * limits.effort[i];
    }
    const Eigen::VectorXd a = random.magnitude(0.1, 100.0) * random.vector(nv);
    const Eigen::MatrixXd M = test::random_mass(random, nv);
    BOOST_REQUIRE_EQUAL(
        test::allocations_of([&] {
          static_cast<void>(controller.solve({q, v, a, M, h, &clearances}, solution));
          static_cast<void>(filter.solve({.q = q, .v = v, .acceleration = a, .clearances = &clearances}, filtered));
        }),
        0u);
    const double least = least_of(clearances);
    for (const MotionSolution* s : {&solution, &filtered}) {
      BOOST_REQUIRE(s->status <= ProgramStatus::clearance_lost);
      BOOST_REQUIRE_EQUAL(s->least_clearance, least);
      BOOST_REQUIRE_EQUAL(s->status == ProgramStatus::clearance_lost, least < 0.0);
    }
    BOOST_REQUIRE((solution.torque.array().abs() <= limits.effort.array()).all());
    BOOST_REQUIRE_LE((v + T * solution.acceleration).cwiseAbs().maxCoeff(), fastest);
    BOOST_REQUIRE_LE(solution.acceleration.cwiseAbs().maxCoeff(), 100.0 * rounding);
    BOOST_REQUIRE_LE((v + T * filtered.acceleration).cwiseAbs().maxCoeff(), 2.5 * rounding);
    BOOST_REQUIRE_LE(filtered.acceleration.cwiseAbs().maxCoeff(), 10.0 * rounding);
  }
  BOOST_TEST(controller.count(ProgramStatus::clearance_lost) > 1000);
}

BOOST_AUTO_TEST_CASE(there_is_a_command_also_beyond_every_limit) {
  // Too fast, outside position limits, gravity that is too heavy, in any combination.
  Random random(12);
  const JointLimits limits = test::arm_limits(nv);
  MotionProgram controller(test::serial_arm(limits));
  MotionSolution solution(nv);
  for (int trial = 0; trial < 3000; ++trial) {
    const Clearances clearances = hopeless(random);
    Eigen::VectorXd q(nv), v(nv), h(nv);
    for (int i = 0; i < nv; ++i) {
      q[i] = random.uniform(-3.0, 3.0);
      v[i] = random.uniform(-8.0, 8.0);
      h[i] = random.uniform(-1.5, 1.5) * limits.effort[i];
    }
    const Eigen::MatrixXd M = test::random_mass(random, nv);
    static_cast<void>(controller.solve({q, v, random.vector(nv), M, h, &clearances}, solution));
    BOOST_REQUIRE(solution.status <= ProgramStatus::clearance_lost);
    BOOST_REQUIRE((solution.torque.array().abs() <= limits.effort.array()).all());
    BOOST_REQUIRE(solution.acceleration.allFinite());
  }
}

BOOST_AUTO_TEST_CASE(an_arm_that_is_pressed_from_both_sides_comes_to_rest_in_the_middle) {
  const Robot arm = test::serial_arm(test::arm_limits(nv));
  MotionProgram filter(arm, test::without_torque());
  MotionProgram controller(arm);
  const Eigen::MatrixXd M = Eigen::MatrixXd::Identity(nv, nv);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(nv);
  for (const bool torque : {false, true}) {
    MotionSolution solution(nv);
    Eigen::VectorXd q = zero, v = zero;
    q[0] = 0.02;
    v[0] = 0.5;
    double fastest = 0.0, hardest = 0.0;
    for (int step = 0; step < 4000; ++step) {
      const Clearances clearances = pressed(q[0], v[0], 0.1);
      const Eigen::VectorXd wanted = Eigen::VectorXd::Constant(nv, 1.0) - 20.0 * v;
      const ProgramStatus status =
          torque ? controller.solve({q, v, wanted, M, zero, &clearances}, solution)
                 : filter.solve({.q = q, .v = v, .acceleration = wanted, .clearances = &clearances}, solution);
      BOOST_REQUIRE(status == ProgramStatus::clearance_lost);
      v += 0.001 * solution.acceleration;
      q += 0.001 * v;
      if (step >= 3000) {
        fastest = std::max(fastest, std::abs(v[0]));
        hardest = std::max(hardest, std::abs(solution.acceleration[0]));
      }
    }
    BOOST_TEST(std::abs(q[0]) < 0.01);
    BOOST_TEST(fastest < 0.005);
    BOOST_TEST(hardest < 0.05);
  }
}

BOOST_AUTO_TEST_CASE(a_clearance_that_no_joint_changes_is_told) {
  MotionProgram controller(test::serial_arm(test::arm_limits(nv)));
  MotionProgram filter(test::serial_arm(test::arm_limits(nv)), test::without_torque());
  MotionSolution solution(nv);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(nv);
  const Eigen::MatrixXd M = Eigen::MatrixXd::Identity(nv, nv);
  Clearances clearances(nv, 1);
  clearances.nearest[0] = 7;
  for (const auto& [clearance, rate, status] :
       {std::tuple(-1.0, 0.0, ProgramStatus::clearance_lost), std::tuple(0.002, 0.0, ProgramStatus::relaxed_safety),
        std::tuple(0.050, -1.0, ProgramStatus::relaxed_safety), std::tuple(0.050, 0.0, ProgramStatus::ok)}) {
    clearances.values[0] = clearances.least[0] = clearance;
    clearances.rates[0] = rate;
    clearances.mind_nearest();
    BOOST_TEST((controller.solve({zero, zero, zero, M, zero, &clearances}, solution) == status));
    BOOST_TEST((filter.solve({.q = zero, .v = zero, .acceleration = zero, .clearances = &clearances}, solution) == status));
    BOOST_TEST(solution.least_clearance == clearance);
    BOOST_TEST(solution.least_coordinate == 0);
    BOOST_TEST(solution.least_nearest == 7);
  }
  clearances.nearest[0] = -1;
  BOOST_TEST(
      (filter.solve({.q = zero, .v = zero, .acceleration = zero, .clearances = &clearances}, solution) == ProgramStatus::ok));
  BOOST_TEST(solution.least_coordinate == -1);
}

BOOST_AUTO_TEST_CASE(what_is_inside_is_never_ok_although_it_leaves) {
  // The mean is above zero and fast on its way out: the program has nothing to do, but an ellipsoid is still inside.
  MotionProgram controller(test::serial_arm(test::arm_limits(nv)));
  MotionSolution solution(nv);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(nv);
  Clearances clearances(nv, 1);
  clearances.nearest[0] = 0;
  clearances.values[0] = 0.010;
  clearances.rates[0] = 1.0;
  clearances.gradients(0, 0) = 1.0;
  clearances.mind_nearest();
  clearances.least[0] = -0.001;
  const Eigen::MatrixXd M = Eigen::MatrixXd::Identity(nv, nv);
  BOOST_TEST((controller.solve({zero, zero, zero, M, zero, &clearances}, solution) == ProgramStatus::clearance_lost));
  BOOST_TEST(solution.least_clearance == -0.001);
}

BOOST_AUTO_TEST_CASE(the_way_out_of_what_does_not_close_keeps_the_jerk_limits) {
  // Two clearances 30 and 10 mm below zero, whose ways out share joints.
  Eigen::MatrixXd gradients = Eigen::MatrixXd::Zero(nv, 2);
  gradients.col(0).head(2) << 0.4, -0.2;
  gradients.col(1).segment(1, 2) << 0.3, 0.3;
  const Eigen::Vector2d begin(-0.03, -0.01);
  const double unlimited = std::numeric_limits<double>::infinity();
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(nv);
  const FilteredMotion out = filtered_motion(gradients, begin, unlimited, rest, rest, 2000);
  BOOST_TEST(out.jerk < 1.0 + 1e-6);
  BOOST_TEST(out.last > 0.0);
  const FilteredMotion deeper = filtered_motion(gradients, begin, unlimited, -Eigen::VectorXd::Unit(nv, 0), rest, 1);
  BOOST_TEST(deeper.jerk > 5.0);  // it is stopped at once
}

BOOST_AUTO_TEST_CASE(the_margin_of_what_is_known_gives_way_before_the_jerk_limit) {
  // Joint 0 moves at 0.5 rad/s, and is still accelerated, towards a clearance of which it changes 0.4 m/rad.
  const Eigen::VectorXd joint = Eigen::VectorXd::Unit(nv, 0), begin = Eigen::VectorXd::Constant(1, 0.0115);
  const auto with_margin = [&](double margin) {
    return filtered_motion(0.4 * joint, begin, margin, -0.5 * joint, -5.0 * joint, 500);
  };
  const FilteredMotion seen = with_margin(std::numeric_limits<double>::infinity());
  BOOST_TEST(seen.jerk > 2.0);
  BOOST_TEST(seen.least > 0.005 - 1e-4);
  const FilteredMotion known = with_margin(0.005);
  BOOST_TEST(known.jerk < 1.0 + 1e-6);
  BOOST_TEST(known.least > 0.001);
  BOOST_TEST(known.least < 0.005);
}

// What the program does about clearances. The rest is in motion_program_test.cpp.
#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <limits>

#include "sidestep/constraints/clearance_demand.hpp"
#include "sidestep/constraints/motion_program.hpp"
#include "support/allocations.hpp"
#include "support/numbers.hpp"
#include "support/random.hpp"
#include "support/serial_arm.hpp"

using namespace sidestep;
using test::nv;
using test::Random;

namespace {

/// One clearance that joint 2 alone changes, h' = 0.5 q̇_2, closing with 0.1 m/s at 10 mm: 5 mm before the margin.
struct Approach {
  Approach() : clearances(nv, 3) {
    v[2] = -0.2;
    clearances.nearest << -1, 5, -1;
    clearances.values[1] = 0.010;
    clearances.rates[1] = -0.1;
    clearances.gradients(2, 1) = 0.5;
  }
  ProgramStatus solve(MotionProgram& controller, MotionSolution& solution) {
    clearances.mind_nearest();
    return controller.solve({q, v, a, M, h, &clearances}, solution);
  }
  /// What the clearance asks of joint 2 [/s²]: half of 0.5 · 10 m/s² is planned with.
  double required() const { return demanded_deceleration(0.005, 0.1, {2.5, 5.0, 20.0, 0.5}, 0.001) / 0.5; }

  Eigen::VectorXd q = Eigen::VectorXd::Zero(nv), v = q, a = q, h = q;
  Eigen::MatrixXd M = Eigen::MatrixXd::Identity(nv, nv);
  Clearances clearances;
};

}  // namespace

BOOST_AUTO_TEST_CASE(a_clearance_bends_the_task) {
  MotionProgram controller(test::serial_arm(test::arm_limits(nv)));
  MotionSolution solution(nv);
  Approach in;
  in.a.setConstant(-5.0);
  BOOST_TEST((in.solve(controller, solution) == ProgramStatus::limited));
  BOOST_TEST(in.required() > 3.9);  // 20 · 0.1 m/s² along the line
  BOOST_TEST(in.required() < 4.0);
  // Rounding of an acceleration around 5.
  BOOST_TEST(solution.acceleration[2] == in.required(), boost::test_tools::tolerance(1e-12));
  BOOST_TEST(solution.acceleration[1] == -5.0, boost::test_tools::tolerance(1e-6));  // the torque weight
  BOOST_REQUIRE(solution.num_safety_rows == 1);
  BOOST_REQUIRE(solution.dominant == 0);
  const SafetyRow& row = solution.safety[0];
  BOOST_TEST(row.coordinate == 1);
  BOOST_TEST(row.nearest == 5);
  BOOST_TEST(row.required == 0.5 * in.required(), boost::test_tools::tolerance(1e-12));
  BOOST_TEST(row.slack == 0.0);
  BOOST_TEST(row.multiplier == in.required() + 5.0, boost::test_tools::tolerance(1e-5));  // the cost's slope
  BOOST_TEST((solution.active[2] == Limit::none));
}

BOOST_AUTO_TEST_CASE(a_clearance_that_is_kept_anyway_changes_nothing) {
  MotionProgram controller(test::serial_arm(test::arm_limits(nv)));
  MotionSolution with(nv), without(nv);
  Approach in;
  in.a.setConstant(4.5);
  BOOST_TEST((in.solve(controller, with) == ProgramStatus::ok));
  BOOST_TEST(with.dominant == -1);
  BOOST_TEST(with.num_safety_rows == 1);
  BOOST_TEST((controller.solve({in.q, in.v, in.a, in.M, in.h}, without) == ProgramStatus::ok));
  BOOST_TEST((with.torque.array() == without.torque.array()).all());
  BOOST_TEST(without.num_safety_rows == 0);
}

BOOST_AUTO_TEST_CASE(comfort_gives_way_before_clearances) {
  // Something comes, with a curvature of -9: 0.5 q̈_2 >= 9 + 2 asks for 22 /s², the limit is 10. Torque allows 87.
  MotionProgram controller(test::serial_arm(test::arm_limits(nv)));
  MotionSolution solution(nv);
  Approach in;
  in.v.setZero();
  in.clearances.curvatures[1] = -9.0;
  const double asked = in.required() + 18.0;
  BOOST_TEST((in.solve(controller, solution) == ProgramStatus::relaxed));
  BOOST_TEST(solution.acceleration[2] == asked, boost::test_tools::tolerance(1e-9));  // the second program's prices
  BOOST_TEST(solution.slack[2] == asked - 10.0, boost::test_tools::tolerance(1e-9));
  BOOST_TEST(solution.safety[0].slack == 0.0);
  BOOST_TEST(solution.dominant == 0);
  BOOST_TEST(contains(solution.active[2], Limit::acceleration_upper));

  MotionProgramSettings settings;
  settings.hard_bounds = true;
  MotionProgram hard(test::serial_arm(test::arm_limits(nv)), settings);
  BOOST_TEST((in.solve(hard, solution) == ProgramStatus::relaxed_safety));
  BOOST_TEST(solution.acceleration[2] == 10.0, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(solution.safety[0].slack == 0.5 * (asked - 10.0), boost::test_tools::tolerance(1e-9));
}

BOOST_AUTO_TEST_CASE(feedback_too_leaves_neither_position_limits_nor_overruns_for_a_clearance) {
  // Feedback may exceed the acceleration limit of 10 /s² twenty times, and the clearance asks for 22 /s². What fits into no
  // smooth solution must not lead past the position limit, or past 1.2 times the velocity limit of 2.5 /s.
  MotionProgram controller(test::serial_arm(test::arm_limits(nv)));
  MotionSolution solution(nv);
  Approach in;
  in.clearances.curvatures[1] = -9.0;
  in.clearances.mind_nearest();
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(nv);
  LastCommand last{&rest, &rest, nullptr, nullptr, 20.0, false};
  const auto solve = [&](double q, double v) {
    in.q[2] = q;
    in.v[2] = v;
    return controller.solve({in.q, in.v, in.a, in.M, in.h, &in.clearances, {}, last}, solution);
  };
  BOOST_TEST((solve(0.0, 0.0) <= ProgramStatus::relaxed));
  BOOST_TEST(solution.acceleration[2] > 20.0);
  BOOST_TEST((solve(2.48, 0.7) == ProgramStatus::relaxed_safety));  // 10 /s² would need 24.5 of the 20 mrad that are left
  BOOST_TEST(solution.acceleration[2] < -9.9);
  BOOST_TEST((solve(0.0, 3.0) == ProgramStatus::relaxed_safety));
  BOOST_TEST(solution.acceleration[2] < 1e-9);  // rounding
  last.yields = true;                           // Something may push an impedance faster than that: clearances come first.
  BOOST_TEST((solve(0.0, 3.0) <= ProgramStatus::relaxed));
  BOOST_TEST(solution.acceleration[2] > 20.0);
}

BOOST_AUTO_TEST_CASE(a_clearance_that_can_be_kept_is_kept_beside_one_that_cannot) {
  // Joint 2 cannot give what its clearance asks for; joint 0 can, whatever the task wants: it may change by 2000 /s².
  JointLimits limits = test::arm_limits(nv);
  limits.acceleration[0] = limits.effort[0] = std::numeric_limits<double>::infinity();
  limits.velocity[0] = 2.0;
  MotionProgramSettings settings;
  settings.hard_bounds = true;
  MotionProgram controller(test::serial_arm(limits), settings);
  MotionSolution solution(nv);
  Approach in;
  in.v.setZero();
  in.clearances.curvatures[1] = -9.0;
  in.clearances.nearest[0] = 3;
  in.clearances.values[0] = 0.010;
  in.clearances.rates[0] = -0.1;
  in.clearances.gradients(0, 0) = -0.5;
  in.a[0] = 1900.0;
  BOOST_TEST((in.solve(controller, solution) == ProgramStatus::relaxed_safety));
  BOOST_TEST(solution.num_safety_rows == 2);
  BOOST_TEST(solution.acceleration[2] == 10.0, boost::test_tools::tolerance(1e-9));
  for (int k = 0; k < 2; ++k) {
    const SafetyRow& row = solution.safety[static_cast<std::size_t>(k)];
    if (row.coordinate == 0) {
      BOOST_TEST(row.required > 0.0);
      BOOST_TEST(row.slack == 0.0);
      BOOST_TEST(solution.acceleration[0] == -2.0 * row.required, boost::test_tools::tolerance(1e-6));
    } else {
      BOOST_TEST(row.slack > 1.0);
    }
  }
}

BOOST_AUTO_TEST_CASE(torque_limits_stand_above_clearances) {
  MotionProgram controller(test::serial_arm(test::arm_limits(nv)));
  MotionSolution solution(nv);
  Approach in;
  in.v.setZero();
  in.clearances.curvatures[1] = -9.0;
  in.h[2] = 80.0;  // of 87
  in.a[0] = 1.0;
  BOOST_TEST((in.solve(controller, solution) == ProgramStatus::relaxed_safety));
  BOOST_TEST(solution.torque[2] == 87.0);
  BOOST_TEST(contains(solution.active[2], Limit::torque_upper));
  BOOST_TEST(solution.acceleration[2] == 7.0, boost::test_tools::tolerance(1e-9));
  // Of 3.5 m/s² that the torque leaves, half is planned with; the rest of what is asked for is missing.
  const double demand = demanded_deceleration(0.005, 0.1, {1.75, 3.5, 20.0, 0.5}, 0.001);
  BOOST_TEST(solution.safety[0].required == demand + 9.0, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(solution.safety[0].slack == demand + 9.0 - 3.5, boost::test_tools::tolerance(1e-9));
  BOOST_TEST(solution.acceleration[0] == 1.0, boost::test_tools::tolerance(1e-5));  // no reason to give that up
}

BOOST_AUTO_TEST_CASE(position_limits_are_not_given_up_for_comfort) {
  // The clearance wants joint 2 upwards with 22 /s², and 1 µrad is left to its position limit.
  MotionProgram controller(test::serial_arm(test::arm_limits(nv)));
  MotionSolution solution(nv);
  Approach in;
  in.clearances.curvatures[1] = -9.0;
  in.clearances.gradients(3, 1) = 0.2;  // joint 3 could help, with 55 /s²
  in.q[2] = 2.5 - 1e-6;
  in.v[2] = 0.0;
  BOOST_TEST((in.solve(controller, solution) == ProgramStatus::relaxed));
  const double reach = 1e-6 / (0.001 * 0.001);  // semi-implicit Euler reaches the limit with it, less braking
  BOOST_TEST(solution.acceleration[2] <= reach);
  BOOST_TEST(solution.safety[0].slack == 0.0);
  BOOST_TEST(solution.slack[2] == 0.0);
  BOOST_TEST(solution.slack[3] > 30.0);
}

BOOST_AUTO_TEST_CASE(unusable_clearances_stop_the_arm) {
  MotionProgram controller(test::serial_arm(test::arm_limits(nv)));
  MotionSolution solution(nv), stop(nv);
  Approach in;
  in.a.setConstant(5.0);
  in.clearances.rates[1] = std::numeric_limits<double>::quiet_NaN();
  BOOST_TEST((in.solve(controller, solution) == ProgramStatus::fallback_invalid_input));
  BOOST_TEST((solution.fault == ProgramFault::clearances));
  BOOST_TEST(solution.num_safety_rows == 0);
  in.a = -in.v / controller.settings().stop_time;
  static_cast<void>(controller.solve({in.q, in.v, in.a, in.M, in.h}, stop));
  BOOST_TEST((solution.torque.array() == stop.torque.array()).all());
}

BOOST_AUTO_TEST_CASE(many_clearances_on_every_path_are_optimal_or_reported_and_nothing_is_allocated) {
  Random random(5);
  int stops = 0;
  const JointLimits limits = test::arm_limits(nv);
  MotionProgram controller(test::serial_arm(limits));
  MotionSolution solution(nv);
  for (int trial = 0; trial < 3000; ++trial) {
    const int num = random.integer(0, 40);
    Clearances clearances(nv, num);
    for (int k = 0; k < num; ++k) {
      clearances.gradients.col(k) = 0.3 * random.vector(nv);
      clearances.values[k] = random.magnitude(0.005, 0.3);
      clearances.rates[k] = random.uniform(-0.3, 0.3);
      clearances.curvatures[k] = random.chance(0.1) ? random.uniform(-20.0, 20.0) : random.uniform(-1.0, 1.0);
      clearances.nearest[k] = random.chance(0.7) ? k : -1;
    }
    Eigen::VectorXd q(nv), v(nv), h(nv);
    for (int i = 0; i < nv; ++i) {
      q[i] = random.uniform(-2.4, 2.4);
      v[i] = random.uniform(-0.3, 0.3);
      h[i] = random.uniform(-1.0, 1.0) * (random.chance(0.1) ? 1.4 : 0.5) * limits.effort[i];
    }
    if (num > 0 && random.chance(0.05)) {
      clearances.curvatures[0] = -2000.0;  // beyond every torque limit
    }
    clearances.mind_nearest();
    const Eigen::VectorXd a = random.magnitude(0.1, 100.0) * random.vector(nv);
    const Eigen::MatrixXd M = test::random_mass(random, nv);
    BOOST_REQUIRE_EQUAL(
        test::allocations_of([&] { static_cast<void>(controller.solve({q, v, a, M, h, &clearances}, solution)); }), 0u);
    BOOST_REQUIRE(solution.status <= ProgramStatus::relaxed_safety);
    BOOST_REQUIRE((solution.torque.array().abs() <= limits.effort.array()).all());
    double worst = 0.0;
    for (int n = 0; n < solution.num_safety_rows; ++n) {
      const SafetyRow& row = solution.safety[static_cast<std::size_t>(n)];
      const Eigen::VectorXd gradient = clearances.gradients.col(row.coordinate);
      const double given = (row.along_path ? -gradient.norm() * v.normalized() : gradient).dot(solution.acceleration);
      stops += row.along_path;
      // Rounding of the second program, whose prices are up to 1e8 times the cost.
      BOOST_REQUIRE_SMALL(std::max(row.required - given, 0.0) - row.slack, 1e-6);
      worst = std::max(worst, row.slack);
    }
    if (solution.status <= ProgramStatus::relaxed) {
      BOOST_REQUIRE_EQUAL(worst, 0.0);
    }
    if (solution.status <= ProgramStatus::limited) {
      BOOST_REQUIRE_EQUAL(solution.slack.norm(), 0.0);
    }
  }
  for (const ProgramStatus status :
       {ProgramStatus::ok, ProgramStatus::limited, ProgramStatus::relaxed, ProgramStatus::relaxed_safety}) {
    BOOST_TEST(controller.count(status) > 20, name(status));
  }
  BOOST_TEST(stops > 20);
}

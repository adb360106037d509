#include "sidestep/constraints/motion_program.hpp"

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <stdexcept>
#include <string>

#include "support/allocations.hpp"
#include "support/numbers.hpp"
#include "support/random.hpp"
#include "support/serial_arm.hpp"

using namespace sidestep;
using test::infinity;
using test::not_a_number;
using test::nv;
using test::Random;

namespace {

struct Input {
  Eigen::VectorXd q = Eigen::VectorXd::Zero(nv), v = Eigen::VectorXd::Zero(nv), a = Eigen::VectorXd::Zero(nv);
  Eigen::MatrixXd M = Eigen::MatrixXd::Identity(nv, nv);
  Eigen::VectorXd h = Eigen::VectorXd::Zero(nv);
};

/// A state inside the limits, often close to one; a wanted acceleration up to far beyond what is possible; sometimes a
/// load that the torque limits cannot hold.
Input random_input(Random& random, const JointLimits& limits) {
  Input in;
  const double load = random.chance(0.2) ? 1.4 : 0.7;
  for (int i = 0; i < nv; ++i) {
    in.q[i] =
        random.chance(0.3) ? limits.upper[i] - random.magnitude(1e-6, 0.1) : random.uniform(limits.lower[i], limits.upper[i]);
    in.v[i] = random.uniform(-1.0, 1.0) * limits.velocity[i];
    in.h[i] = random.uniform(-load, load) * limits.effort[i];
  }
  in.a = random.magnitude(0.1, 1e3) * random.vector(nv);
  in.M = test::random_mass(random, nv);
  return in;
}

ProgramStatus solve(MotionProgram& controller, const Input& in, MotionSolution& solution) {
  return controller.solve({in.q, in.v, in.a, in.M, in.h}, solution);
}

bool within_effort(const MotionSolution& solution, const JointLimits& limits) {
  return solution.torque.allFinite() && (solution.torque.array().abs() <= limits.effort.array()).all();
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_reachable_acceleration_is_tracked) {
  Random random(1);
  const JointLimits limits = test::arm_limits(nv);
  MotionProgram controller(test::serial_arm(limits));
  MotionSolution solution(nv);
  for (int trial = 0; trial < 1000; ++trial) {
    Input in = random_input(random, limits);
    in.q *= 0.5;
    in.v *= 0.5;
    in.h *= 0.5;
    in.a = random.vector(nv).cwiseMax(-3.0).cwiseMin(3.0);
    BOOST_REQUIRE(solve(controller, in, solution) == ProgramStatus::ok);
    // What the torque weight costs: M R torque / Q, at most 1e-6 * |M| 0.7/12 with |M| below 5.
    BOOST_REQUIRE_SMALL((solution.acceleration - in.a).norm(), 1e-6);
    BOOST_REQUIRE_SMALL((in.M * solution.acceleration + in.h - solution.torque).norm(), 1e-12);  // rounding of 100 Nm
  }
  BOOST_TEST(controller.count(ProgramStatus::ok) == 1000);
}

BOOST_AUTO_TEST_CASE(the_thesis_weights_let_the_arm_sag) {
  // Why the default torque weight is small: with Q = 30 and R = 1 per (Nm)^2, holding 50 Nm at rest.
  const JointLimits limits = test::arm_limits(nv);
  MotionProgramSettings settings;
  settings.tracking_weight.setConstant(30.0);
  settings.torque_weight = limits.effort.cwiseAbs2();
  MotionProgram thesis(test::serial_arm(limits), settings), ours(test::serial_arm(limits));
  MotionSolution solution(nv);
  Input in;
  in.h[1] = 50.0;
  BOOST_TEST((solve(thesis, in, solution) == ProgramStatus::ok));
  // (Q + M R M) x = -M R h with M = 1: x = -50/31.
  BOOST_TEST(solution.acceleration[1] == -50.0 / 31.0, boost::test_tools::tolerance(1e-12));
  BOOST_TEST((solve(ours, in, solution) == ProgramStatus::ok));
  BOOST_TEST(std::abs(solution.acceleration[1]) < 1e-8);
}

BOOST_AUTO_TEST_CASE(every_limit_is_kept_or_the_status_says_which_is_not) {
  Random random(2);
  const JointLimits limits = test::arm_limits(nv);
  MotionProgram controller(test::serial_arm(limits));
  MotionSolution solution(nv);
  for (int trial = 0; trial < 20000; ++trial) {
    const Input in = random_input(random, limits);
    const ProgramStatus status = solve(controller, in, solution);
    BOOST_REQUIRE(status == solution.status);
    BOOST_REQUIRE(status <= ProgramStatus::relaxed_safety);
    BOOST_REQUIRE(within_effort(solution, limits));
    const Eigen::VectorXd beyond =
        solution.acceleration - solution.acceleration.cwiseMax(solution.lower).cwiseMin(solution.upper);
    // Rounding of the program: acceleration up to 1e3, factors of condition up to 1e4.
    BOOST_REQUIRE_SMALL((beyond - solution.slack).norm(), 1e-8);
    BOOST_REQUIRE((status >= ProgramStatus::relaxed) == (solution.slack.norm() > 0.0));
    BOOST_REQUIRE_SMALL((in.M * solution.acceleration + in.h - solution.torque).norm(), 1e-8);
  }
  BOOST_TEST(controller.count(ProgramStatus::limited) > 1000);
  BOOST_TEST(controller.count(ProgramStatus::relaxed) > 100);
  BOOST_TEST(controller.count(ProgramStatus::relaxed_safety) > 20);
  BOOST_TEST(controller.count(ProgramStatus::fallback_solver) == 0);
}

BOOST_AUTO_TEST_CASE(active_limits_are_named) {
  const JointLimits limits = test::arm_limits(nv);
  MotionProgram controller(test::serial_arm(limits));
  MotionSolution solution(nv);
  Input in;
  in.v[0] = 2.4999;  // 0.1 /s^2 below the velocity limit
  in.q[1] = 2.5;     // on the position limit
  in.a.setConstant(5.0);
  in.a[2] = 100.0;  // beyond the acceleration limit
  in.a[3] = -100.0;
  in.h[6] = -9.0;
  in.a[6] = -5.0;  // needs -14 Nm of 12
  BOOST_TEST((solve(controller, in, solution) == ProgramStatus::limited));
  BOOST_TEST((solution.active[0] == Limit::velocity_upper));
  BOOST_TEST((solution.active[1] == Limit::position_upper));
  BOOST_TEST((solution.active[2] == Limit::acceleration_upper));
  BOOST_TEST((solution.active[3] == Limit::acceleration_lower));
  BOOST_TEST((solution.active[4] == Limit::none));
  BOOST_TEST((solution.active[6] == Limit::torque_lower));
  BOOST_TEST(solution.acceleration[0] == 0.1, boost::test_tools::tolerance(1e-9));
  BOOST_TEST(std::abs(solution.acceleration[1]) < 1e-12);
  BOOST_TEST(solution.acceleration[6] == -3.0, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(solution.torque[6] == -12.0);
}

BOOST_AUTO_TEST_CASE(torque_limits_stand_above_acceleration_bounds) {
  const JointLimits limits = test::arm_limits(nv);
  MotionProgram controller(test::serial_arm(limits));
  MotionSolution solution(nv);
  Input in;
  in.q[6] = 2.5;
  in.v[6] = 1.0;    // must brake with 10 /s^2
  in.h[6] = -15.0;  // and a load of 15 Nm pushes on, against 12 Nm and an inertia of 1
  BOOST_TEST((solve(controller, in, solution) == ProgramStatus::relaxed_safety));
  BOOST_TEST(solution.torque[6] == -12.0);
  BOOST_TEST(solution.acceleration[6] == 3.0, boost::test_tools::tolerance(1e-9));
  BOOST_TEST(solution.slack[6] == 13.0, boost::test_tools::tolerance(1e-9));
  BOOST_TEST(solution.slack.head(6).norm() == 0.0);
  BOOST_TEST(contains(solution.active[6], Limit::torque_lower));
  BOOST_TEST(contains(solution.active[6], Limit::position_upper));
}

BOOST_AUTO_TEST_CASE(a_simulated_arm_never_leaves_its_limits) {
  // M and h of a made-up arm; wanted accelerations that change wildly. Enough torque, so no relaxation is needed.
  Random random(3);
  JointLimits limits = test::arm_limits(nv);
  limits.effort.setConstant(200.0);
  MotionProgram controller(test::serial_arm(limits));
  MotionSolution solution(nv);
  Input in;
  for (int k = 0; k < 20000; ++k) {
    if (k % 300 == 0) {
      in.a = random.magnitude(1.0, 100.0) * random.vector(nv);
      in.M = test::random_mass(random, nv);
      in.h = 10.0 * random.vector(nv);
    }
    BOOST_REQUIRE(solve(controller, in, solution) <= ProgramStatus::limited);
    const Eigen::VectorXd a = in.M.ldlt().solve(solution.torque - in.h);
    in.v += 0.001 * a;
    in.q += 0.001 * in.v;
    // Errors of 1e-9 /s^2 in the acceleration, over one period.
    BOOST_REQUIRE((in.q.array() <= limits.upper.array() + 1e-10).all());
    BOOST_REQUIRE((in.q.array() >= limits.lower.array() - 1e-10).all());
    BOOST_REQUIRE((in.v.array().abs() <= limits.velocity.array() + 1e-10).all());
  }
  BOOST_TEST(controller.count(ProgramStatus::limited) > 1000);
}

BOOST_AUTO_TEST_CASE(unusable_wanted_acceleration_stops_within_all_limits) {
  Random random(4);
  const JointLimits limits = test::arm_limits(nv);
  MotionProgram controller(test::serial_arm(limits));
  MotionSolution solution(nv), reference(nv);
  for (const double bad : {not_a_number, infinity, -infinity}) {
    Input in = random_input(random, limits);
    in.a = -in.v / controller.settings().stop_time;
    static_cast<void>(solve(controller, in, reference));
    in.a[3] = bad;
    BOOST_TEST((solve(controller, in, solution) == ProgramStatus::fallback_invalid_input));
    BOOST_TEST((solution.fault == ProgramFault::acceleration));
    BOOST_TEST((solution.torque.array() == reference.torque.array()).all());
  }
  BOOST_TEST(controller.count(ProgramStatus::fallback_invalid_input) == 3);
}

BOOST_AUTO_TEST_CASE(unusable_input_gives_a_damped_stop) {
  const JointLimits limits = test::arm_limits(nv);
  MotionProgram controller(test::serial_arm(limits));
  MotionSolution solution(nv);
  Input good;
  good.v[0] = 1.0;
  good.v[6] = -2.0;
  good.h.setConstant(3.0);
  BOOST_REQUIRE(solve(controller, good, solution) == ProgramStatus::ok);
  const auto check = [&](auto&& change, ProgramFault fault, double torque0, double torque6) {
    Input in = good;
    change(in);
    BOOST_TEST((solve(controller, in, solution) == ProgramStatus::fallback_invalid_input));
    BOOST_TEST((solution.fault == fault));
    BOOST_TEST(solution.torque[0] == torque0, boost::test_tools::tolerance(1e-12));
    BOOST_TEST(solution.torque[6] == torque6, boost::test_tools::tolerance(1e-12));
    BOOST_TEST(within_effort(solution, limits));
  };
  // M = 1, h = 3, stop_time 0.1 s, at most 10 /s^2: -10 + 3, and 10 + 3 clipped to 12.
  check([](Input& in) { in.q[2] = not_a_number; }, ProgramFault::position, -7.0, 12.0);
  check([](Input& in) { in.q.resize(3); }, ProgramFault::position, -7.0, 12.0);
  check([](Input& in) { in.v[2] = infinity; }, ProgramFault::velocity, 3.0, 3.0);  // hold against the bias
  // the last bias, 3 Nm, is kept
  check([](Input& in) { in.h[2] = not_a_number; }, ProgramFault::bias, -7.0, 12.0);
  // Close to a position limit it takes more than -3 /s² to stop before it.
  check([](Input& in) { in.h[2] = not_a_number, in.q[0] = 2.5 - 0.00455, in.v[0] = 0.3; }, ProgramFault::bias,
        3.0 + acceleration_interval(2.5 - 0.00455, 0.3, {-2.5, 2.5, 2.5, 10.0}, 0.001).upper, 12.0);
  BOOST_TEST(solution.torque[0] < 3.0 - 7.0);
  // Without M: h - D v, with D = a quarter of effort limit / velocity limit.
  const double D0 = 0.25 * 87.0 / 2.5, D6 = 0.25 * 12.0 / 2.5;
  check([](Input& in) { in.M(2, 3) = not_a_number; }, ProgramFault::mass_matrix, 3.0 - D0, 3.0 + 2.0 * D6);
  check([](Input& in) { in.M(2, 3) = 0.1; }, ProgramFault::mass_matrix, 3.0 - D0, 3.0 + 2.0 * D6);  // not symmetric
  check([](Input& in) { in.M(2, 2) = -1.0; }, ProgramFault::mass_matrix, 3.0 - D0, 3.0 + 2.0 * D6);
  check([](Input& in) { in.M.setZero(); }, ProgramFault::mass_matrix, 3.0 - D0, 3.0 + 2.0 * D6);
  BOOST_TEST(solution.acceleration.hasNaN());
  // Everything broken, before any good input: no torque rather than a wrong one.
  MotionProgram fresh(test::serial_arm(limits));
  Input broken;
  broken.q.setConstant(not_a_number), broken.v.setConstant(not_a_number), broken.a.setConstant(not_a_number);
  broken.M.setConstant(not_a_number), broken.h.setConstant(not_a_number);
  BOOST_TEST((solve(fresh, broken, solution) == ProgramStatus::fallback_invalid_input));
  BOOST_TEST(solution.torque.norm() == 0.0);
}

BOOST_AUTO_TEST_CASE(a_program_that_cannot_be_solved_gives_a_damped_stop) {
  const JointLimits limits = test::arm_limits(nv);
  MotionProgram controller(test::serial_arm(limits));
  MotionSolution solution(nv);
  Input in;
  in.v[0] = 1.0;
  in.a[2] = 1e300;  // finite, but the cost overflows
  in.h[3] = 1e200;
  in.M *= 1e160;
  BOOST_TEST((solve(controller, in, solution) == ProgramStatus::fallback_solver));
  BOOST_TEST(within_effort(solution, limits));
  BOOST_TEST(solution.torque[0] == -87.0);
  BOOST_TEST(controller.count(ProgramStatus::fallback_solver) == 1);
}

BOOST_AUTO_TEST_CASE(arms_without_limits) {
  MotionProgram controller(test::serial_arm(JointLimits::unlimited(nv)));
  MotionSolution solution(nv);
  Random random(5);
  Input in;
  in.a = 1e3 * random.vector(nv);
  in.M = test::random_mass(random, nv);
  BOOST_TEST((solve(controller, in, solution) == ProgramStatus::ok));
  BOOST_TEST((solution.acceleration - in.a).norm() < 1e-9);
  in.M.setConstant(not_a_number);
  in.v.setConstant(2.0);
  BOOST_TEST((solve(controller, in, solution) == ProgramStatus::fallback_invalid_input));
  BOOST_TEST(solution.torque[0] == -2.0);  // a damping of 1 where no limits give one
}

BOOST_AUTO_TEST_CASE(settings_of_the_torque_controller_are_checked) {
  const Robot arm = test::serial_arm(test::arm_limits(nv));
  const auto message_of = [&](auto&& change) {
    MotionProgramSettings settings;
    change(settings);
    try {
      MotionProgram controller(arm, settings);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  using S = MotionProgramSettings;
  BOOST_TEST(message_of([](S&) {}).empty());
  BOOST_TEST(message_of([](S& s) { s.period = 0.0; }).find("period is 0") != std::string::npos);
  BOOST_TEST(message_of([](S& s) { s.period = not_a_number; }).find("period is") != std::string::npos);
  BOOST_TEST(message_of([](S& s) { s.tracking_weight.setZero(); }).find("tracking_weight") != std::string::npos);
  BOOST_TEST(message_of([](S& s) { s.tracking_weight.setOnes(3); }).find("allowed are 1 or 7") != std::string::npos);
  BOOST_TEST(message_of([](S& s) { s.torque_weight.setConstant(-1.0); }).find("torque_weight") != std::string::npos);
  BOOST_TEST(message_of([](S& s) { s.torque_weight.setZero(); }).empty());
  BOOST_TEST(message_of([](S& s) { s.slack_weight = infinity; }).find("slack_weight") != std::string::npos);
  BOOST_TEST(message_of([](S& s) { s.velocity_overrun = 0.9; }).find("velocity_overrun is 0.9") != std::string::npos);
  BOOST_TEST(message_of([](S& s) { s.acceleration_overrun = infinity; }).find("acceleration_overrun") != std::string::npos);
  BOOST_TEST(message_of([](S& s) { s.velocity_overrun = s.acceleration_overrun = 1.0; }).empty());
  BOOST_TEST(message_of([](S& s) { s.stop_time = -1.0; }).find("stop_time") != std::string::npos);
  BOOST_TEST(message_of([](S& s) { s.stop_damping = 0.0; }).find("stop_damping") != std::string::npos);
  BOOST_TEST(message_of([](S& s) { s.position_margin = -0.1; }).find("position_margin") != std::string::npos);
  BOOST_TEST(message_of([](S& s) { s.position_margin = 2.5; }).find("joint1") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(statuses_have_names) {
  BOOST_TEST(std::string(name(ProgramStatus::fallback_invalid_input)) == "fallback_invalid_input");
  BOOST_TEST(std::string(name(ProgramFault::mass_matrix)) == "mass_matrix");
}

BOOST_AUTO_TEST_CASE(solve_allocates_nothing_on_any_path) {
  Random random(6);
  const JointLimits limits = test::arm_limits(nv);
  MotionProgram controller(test::serial_arm(limits));
  MotionSolution solution(nv);
  for (int trial = 0; trial < 3000; ++trial) {
    Input in = random_input(random, limits);
    switch (random.integer(0, 10)) {
      case 0: in.q[1] = not_a_number; break;
      case 1: in.v[1] = not_a_number; break;
      case 2: in.a[1] = not_a_number; break;
      case 3: in.M(1, 1) = not_a_number; break;
      case 4: in.h[1] = not_a_number; break;
      case 5: in.a[2] = 1e300, in.h[3] = 1e200, in.M *= 1e160; break;
      case 6: in.a.setZero(), in.q.setZero(), in.v.setZero(); break;
      default: break;
    }
    BOOST_REQUIRE_EQUAL(test::allocations_of([&] { static_cast<void>(solve(controller, in, solution)); }), 0u);
  }
  for (const ProgramStatus status : {ProgramStatus::ok, ProgramStatus::limited, ProgramStatus::relaxed,
                                     ProgramStatus::fallback_invalid_input, ProgramStatus::fallback_solver}) {
    BOOST_TEST(controller.count(status) > 0, name(status));
  }
}

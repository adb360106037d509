// The program for torque or acceleration, alone: what is wanted where limits allow it, and the damped stop.
#include <boost/test/unit_test.hpp>

#include "../../src/controller/joint_program.hpp"
#include "support/numbers.hpp"
#include "support/stage_model.hpp"

using namespace sidestep;
using Output = ControllerSettings::Output;

namespace {

constexpr double programmed = 1e-9;  // relative accuracy of what is solved exactly by the active set

/// The stage with an arm of two joints: 10 rad/s² less 2 %.
struct Programming {
  explicit Programming(Output output)
      : model(test::stage_model(2, test::straight_settings(output))),
        dynamics(model.dynamics, model.arm.robot(), model.settings, model.torque),
        program(within_margins(model.arm.robot(), model.settings, 1.0), model.settings, model.torque) {}

  const ControllerModel model;
  ArmDynamics dynamics;
  JointProgram program;
  MotionSolution solution{2};
  const Tick tick = Tick::regular(0.001);
  const Eigen::VectorXd q = Eigen::Vector2d(0.2, 0.7), v = Eigen::Vector2d::Zero();
};

}  // namespace

BOOST_AUTO_TEST_CASE(margins_leave_a_share_of_every_limit_but_position) {
  ControllerSettings settings;
  settings.limit_margin = 0.1;
  settings.effort_margin = 0.2;
  JointLimits limits = test::arm_limits(2);
  limits.jerk.setConstant(1000.0);
  limits.effort_rate.setConstant(100.0);
  const Robot robot = within_margins(test::serial_arm(limits), settings, 0.5);
  BOOST_TEST(std::abs(robot.limits().velocity[0] - 0.5 * 0.9 * 2.5) < 1e-15);  // rounding
  BOOST_TEST(std::abs(robot.limits().acceleration[0] - 9.0) < 1e-14);
  BOOST_TEST(std::abs(robot.limits().jerk[0] - 900.0) < 1e-12);
  BOOST_TEST(std::abs(robot.limits().effort_rate[0] - 90.0) < 1e-13);
  BOOST_TEST(std::abs(robot.limits().effort[0] - 0.8 * 87.0) < 1e-13);
  BOOST_TEST(robot.limits().upper[0] == 2.5);
}

BOOST_AUTO_TEST_CASE(an_acceleration_within_limits_is_given_as_wanted_and_one_beyond_is_cut) {
  Programming p(Output::position);
  const Eigen::VectorXd wanted = Eigen::Vector2d(5.0, -3.0);
  BOOST_TEST((p.program.solve(p.q, p.v, wanted, p.dynamics, nullptr, {}, {}, p.tick, p.solution) == ProgramStatus::ok));
  BOOST_TEST((p.solution.acceleration - wanted).norm() < programmed);
  const Eigen::VectorXd much = Eigen::Vector2d(50.0, -3.0);
  BOOST_TEST((p.program.solve(p.q, p.v, much, p.dynamics, nullptr, {}, {}, p.tick, p.solution) == ProgramStatus::limited));
  BOOST_TEST((p.solution.acceleration - Eigen::Vector2d(9.8, -3.0)).norm() < programmed);
  const Eigen::VectorXd last = Eigen::Vector2d(0.0, 0.0);  // jerk: 1000 rad/s³ less 2 %
  BOOST_TEST(
      (p.program.solve(p.q, p.v, wanted, p.dynamics, nullptr, {}, {&last}, p.tick, p.solution) == ProgramStatus::limited));
  BOOST_TEST((p.solution.acceleration - Eigen::Vector2d(0.98, -0.98)).norm() < programmed);
  BOOST_TEST(p.program.jerk_share(p.tick) == 1.0);
}

BOOST_AUTO_TEST_CASE(bounds_are_those_of_the_period_that_comes) {
  Programming p(Output::position);
  const Eigen::VectorXd last = Eigen::Vector2d::Zero(), wanted = Eigen::Vector2d(5.0, -3.0), fast = Eigen::Vector2d(2.44, 0.0);
  Tick slow = Tick::regular(0.004);
  slow.told = 0.001;
  static_cast<void>(p.program.solve(p.q, p.v, wanted, p.dynamics, nullptr, {}, {&last}, slow, p.solution));
  BOOST_TEST((p.solution.acceleration - Eigen::Vector2d(3.92, -3.0)).norm() < programmed);  // 980 rad/s³ for 4 ms
  static_cast<void>(p.program.solve(p.q, fast, wanted, p.dynamics, nullptr, {}, {}, slow, p.solution));
  BOOST_TEST(std::abs(fast[0] + 0.004 * p.solution.acceleration[0] - 2.45) < programmed);  // the velocity limit, not beyond
}

BOOST_AUTO_TEST_CASE(a_torque_is_that_of_the_acceleration_by_the_dynamics) {
  Programming p(Output::torque);
  p.dynamics.update(test::state_at(p.model.arm.robot(), p.q), {});
  const Eigen::VectorXd wanted = Eigen::Vector2d(5.0, -3.0);
  BOOST_TEST((p.program.solve(p.q, p.v, wanted, p.dynamics, nullptr, {}, {}, p.tick, p.solution) == ProgramStatus::ok));
  // The price of torque costs tracking of about 1e-8 rad/s², see MotionProgramSettings.
  BOOST_TEST((p.solution.acceleration - wanted).norm() < 1e-7);
  const Eigen::VectorXd torque = p.dynamics.mass() * p.solution.acceleration + p.dynamics.bias();
  BOOST_TEST((p.solution.torque - torque).norm() < programmed);
}

BOOST_AUTO_TEST_CASE(an_arm_whose_state_is_unusable_is_stopped_with_the_torque_that_holds_it) {
  Programming p(Output::torque);
  p.dynamics.update(test::state_at(p.model.arm.robot(), p.q), {});
  const Eigen::VectorXd unknown = Eigen::VectorXd::Constant(2, test::not_a_number), rest = Eigen::VectorXd::Zero(2);
  BOOST_TEST((p.program.stop(unknown, unknown, rest, {}, p.dynamics, nullptr, p.tick, p.solution) ==
              ProgramStatus::fallback_invalid_input));
  BOOST_TEST((p.solution.fault == ProgramFault::position));
  BOOST_TEST((p.solution.torque - p.dynamics.bias()).norm() < programmed);  // gravity: no velocity is known to be damped
  const Eigen::MatrixXd mass = Eigen::MatrixXd::Identity(2, 2);
  const Eigen::VectorXd bias = Eigen::Vector2d(2.0, -1.0);
  const Eigen::Ref<const Eigen::MatrixXd> told_mass(mass);
  const Eigen::Ref<const Eigen::VectorXd> told_bias(bias);
  const ToldDynamics told{&told_mass, &told_bias};
  BOOST_TEST((p.program.stop(unknown, unknown, rest, told, p.dynamics, nullptr, p.tick, p.solution) ==
              ProgramStatus::fallback_invalid_input));
  BOOST_TEST((p.solution.torque - bias).norm() < programmed);
}

BOOST_AUTO_TEST_CASE(what_the_program_stays_near_has_gravity_where_there_is_a_model) {
  Programming with(Output::torque), without(Output::position);
  const LastCommand last = near_last(with.q, &with.v, with.dynamics, 3.0, false);
  BOOST_TEST((last.acceleration == &with.q));
  BOOST_TEST((last.torque == &with.v));
  BOOST_TEST((last.gravity == &with.dynamics.gravity()));
  BOOST_TEST((last.gravity_change == &with.dynamics.gravity_change()));
  BOOST_TEST(last.acceleration_factor == 3.0);
  BOOST_TEST(!last.binds);
  BOOST_TEST((near_last(with.q, nullptr, without.dynamics, 1.0, true).gravity == nullptr));
}

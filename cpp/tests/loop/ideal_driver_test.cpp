// An ideal robot is where it is told to be, at the speed that it is told.
#include "sidestep/loop/ideal_driver.hpp"

#include <boost/test/unit_test.hpp>
#include <chrono>
#include <thread>

#include "support/covered_arm.hpp"
#include "support/numbers.hpp"

using namespace sidestep;
using test::covered_arm;
using test::nv;
using Output = ControllerSettings::Output;

BOOST_AUTO_TEST_CASE(a_command_is_held_until_the_robot_is_read_again) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  for (const Output output : {Output::position, Output::velocity, Output::acceleration}) {
    IdealDriver robot(arm, Eigen::VectorXd::Zero(nv));
    robot.start(output);
    RobotState before(nv), now(nv), after(nv);
    robot.read(before, 0.0);
    Command command(nv);
    command.position.setConstant(0.01);
    command.velocity.setConstant(0.5);
    command.acceleration.setConstant(25.0);
    robot.write(command);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    robot.read(now, 0.0);
    const double elapsed = now.time - before.time;
    BOOST_TEST(elapsed >= 0.02);
    const double held = elapsed > 0.1 ? 0.001 : elapsed;  // this machine stood still
    const double v = output == Output::acceleration ? held * 25.0 : 0.5;
    BOOST_TEST(now.v[0] == v, boost::test_tools::tolerance(1e-9));
    BOOST_TEST(now.q[0] == (output == Output::position ? 0.01 : held * v), boost::test_tools::tolerance(1e-9));
    robot.read(after, 0.0);
    BOOST_TEST(after.q == now.q);
  }
}

BOOST_AUTO_TEST_CASE(commands_that_are_held_for_too_long_do_not_drive_it_beyond_its_drives_and_stops,
                     *boost::unit_test::timeout(60)) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  const JointLimits& limits = arm.robot().limits();
  IdealDriver robot(arm, Eigen::VectorXd::Zero(nv));
  robot.start(Output::acceleration);
  RobotState state(nv);
  Command command(nv);
  for (int n = 0; n < 100; ++n) {  // brakes by v / 5 ms, for 20 ms: four times as fast the other way each time
    robot.read(state, 0.0);
    command.acceleration = -200.0 * state.v;
    command.acceleration[0] += 1.0;
    robot.write(command);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    robot.read(state, 0.0);
    robot.write(command);
    BOOST_TEST((state.v.cwiseAbs() - 1.3 * limits.velocity).maxCoeff() <= 0.0);
    BOOST_TEST((state.q - limits.upper).maxCoeff() <= 0.1 + 1e-9);
    BOOST_TEST((limits.lower - state.q).maxCoeff() <= 0.1 + 1e-9);
  }
}

BOOST_AUTO_TEST_CASE(a_robot_that_takes_velocities_does_not_go_on_with_an_acceleration_before) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  IdealDriver robot(arm, Eigen::VectorXd::Zero(nv), 0.001, false);
  RobotState state(nv);
  Command command(nv);
  command.velocity.setConstant(0.5);
  command.acceleration.setConstant(10.0);
  for (const Output output : {Output::acceleration, Output::velocity}) {
    robot.start(output);
    robot.write(command);
    robot.read(state, 0.0);
  }
  BOOST_TEST(state.v[0] == 0.5);
}

BOOST_AUTO_TEST_CASE(a_robot_that_nobody_leads_stays_where_it_is) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  IdealDriver robot(arm, Eigen::VectorXd::Zero(nv));
  robot.start(Output::acceleration);
  RobotState state(nv);
  robot.read(state, 0.0);
  Command command(nv);
  command.acceleration.setConstant(10.0);
  robot.write(command);
  std::this_thread::sleep_for(std::chrono::milliseconds(150));
  robot.read(state, 0.0);
  BOOST_TEST(state.v[0] == 0.01, boost::test_tools::tolerance(1e-9));  // as after a period; 1.5 rad/s where it holds on
  robot.write(command);
  robot.read(state, 0.0);
  BOOST_TEST(state.v[0] < 0.1 + 0.01);  // the pause before a command says nothing of how long it is held
}

BOOST_AUTO_TEST_CASE(a_robot_that_takes_positions_has_the_speed_of_the_reference_however_soon_they_come) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  IdealDriver robot(arm, Eigen::VectorXd::Zero(nv), 0.002, false);
  robot.start(Output::position);
  RobotState state(nv);
  robot.read(state, 0.0);
  BOOST_TEST(state.time == 0.002);
  Command command(nv);
  command.position.setConstant(0.01);  // of a loop that was called every 20 ms, and comes sooner once
  command.velocity.setConstant(0.5);
  robot.write(command);
  robot.read(state, 0.0);
  BOOST_TEST(state.time == 0.004);
  BOOST_TEST(state.q[0] == 0.01);
  BOOST_TEST(state.v[0] == 0.5);
}

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

BOOST_AUTO_TEST_CASE(a_robot_that_is_read_late_has_the_speed_of_the_time_that_went_by) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  for (const Output output : {Output::position, Output::velocity, Output::acceleration}) {
    IdealDriver robot(arm, Eigen::VectorXd::Zero(nv));
    robot.start(output);
    RobotState before(nv), now(nv), after(nv);
    robot.read(before, 0.0);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    robot.read(now, 0.0);
    const double elapsed = now.time - before.time;
    BOOST_TEST(elapsed >= 0.02);
    Command command(nv);
    command.position.setConstant(0.01);
    command.velocity.setConstant(0.01 / elapsed);
    command.acceleration.setConstant(0.01 / elapsed / elapsed);
    robot.write(command);
    robot.read(after, 0.0);
    BOOST_TEST(after.q[0] == 0.01, boost::test_tools::tolerance(1e-9));
    BOOST_TEST(after.v[0] == 0.01 / elapsed, boost::test_tools::tolerance(1e-9));
  }
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

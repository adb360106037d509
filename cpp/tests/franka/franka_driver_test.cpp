// The driver of Franka's robots, compiled against a stub of libfranka: what it sends, and what it leaves unsent.
#define SIDESTEP_FRANKA_CLOCK franka::script.now
#include "../../src/loop/franka_driver.cpp"

#include <boost/test/unit_test.hpp>

using namespace sidestep;

namespace franka_test {

constexpr int nv = 7;

// A driver that controls by `output`, of a robot that rests at 0.1 rad in each joint.
struct Fixture {
  Fixture() {
    franka::script = {};
    franka::script.idle.q.fill(0.1);
    franka::script.idle.q_d.fill(0.1);
    command.position = Eigen::VectorXd::Constant(nv, 0.1);
    command.velocity = command.acceleration = command.torque_without_gravity = Eigen::VectorXd::Zero(nv);
  }

  void answer() {
    BOOST_REQUIRE(driver.read(state, 1.0) == DriverResult::ok);
    BOOST_REQUIRE(driver.write(command) == DriverResult::ok);
  }

  Command command{nv};
  RobotState state{nv};
  FrankaDriver driver{"robot", false};
};

}  // namespace franka_test

using namespace franka_test;

BOOST_FIXTURE_TEST_CASE(describes_a_research_3, Fixture) {
  const RobotDescription& description = driver.description();
  BOOST_CHECK_NO_THROW(description.validate());
  BOOST_TEST(description.joints.size() == 7U);
  BOOST_TEST(description.limits.velocity[5] == 4.18);
  BOOST_CHECK_EXCEPTION(FrankaDriver("nowhere"), franka::NetworkException,
                        [](const auto& error) { return std::string(error.what()) == "no robot at nowhere"; });
  BOOST_CHECK_THROW(driver.start(ControllerSettings::Output::acceleration), std::invalid_argument);
}

BOOST_FIXTURE_TEST_CASE(sends_each_output_within_the_limits, Fixture) {
  driver.start(ControllerSettings::Output::torque);
  command.torque_without_gravity.setConstant(5.0);
  answer();
  BOOST_TEST(franka::script.written.back().kind == 't');
  BOOST_TEST(franka::script.written.back().values[3] == 0.95, boost::test_tools::tolerance(1e-12));  // 0.95 of 1,000 Nm/s
  driver.stop();
  BOOST_TEST(franka::script.written.back().finished);
  driver.start(ControllerSettings::Output::velocity);
  command.velocity.setConstant(1.0);
  answer();
  BOOST_TEST(franka::script.written.back().kind == 'v');
  BOOST_TEST(franka::script.written.back().values[0] == 0.00475, boost::test_tools::tolerance(1e-9));  // 0.95 of 5,000 rad/s³
  driver.stop();
  driver.start(ControllerSettings::Output::position);
  answer();
  BOOST_TEST(franka::script.written.back().kind == 'p');
  BOOST_TEST(state.told_position[6] == 0.1);
  BOOST_TEST(state.lost_cycles == 0);
}

BOOST_FIXTURE_TEST_CASE(a_late_answer_is_not_sent, Fixture) {
  driver.start(ControllerSettings::Output::torque);
  BOOST_REQUIRE(driver.read(state, 1.0) == DriverResult::ok);
  franka::script.now += 0.001;
  BOOST_REQUIRE(driver.write(command) == DriverResult::ok);
  BOOST_TEST(franka::script.written.empty());
  BOOST_TEST(driver.late() == 1);
  BOOST_REQUIRE(driver.read(state, 1.0) == DriverResult::ok);
  BOOST_TEST(state.lost_cycles == 1);
}

BOOST_FIXTURE_TEST_CASE(the_first_state_after_a_gap_is_not_answered, Fixture) {
  driver.start(ControllerSettings::Output::velocity);
  answer();
  franka::RobotState after = franka::script.idle, second = after;
  after.q.fill(0.2);
  second.q.fill(0.3);
  second.dq_d.fill(0.05);
  franka::script.next = {{after, 4, false}, {second, 1, true}};
  BOOST_REQUIRE(driver.read(state, 1.0) == DriverResult::ok);
  BOOST_TEST(state.q[0] == 0.3);
  BOOST_TEST(state.lost_cycles == 4);  // of 4 cycles the first was answered; then one is left unanswered
  BOOST_TEST(state.told_velocity[0] == 0.05);
}

BOOST_FIXTURE_TEST_CASE(an_answer_that_the_robot_counts_as_lost_leaves_the_next_unanswered, Fixture) {
  driver.start(ControllerSettings::Output::position);
  answer();
  franka::RobotState lost = franka::script.idle, next = lost;
  lost.control_command_success_rate = next.control_command_success_rate = 0.99;
  next.q.fill(0.3);
  franka::script.next = {{lost, 1, true}, {next, 1, true}};
  BOOST_REQUIRE(driver.read(state, 1.0) == DriverResult::ok);
  BOOST_TEST(state.q[0] == 0.3);
  BOOST_TEST(state.lost_cycles == 1);
}

BOOST_FIXTURE_TEST_CASE(a_reflex_and_a_lost_connection_are_told_apart, Fixture) {
  driver.start(ControllerSettings::Output::torque);
  franka::script.fails = [] { throw franka::ControlException("aborted by reflex"); };
  BOOST_CHECK(driver.read(state, 1.0) == DriverResult::stopped);
  BOOST_TEST(driver.trouble() == "aborted by reflex");
  BOOST_CHECK(driver.write(command) == DriverResult::stopped);
  driver.stop();
  franka::script.idle.robot_mode = franka::RobotMode::kReflex;
  BOOST_CHECK_EXCEPTION(driver.start(ControllerSettings::Output::torque), std::runtime_error, [](const auto& error) {
    return std::string(error.what()).find("recover() ends a reflex") != std::string::npos;
  });
  driver.recover();
  BOOST_TEST(franka::script.recovered == 1);
  franka::script.idle.robot_mode = franka::RobotMode::kIdle;
  franka::script.fails = {};
  driver.start(ControllerSettings::Output::torque);
  franka::script.fails = [] { throw franka::NetworkException("timeout"); };
  BOOST_CHECK(driver.read(state, 1.0) == DriverResult::lost);
  BOOST_TEST(driver.trouble() == "timeout");
  driver.stop();
}

BOOST_FIXTURE_TEST_CASE(a_motion_under_way_is_stopped_by_the_robot, Fixture) {
  driver.start(ControllerSettings::Output::velocity);
  answer();
  franka::script.idle.dq.fill(0.5);
  driver.stop();
  BOOST_TEST(franka::script.stopped == 1);
  BOOST_TEST(!franka::script.written.back().finished);
  driver.stop();
  BOOST_TEST(franka::script.stopped == 1);
}

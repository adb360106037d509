// A robot's port and the driver that talks to it.
#include <atomic>
#include <boost/test/unit_test.hpp>
#include <chrono>
#include <limits>
#include <optional>
#include <system_error>
#include <thread>

#include "sidestep/link/robot_port.hpp"
#include "sidestep/link/simulator_driver.hpp"
#include "support/allocations.hpp"
#include "support/link_address.hpp"

using namespace sidestep;
using namespace sidestep::link;
using Output = ControllerSettings::Output;
using test::LinkAddress;

namespace {

RobotHello two_joints() {
  RobotHello hello;
  hello.name = "two";
  hello.joints = {"a", "b"};
  hello.limits.lower = Eigen::Vector2d(-1.0, -2.0);
  hello.limits.upper = Eigen::Vector2d(1.0, 2.0);
  hello.limits.velocity = hello.limits.acceleration = hello.limits.effort = hello.limits.jerk = Eigen::Vector2d(10.0, 20.0);
  hello.limits.effort_rate = Eigen::Vector2d(1000.0, 500.0);
  hello.outputs = {Output::torque, Output::position};
  hello.period = 0.002;
  hello.real_time = false;
  hello.when_silent = "rests";
  return hello;
}

RobotStateMessage state_of(std::uint64_t cycle, RobotMode mode) {
  RobotStateMessage state;
  state.cycle = cycle;
  state.time = 0.002 * static_cast<double>(cycle);
  state.q = Eigen::Vector2d(0.1 * static_cast<double>(cycle), 0.0);
  state.v = state.torque = Eigen::Vector2d::Zero();
  state.told_position = state.told_velocity = state.told_acceleration =
      Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  state.mode = mode;
  return state;
}

/// Connects a driver while the port, in this thread, accepts it.
std::unique_ptr<SimulatorDriver> connect(RobotPort& port) {
  std::unique_ptr<SimulatorDriver> driver;
  std::thread connecting([&] { driver = std::make_unique<SimulatorDriver>(port.address()); });
  for (int k = 0; port.num_connections() == 0 && k < 500; ++k) {
    port.receive(0.01);
  }
  connecting.join();
  return driver;
}

/// Starts control while the port answers.
void start(RobotPort& port, SimulatorDriver& driver, Output output, std::uint64_t cycle) {
  std::thread starting([&] { driver.start(output); });
  const auto request = port.receive(5.0);
  port.send(state_of(cycle - 1, RobotMode::waiting));  // left before the start came
  port.send(state_of(cycle, RobotMode::controlled));
  starting.join();
  BOOST_REQUIRE(request.has_value());
  BOOST_TEST((request->kind == RobotRequest::Kind::start));
  BOOST_TEST((request->output == output));
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_driver_is_told_what_the_robot_is) {
  const LinkAddress at;
  RobotPort port(at.text(), two_joints());
  const auto driver = connect(port);
  const RobotDescription& robot = driver->description();
  BOOST_TEST(robot.name == "two");
  BOOST_TEST(robot.joints == (std::vector<std::string>{"a", "b"}));
  BOOST_TEST(robot.limits.upper == Eigen::VectorXd(Eigen::Vector2d(1.0, 2.0)));
  BOOST_TEST(robot.period == 0.002);
  BOOST_TEST(!robot.real_time);
  BOOST_TEST(robot.when_silent == "rests");
  BOOST_TEST(robot.outputs.size() == 2u);
}

BOOST_AUTO_TEST_CASE(states_and_commands_pass_and_nothing_is_allocated) {
  const LinkAddress at;
  RobotPort port(at.text(), two_joints());
  const auto driver = connect(port);
  RobotState state(2);
  BOOST_TEST((driver->read(state, 0.0) == DriverResult::waiting));
  port.send(state_of(3, RobotMode::waiting));
  BOOST_TEST((driver->read(state, 1.0) == DriverResult::ok));
  BOOST_TEST(state.time == 0.006);
  start(port, *driver, Output::torque, 5);
  BOOST_TEST((driver->read(state, 1.0) == DriverResult::ok));
  BOOST_TEST(state.time == 0.01);  // that of the start
  Command command(2);
  command.torque_without_gravity = Eigen::Vector2d(1.0, -1.0);
  BOOST_TEST((driver->write(command) == DriverResult::ok));
  auto request = port.receive(1.0);
  BOOST_REQUIRE(request.has_value());
  BOOST_TEST((request->kind == RobotRequest::Kind::command));
  BOOST_TEST(request->cycle == 5u);
  BOOST_TEST(request->values == command.torque_without_gravity);
  RobotStateMessage next = state_of(6, RobotMode::controlled);
  next.taken = request->sequence;
  next.taken_cycle = 5;
  next.lost_cycles = 2;
  port.send(next);
  DriverResult read = DriverResult::waiting, written = read;
  BOOST_TEST(test::allocations_of([&] {
               read = driver->read(state, 1.0);
               written = driver->write(command);
             }) == 0u);
  BOOST_TEST((read == DriverResult::ok && written == DriverResult::ok));
  BOOST_TEST(state.lost_cycles == 2);
  driver->stop();
  const auto kind_of_next = [&port] {
    const std::optional<RobotRequest> next_request = port.receive(1.0);
    BOOST_REQUIRE(next_request.has_value());
    return next_request.value().kind;
  };
  RobotRequest::Kind kind = kind_of_next();
  while (kind == RobotRequest::Kind::command) {
    kind = kind_of_next();
  }
  BOOST_TEST((kind == RobotRequest::Kind::stop));
}

BOOST_AUTO_TEST_CASE(a_state_is_moved_on_to_where_its_command_arrives) {
  const LinkAddress at;
  RobotPort port(at.text(), two_joints());
  const auto driver = connect(port);
  start(port, *driver, Output::torque, 10);
  RobotState state(2);
  BOOST_TEST((driver->read(state, 1.0) == DriverResult::ok));
  Command command(2);
  command.torque_without_gravity = Eigen::Vector2d::Zero();
  command.acceleration = Eigen::Vector2d(4.0, 0.0);
  BOOST_TEST((driver->write(command) == DriverResult::ok));
  const auto request = port.receive(1.0);
  BOOST_REQUIRE(request.has_value());
  RobotStateMessage later = state_of(14, RobotMode::controlled);  // three cycles on the way, moved by it since the 13th
  later.taken = request->sequence;
  later.taken_cycle = 13;
  later.q.setZero();
  port.send(later);
  BOOST_TEST((driver->read(state, 1.0) == DriverResult::ok));
  BOOST_TEST(driver->delay() == 3 * 0.002);
  BOOST_TEST(state.time == 17 * 0.002, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(state.v[0] == 3 * 4.0 * 0.002, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(state.q[0] == (1 + 2 + 3) * 4.0 * 0.002 * 0.002, boost::test_tools::tolerance(1e-12));
}

BOOST_AUTO_TEST_CASE(of_several_states_the_newest_is_read) {
  const LinkAddress at;
  RobotPort port(at.text(), two_joints());
  const auto driver = connect(port);
  for (const std::uint64_t cycle : {1u, 2u, 3u}) {
    port.send(state_of(cycle, RobotMode::waiting));
  }
  RobotState state(2);
  BOOST_TEST((driver->read(state, 1.0) == DriverResult::ok));
  BOOST_TEST(state.q[0] == 0.1 * 3.0);
  BOOST_TEST((driver->read(state, 0.0) == DriverResult::waiting));
}

BOOST_AUTO_TEST_CASE(a_robot_that_stops_itself_says_why) {
  const LinkAddress at;
  RobotPort port(at.text(), two_joints());
  const auto driver = connect(port);
  start(port, *driver, Output::position, 1);
  port.stop("no command for 20 cycles");
  RobotState state(2);
  BOOST_TEST((driver->read(state, 1.0) == DriverResult::ok));  // that of the start
  BOOST_TEST((driver->read(state, 1.0) == DriverResult::stopped));
  BOOST_TEST(driver->trouble() == "no command for 20 cycles");
  BOOST_TEST((driver->write(Command(2)) == DriverResult::stopped));
  start(port, *driver, Output::position, 9);  // and lets itself be started again
  BOOST_TEST((driver->read(state, 1.0) == DriverResult::ok));
}

BOOST_AUTO_TEST_CASE(one_driver_controls_and_who_goes_is_noticed) {
  const LinkAddress at;
  RobotPort port(at.text(), two_joints());
  auto first = connect(port);
  start(port, *first, Output::torque, 1);
  std::unique_ptr<SimulatorDriver> second;
  std::string words;
  std::atomic<bool> done = false;
  std::thread connecting([&] {
    second = std::make_unique<SimulatorDriver>(port.address());
    try {
      second->start(Output::torque);
    } catch (const std::runtime_error& error) {
      words = error.what();
    }
    done = true;
  });
  for (int k = 0; !done && k < 500; ++k) {
    BOOST_TEST(!port.receive(0.01).has_value());
  }
  connecting.join();
  BOOST_TEST(words == "the robot does not let itself be controlled: another driver controls the robot");
  BOOST_TEST(port.num_connections() == 2);
  first.reset();
  const auto request = port.receive(1.0);
  BOOST_REQUIRE(request.has_value());
  BOOST_TEST((request->kind == RobotRequest::Kind::gone));
  BOOST_TEST(port.num_connections() == 1);
}

BOOST_AUTO_TEST_CASE(a_robot_that_goes_is_lost) {
  const LinkAddress at;
  auto port = std::make_unique<RobotPort>(at.text(), two_joints());
  const auto driver = connect(*port);
  start(*port, *driver, Output::torque, 1);
  RobotState state(2);
  BOOST_TEST((driver->read(state, 1.0) == DriverResult::ok));
  port.reset();
  BOOST_TEST((driver->read(state, 1.0) == DriverResult::lost));
  BOOST_TEST(driver->trouble() == "the other side has closed the connection");
  BOOST_CHECK_THROW(driver->start(Output::torque), std::runtime_error);
}

BOOST_AUTO_TEST_CASE(what_breaks_the_protocol_is_refused_and_others_go_on) {
  const LinkAddress at;
  RobotPort port(at.text(), two_joints());
  const auto driver = connect(port);
  start(port, *driver, Output::torque, 1);
  const auto refused = [&](const std::vector<std::byte>& bytes) {
    Connection wild{Address(port.address())};
    BOOST_TEST(wild.send(bytes, 1.0));
    for (int k = 0; k < 5; ++k) {
      BOOST_TEST(!port.receive(0.02).has_value());
    }
    BOOST_TEST(port.num_connections() == 1);
    return port.refusals().front();
  };
  const std::string text = "GET / HTTP/1.1\r\nHost: a\r\n\r\n";
  const auto* const raw = reinterpret_cast<const std::byte*>(text.data());
  BOOST_TEST(refused({raw, raw + text.size()}).find("no message of Sidestep") != std::string::npos);
  binary::Bytes bytes;
  Header header;
  header.type = MessageType::robot_command;
  header.payload = 1u << 30;
  binary::Encoder<binary::Bytes> archive(bytes);
  describe(archive, header);
  BOOST_TEST(refused(bytes.bytes).find("too long") != std::string::npos);
  // From the driver in control: another size, another output, what is not finite.
  Connection other{Address(port.address())};
  driver->stop();
  BOOST_TEST((port.receive(1.0)->kind == RobotRequest::Kind::stop));
  BOOST_TEST(other.send(RobotStart{Output::torque}));
  BOOST_TEST((port.receive(1.0)->kind == RobotRequest::Kind::start));
  RobotCommandMessage command;
  command.output = Output::torque;
  command.values = Eigen::Vector3d::Zero();
  BOOST_TEST(other.send(command));
  BOOST_TEST((port.receive(1.0)->kind == RobotRequest::Kind::gone));
  BOOST_TEST(port.refusals().front() == "values has 3 entries, not 2");
}

BOOST_AUTO_TEST_CASE(an_output_that_the_robot_does_not_take_is_refused) {
  const LinkAddress at;
  RobotPort port(at.text(), two_joints());
  const auto driver = connect(port);
  std::string words;
  std::atomic<bool> done = false;
  std::thread starting([&] {
    try {
      driver->start(Output::velocity);
    } catch (const std::runtime_error& error) {
      words = error.what();
    }
    done = true;
  });
  for (int k = 0; !done && k < 500; ++k) {
    port.receive(0.01);
  }
  starting.join();
  BOOST_TEST(words == "the robot does not let itself be controlled: the robot does not take this output");
}

BOOST_AUTO_TEST_CASE(who_is_no_robot_or_not_there_is_named) {
  BOOST_CHECK_THROW(SimulatorDriver{LinkAddress().text()}, std::system_error);
  const LinkAddress at;
  const Listener silent{Address(at.text())};
  BOOST_CHECK_THROW((SimulatorDriver{silent.address().text(), 0.05}), std::runtime_error);
  RobotHello wrong = two_joints();
  wrong.period = 0.0;
  BOOST_CHECK_THROW((RobotPort{LinkAddress().text(), wrong}), std::invalid_argument);
}

BOOST_AUTO_TEST_CASE(other_messages_make_no_read_longer) {
  const LinkAddress at;
  RobotPort port(at.text(), two_joints());
  const auto driver = connect(port);
  RobotObjects objects;
  objects.names = {"ball"};
  objects.poses = Eigen::MatrixXd::Zero(1, 7);
  std::atomic<bool> done = false;
  std::thread talking([&] {  // twenty times a timeout, unless the reader has come back
    for (int k = 0; !done && k < 200; ++k) {
      port.send(objects);
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  });
  RobotState state(2);
  const auto began = std::chrono::steady_clock::now();
  BOOST_TEST((driver->read(state, 0.1) == DriverResult::waiting));
  const double taken = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  BOOST_TEST((driver->read(state, std::numeric_limits<double>::quiet_NaN()) == DriverResult::waiting));
  done = true;
  talking.join();
  BOOST_TEST(taken < 1.0);  // [s] on a busy machine; all that talking takes 2 s
}

BOOST_AUTO_TEST_CASE(every_connection_of_a_robot_has_its_turn) {
  const LinkAddress at;
  RobotPort port(at.text(), two_joints());
  const auto connected = [&port] {
    Connection made{Address(port.address())};
    BOOST_TEST(!port.receive(0.0).has_value());  // takes it
    return made;
  };
  Connection talker = connected(), driver = connected();
  RobotCommandMessage command;
  command.output = Output::torque;
  command.values = Eigen::Vector2d::Zero();
  BOOST_TEST(driver.send(RobotStart{Output::torque}));
  BOOST_TEST((port.receive(1.0)->kind == RobotRequest::Kind::start));
  // Much that asks for nothing, and then what breaks the protocol.
  for (int k = 0; k < 200; ++k) {
    BOOST_TEST(talker.send(RobotStop{"a word"}));
  }
  const std::string text = "no message of this protocol";
  BOOST_TEST(talker.send(std::as_bytes(std::span(text)), 1.0));
  BOOST_TEST(driver.send(command));
  BOOST_TEST((port.receive(1.0)->kind == RobotRequest::Kind::command));
  BOOST_TEST(port.refusals().empty());  // the talker is not yet heard to the end
  BOOST_TEST(!port.receive(0.1).has_value());
  BOOST_TEST(port.refusals().size() == 1u);
  // Nor does who is in control keep others from being heard.
  Connection other = connected();
  for (int k = 0; k < 10; ++k) {
    BOOST_TEST(driver.send(command));
  }
  BOOST_TEST(other.send(std::as_bytes(std::span(text)), 1.0));
  for (int k = 0; k < 3; ++k) {
    BOOST_TEST((port.receive(1.0)->kind == RobotRequest::Kind::command));
  }
  BOOST_TEST(port.refusals().size() == 2u);
}

BOOST_AUTO_TEST_CASE(objects_are_for_viewers) {
  const LinkAddress at;
  RobotPort port(at.text(), two_joints());
  Connection viewer{Address(port.address())}, driver{Address(port.address())};
  BOOST_TEST(driver.send(RobotStart{Output::torque}));
  BOOST_TEST((port.receive(1.0)->kind == RobotRequest::Kind::start));
  port.send(RobotObjects{{"ball"}, Eigen::MatrixXd::Zero(1, 7)});
  port.send(state_of(1, RobotMode::controlled));
  const auto types = [](Connection& connection) {
    std::vector<MessageType> found;
    RawMessage raw;
    while (connection.receive(raw, 0.1) == Received::message) {
      found.push_back(raw.header.type);
    }
    return found;
  };
  BOOST_TEST((types(viewer) == std::vector{MessageType::robot_hello, MessageType::robot_objects, MessageType::robot_state}));
  BOOST_TEST((types(driver) == std::vector{MessageType::robot_hello, MessageType::robot_state}));
}

BOOST_AUTO_TEST_CASE(a_long_reason_of_a_robot_arrives_cut) {
  const LinkAddress at;
  RobotPort port(at.text(), two_joints());
  const auto driver = connect(port);
  start(port, *driver, Output::position, 1);
  port.stop(std::string(longest_text - 1, 'x') + "×");  // whose second byte is too much
  RobotState state(2);
  BOOST_TEST((driver->read(state, 1.0) == DriverResult::ok));  // that of the start
  BOOST_TEST((driver->read(state, 1.0) == DriverResult::stopped));
  BOOST_TEST(driver->trouble() == std::string(longest_text - 1, 'x'));
}

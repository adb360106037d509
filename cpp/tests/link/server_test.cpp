// Server and client: what a client asks for happens to the arm, and only the one in command moves it.
#include "sidestep/link/server.hpp"

#include <boost/test/unit_test.hpp>
#include <chrono>
#include <numbers>
#include <thread>

#include "sidestep/link/client.hpp"
#include "sidestep/link/socket.hpp"
#include "sidestep/link/request_messages.hpp"
#include "sidestep/link/token.hpp"
#include "sidestep/loop/ideal_driver.hpp"
#include "sidestep/loop/loop.hpp"
#include "support/allocations.hpp"
#include "support/covered_arm.hpp"
#include "support/link_address.hpp"
#include "support/numbers.hpp"

using namespace sidestep;
using namespace sidestep::link;
using test::nv;

namespace {

/// An ideal arm that is served.
struct Served {
  Served() : arm(test::covered_arm(test::arm_limits(nv))), controller(arm, settings()), driver(arm, Eigen::VectorXd::Zero(nv)) {
    controller.set_obstacles(Obstacles::none());
    server.emplace(controller, ServerSettings{.address = address.text(), .token = "secret"});
    loop.emplace(controller, driver,
                 LoopSettings{.priority = 0, .lock_memory = false, .state_timeout = 10.0, .longest_gap = 10.0},
                 std::vector<CycleObserver*>{&*server});
    loop->start();
    server->run_began();
  }
  ~Served() {
    loop->stop();
    loop->finish();
  }
  static ControllerSettings settings() {
    ControllerSettings made;
    made.output = ControllerSettings::Output::position;
    return made;
  }
  ClientSettings with_token(const std::string& name) const { return {.name = name, .token = "secret", .rate = 1000.0}; }

  test::LinkAddress address;
  Arm arm;
  Controller controller;
  IdealDriver driver;
  std::optional<Server> server;
  std::optional<Loop> loop;
};

const Eigen::VectorXd goal = Eigen::VectorXd::Constant(nv, 0.3);

bool says(const std::exception& error, const std::string& words) {
  BOOST_TEST_MESSAGE(error.what());
  return std::string(error.what()).find(words) != std::string::npos;
}

#define CHECK_SAYS(call, type, words) BOOST_CHECK_EXCEPTION(call, type, [](const type& error) { return says(error, words); })

/// Waits for a cycle in which the goal is gone.
bool comes_to_rest(Client& client) {
  return client.wait(
      [](const CycleMessage& cycle) {
        return cycle.command.activity == Activity::no_goal && cycle.command.velocity.cwiseAbs().maxCoeff() < 1e-6;
      },
      5.0);
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_client_moves_the_arm_to_its_goal) {
  Served served;
  Client client(served.server->address(), served.with_token("first"));
  BOOST_TEST(client.welcome().arm == "covered_arm");
  BOOST_TEST(client.num_coordinates() == nv);
  client.take_command();
  BOOST_TEST(client.is_in_command());
  BOOST_TEST(client.set_goal(goal).empty());
  BOOST_TEST(client.wait_arrived(10.0));
  BOOST_TEST((client.cycle().state.q - goal).cwiseAbs().maxCoeff() < 0.01);  // ArrivalSettings: 0.01 rad
  BOOST_TEST(client.explain().find("arriv") != std::string::npos);           // beside what it says of a late loop
  // A new goal is not taken for the old one that was reached.
  client.set_goal(Eigen::VectorXd(-goal));
  BOOST_TEST(!client.wait_arrived(0.05));
  BOOST_TEST(client.wait_arrived(10.0));
  BOOST_TEST((client.cycle().state.q + goal).cwiseAbs().maxCoeff() < 0.01);
  client.set_goal(Goal(test::pose_of(served.arm.robot(), goal)));
  BOOST_TEST(client.wait_arrived(10.0));
}

BOOST_AUTO_TEST_CASE(the_client_of_the_guide) {
  const Served served;
  const Address address = served.server->address();
  Client client(address, {.name = "planner", .token = read_token(default_token_file(address)), .rate = 1000.0});
  client.take_command();
  client.set_goal(goal);
  client.wait_arrived(20.0);
  BOOST_TEST((client.cycle().state.q - goal).cwiseAbs().maxCoeff() < 0.01);
}

BOOST_AUTO_TEST_CASE(every_cycle_reaches_a_client_that_asks_for_it) {
  Served served;
  ClientSettings settings = served.with_token("all");
  settings.rate = std::numeric_limits<double>::infinity();
  Client client(served.server->address(), settings);
  CycleMessage cycle;
  BOOST_TEST(client.next_cycle(cycle, 0, 1.0));
  const std::uint64_t begin = cycle.cycle;
  std::uint64_t came = 0;
  for (; cycle.cycle < begin + 200; ++came) {
    BOOST_REQUIRE(client.next_cycle(cycle, cycle.cycle, 1.0));
  }
  BOOST_TEST(came > 150);  // of 200; the client keeps the newest alone
  client.subscribe(50.0);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  client.next_cycle(cycle, 0, 1.0);
  const double first = cycle.now;
  for (int k = 0; k < 10; ++k) {
    BOOST_REQUIRE(client.next_cycle(cycle, cycle.cycle, 1.0));
  }
  BOOST_TEST(std::abs(cycle.now - first - 0.2) < 0.05);  // ten of them at 50 Hz
  BOOST_TEST(served.server->clients().front().left_out == 0u);
}

BOOST_AUTO_TEST_CASE(only_the_client_in_command_moves_the_arm) {
  Served served;
  Client first(served.server->address(), served.with_token("first")),
      second(served.server->address(), served.with_token("second")), visitor(served.server->address(), {.name = "visitor"});
  BOOST_CHECK_THROW(Client(served.server->address(), {.token = "wrong"}), std::invalid_argument);
  CHECK_SAYS(first.set_goal(goal), std::invalid_argument, "nobody is in command");
  CHECK_SAYS(visitor.take_command(), std::invalid_argument, "this needs the token");
  CHECK_SAYS(visitor.set_obstacles(Obstacles::none()), std::invalid_argument, "this needs the token");
  CHECK_SAYS(visitor.pause(), std::invalid_argument, "this needs the token");
  BOOST_TEST(visitor.cycle().cycle > 0u);
  BOOST_TEST(!visitor.explain().empty());

  first.take_command();
  CHECK_SAYS(second.take_command(), std::invalid_argument, "first is in command; it must release it, or take it by force");
  CHECK_SAYS(second.set_goal(goal), std::invalid_argument, "first is in command: only");
  second.set_obstacles(Obstacles::none(), {.source = "table"});  // whoever sees something may say so
  second.take_command(true);
  first.ping();
  BOOST_TEST(!first.is_in_command());
  bool told = false;
  for (const Notice& notice : first.notices()) {
    told = told || notice.words == "second has taken it by force";
  }
  BOOST_TEST(told);
  CHECK_SAYS(first.set_goal(goal), std::invalid_argument, "second is in command: only");
  second.release_command();
  first.take_command();
  first.set_goal(goal);
  BOOST_TEST(first.wait_arrived(10.0));
  BOOST_TEST(served.server->clients().size() == 3u);
}

BOOST_AUTO_TEST_CASE(the_goal_of_a_client_that_is_lost_is_cleared_unless_it_said_otherwise) {
  Served served;
  Client watcher(served.server->address(), served.with_token("watcher"));
  {
    Client client(served.server->address(), served.with_token("lost"));
    client.take_command();
    client.set_goal(goal);
    BOOST_TEST(client.wait([](const CycleMessage& cycle) { return cycle.command.velocity.cwiseAbs().maxCoeff() > 0.05; }, 5.0));
  }
  BOOST_TEST(comes_to_rest(watcher));
  BOOST_TEST((watcher.cycle().state.q - goal).cwiseAbs().maxCoeff() > 0.01);  // not at the goal
  {
    Client client(served.server->address(), served.with_token("leaves"));
    client.take_command(false, true);
    client.set_goal(goal);
  }
  BOOST_TEST(watcher.wait_arrived(10.0));
}

BOOST_AUTO_TEST_CASE(pause_and_stop_are_for_everybody_with_the_token) {
  Served served;
  Client driver(served.server->address(), served.with_token("driver")),
      guard(served.server->address(), served.with_token("guard"));
  driver.take_command();
  driver.set_goal(goal);
  guard.pause();
  BOOST_TEST(guard.wait([](const CycleMessage& cycle) { return cycle.command.activity == Activity::waiting; }, 5.0));
  CHECK_SAYS(guard.resume(), std::invalid_argument, "driver is in command: only");
  driver.resume();
  BOOST_TEST(driver.wait_arrived(10.0));
  BOOST_TEST(served.server->take_resume());
  guard.stop_run("a test");
  BOOST_TEST(served.server->take_stop().value() == "guard asked for it: a test");
  BOOST_TEST(!served.server->take_stop().has_value());
  served.server->run_ended("stopped");
  CHECK_SAYS(driver.wait([](const CycleMessage&) { return false; }, 5.0), RunInterrupted, "the run has ended: stopped");
  Client late(served.server->address(), {});
  CHECK_SAYS(late.wait([](const CycleMessage&) { return false; }, 5.0), RunInterrupted, "the run has ended: stopped");
}

BOOST_AUTO_TEST_CASE(refusals_are_the_controllers_words) {
  Served served;
  Client client(served.server->address(), served.with_token("client"));
  client.take_command();
  CHECK_SAYS(client.set_goal(Eigen::VectorXd::Constant(nv, 100.0)), std::invalid_argument, "allowed: ");
  CHECK_SAYS(client.set_velocity(Eigen::VectorXd::Constant(nv, std::numeric_limits<double>::quiet_NaN())),
             std::invalid_argument, "nan");
  CHECK_SAYS(client.set_twist("hand", Vector6d::Zero()), std::invalid_argument, "tip");
  CHECK_SAYS(client.remove_obstacles("camera"), std::invalid_argument, "scene");
  CHECK_SAYS(client.expect_obstacles(""), std::invalid_argument, "source");
  const std::vector<std::uint16_t> pixels(4, 1000);
  CHECK_SAYS(client.update("front", 2, 2, {std::span(pixels)}, 0.0), std::invalid_argument, "this server has no cameras");
  BOOST_TEST(!client.set_velocity(Eigen::VectorXd::Constant(nv, 60.0)).empty());  // followed, but hard to believe
}

BOOST_AUTO_TEST_CASE(a_refusal_that_is_too_long_is_cut_and_harms_nobody) {
  Served served;
  Client other(served.server->address(), served.with_token("other"));
  Client client(served.server->address(), served.with_token("client"));
  other.take_command();
  other.set_goal(goal);
  constexpr int count = 40;
  std::vector<std::string> names;
  for (int k = 0; k < count; ++k) {
    names.push_back(std::to_string(k) + std::string(3000, 'x'));
  }
  const Eigen::Matrix3Xd points = Eigen::Vector3d(5.0, 0.0, 0.0).replicate(1, count);
  client.set_obstacles(Obstacles(points, Eigen::VectorXd::Constant(count, 0.1), Eigen::Matrix3Xd::Zero(3, count))
                           .named(names, std::vector<Eigen::Index>(count, 1)));
  const auto is_cut = [](const std::invalid_argument& error) {
    return std::string(error.what()).size() == longest_text && says(error, "has no 'nobody', it has '0xxx");
  };
  BOOST_CHECK_EXCEPTION(client.remove_obstacle("nobody"), std::invalid_argument, is_cut);
  BOOST_TEST(client.ping() < 1.0);
  BOOST_TEST(other.ping() < 1.0);
  BOOST_TEST(other.is_in_command());
  BOOST_TEST(other.wait_arrived(10.0));
  served.server->run_ended(std::string(100'000, 'x'));
  CHECK_SAYS(other.wait([](const CycleMessage&) { return false; }, 5.0), RunInterrupted, "the run has ended: xxx");
}

BOOST_AUTO_TEST_CASE(a_stop_between_two_runs_is_taken_back_by_resume) {
  Served served;
  Client client(served.server->address(), served.with_token("client"));
  client.take_command();
  client.stop_run("once");
  client.resume();  // of the run that goes on: it ends all the same
  BOOST_TEST(served.server->take_stop().has_value());
  served.server->run_ended("stopped");
  CHECK_SAYS(client.wait([](const CycleMessage&) { return false; }, 5.0), RunInterrupted, "the run has ended: stopped");
  client.stop_run("twice");
  client.resume();
  BOOST_TEST(served.server->take_resume());
  BOOST_TEST(!served.server->take_stop().has_value());
  client.stop_run("again");  // which comes after the resume
  BOOST_TEST(served.server->take_stop().value() == "client asked for it: again");
}

BOOST_AUTO_TEST_CASE(what_is_no_rate_is_refused) {
  Served served;
  for (const double rate : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    CHECK_SAYS((Client{served.server->address(), {.rate = rate}}), std::invalid_argument, "allowed: from 0, inf");
  }
}

BOOST_AUTO_TEST_CASE(who_waits_is_told_of_a_loss_of_command_however_long_an_interruption_takes) {
  Served served;
  Client first(served.server->address(), served.with_token("first")),
      second(served.server->address(), served.with_token("second"));
  first.take_command();
  const auto never = [](const CycleMessage&) { return false; };
  bool taken = false;
  const auto meanwhile = [&] {
    if (!std::exchange(taken, true)) {
      second.take_command(true);
      first.ping();
    }
    return false;
  };
  CHECK_SAYS(first.wait(never, 5.0, meanwhile), RunInterrupted, "in command no more");
  BOOST_TEST(!first.wait(never, 5.0, [] { return true; }));
}

BOOST_AUTO_TEST_CASE(obstacles_arrive_as_they_were_sent) {
  Served served;
  Client client(served.server->address(), served.with_token("client"));
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation().x() = 5.0;
  client.add_obstacle(test::ball({3.0, 0.5, 0.2}, 0.05).named({"ball"}, {1}));
  client.move_obstacle("ball", pose);
  client.set_obstacles(test::ball({4.0, 0.5, 0.2}, 0.1, {0.0, 0.1, 0.0}), {.source = "camera", .valid_for = 2.0});
  bool seen = false;
  for (const SourceContent& source : served.controller.said()) {
    if (source.name == "scene") {
      BOOST_TEST(source.obstacles->points().col(0) == Eigen::Vector3d(8.0, 0.5, 0.2));
      BOOST_TEST(source.obstacles->name_of(0) == "ball");
    } else if (source.name == "camera") {
      seen = true;
      BOOST_TEST(source.obstacles->velocities().col(0) == Eigen::Vector3d(0.0, 0.1, 0.0));
    }
  }
  BOOST_TEST(seen);
}

BOOST_AUTO_TEST_CASE(a_client_that_does_not_read_holds_nobody_up) {
  Served served;
  Connection slow(served.server->address());
  slow.send(Hello{"slow", ""});
  slow.send(Subscribe{std::numeric_limits<double>::infinity()});
  Client client(served.server->address(), served.with_token("client"));
  const auto left_out = [&] {
    for (const ClientInfo& info : served.server->clients()) {
      if (info.name == "slow") {
        return info.left_out;
      }
    }
    return std::uint64_t{0};
  };
  BOOST_TEST(client.wait([&](const CycleMessage&) { return left_out() > 0; }, 20.0));
  BOOST_TEST(client.ping() < 1.0);
}

BOOST_AUTO_TEST_CASE(the_loops_thread_allocates_nothing_for_the_server) {
  test::LinkAddress address;
  Controller controller(test::covered_arm(test::arm_limits(nv)));
  Server server(controller, {.address = address.text(), .token = "secret"});
  Client client(server.address(), {.rate = std::numeric_limits<double>::infinity()});
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  const RobotState state(nv);
  const Command command(nv);
  BOOST_TEST(test::allocations_of([&] {
               for (int k = 0; k < 1000; ++k) {  // more than the ring holds
                 server.observe(state, command, 1e9 + k);
               }
             }) == 0u);
  CycleMessage cycle;
  BOOST_TEST(client.next_cycle(cycle, 0, 1.0));
}

BOOST_AUTO_TEST_CASE(a_silent_connection_and_a_flood_do_no_harm) {
  Served served;
  Connection silent(served.server->address());
  Connection large(served.server->address());
  Header header;
  header.type = MessageType::set_obstacles;
  header.payload = 30 << 20;
  binary::Bytes bytes;
  binary::Encoder<binary::Bytes> out(bytes);
  describe(out, header);
  large.send(bytes.bytes, 1.0);
  RawMessage raw;
  BOOST_TEST((large.receive(raw, 1.0) == Received::message));
  Refused refused;
  decode(raw.payload, refused);
  BOOST_TEST(refused.words ==
             "a message of 31457280 bytes is too long for a client without the token; at most 65536 are allowed");
  BOOST_TEST((large.receive(raw, 1.0) == Received::closed));
  Client client(served.server->address(), served.with_token("client"));
  BOOST_TEST(client.ping() < 1.0);
}

BOOST_AUTO_TEST_CASE(the_token_is_for_the_user_alone_and_goes_with_the_server) {
  test::LinkAddress address;
  Controller controller(test::covered_arm(test::arm_limits(nv)));
  std::filesystem::path file;
  {
    Server server(controller, {.address = address.text()});
    file = server.token_file();
    BOOST_TEST((file == std::filesystem::path(address.path()).replace_extension(".token")));
    BOOST_TEST((std::filesystem::status(file).permissions() ==
                (std::filesystem::perms::owner_read | std::filesystem::perms::owner_write)));
    BOOST_CHECK_THROW(Server(controller, {.address = address.text()}), std::system_error);
  }
  BOOST_TEST(!std::filesystem::exists(file));
  BOOST_TEST((default_token_file(Address("tcp:127.0.0.2:5")) == socket_folder() / "tcp-127.0.0.2-5.token"));
}

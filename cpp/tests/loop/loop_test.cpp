// A run on a robot: the checks before it, its end for each reason, and what it reports.
#include "sidestep/loop/loop.hpp"

#include <atomic>
#include <boost/test/unit_test.hpp>
#include <chrono>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

#include "sidestep/loop/ideal_driver.hpp"
#include "sidestep/loop/model_loop.hpp"
#include "support/covered_arm.hpp"
#include "support/numbers.hpp"
#include "support/repeatable_settings.hpp"

using namespace sidestep;
using test::covered_arm;
using test::nv;

namespace {

using Output = ControllerSettings::Output;

/// An ideal robot on its own clock that goes wrong as a test wants, at a cycle.
class FaultyDriver final : public Driver {
 public:
  explicit FaultyDriver(const Arm& arm, bool real_time = false)
      : robot_(arm, Eigen::VectorXd::Zero(nv), 0.001, real_time), shown_(robot_.description()) {}

  const RobotDescription& description() const noexcept override { return shown_; }
  void start(Output output) override {
    std::this_thread::sleep_for(starts_within_);
    robot_.start(output);
  }
  DriverResult read(RobotState& state, double timeout) noexcept override {
    ++reads_;
    const DriverResult now = fault_ ? fault_(reads_) : DriverResult::ok;
    if (now != DriverResult::ok) {
      return now;
    }
    const DriverResult read = robot_.read(state, timeout);
    state.time += clock_ahead_;
    state.mass_matrix = masses_;
    if (lost_cycles_ > 0) {
      state.lost_cycles = lost_cycles_;
      state.told_position = state.q;
      state.told_velocity = state.v;
      state.told_acceleration.setZero();
    }
    return read;
  }
  DriverResult write(const Command& command) noexcept override {
    ++writes_;
    largest_ = std::max(largest_, command.velocity.cwiseAbs().maxCoeff());
    last_ = command.velocity;
    return robot_.write(command);
  }
  void stop() noexcept override { ++stops_; }
  std::string trouble() const override { return "the cable is out"; }

  IdealDriver robot_;
  RobotDescription shown_;
  std::function<DriverResult(int)> fault_;
  int reads_ = 0, writes_ = 0, stops_ = 0, lost_cycles_ = 0;
  double largest_ = 0.0, clock_ahead_ = 0.0;
  std::chrono::milliseconds starts_within_{0};
  Eigen::MatrixXd masses_;
  Eigen::VectorXd last_ = Eigen::VectorXd::Zero(nv);
};

/// A controller with a goal in empty space, and a driver.
struct Setup {
  explicit Setup(Output output = Output::position, bool real_time = false)
      : arm(covered_arm(test::arm_limits(nv))), controller(arm, test::repeatable_settings(output)), driver(arm, real_time) {
    controller.set_obstacles(Obstacles::none());
    controller.set_goal(Eigen::VectorXd::Constant(nv, 0.8));
  }

  Arm arm;
  Controller controller;
  FaultyDriver driver;
};

bool says(const std::exception& error, const std::string& words) {
  BOOST_TEST_MESSAGE(error.what());
  return std::string(error.what()).find(words) != std::string::npos;
}

#define CHECK_SAYS(call, type, words) BOOST_CHECK_EXCEPTION(call, type, [](const type& error) { return says(error, words); })

}  // namespace

BOOST_AUTO_TEST_CASE(a_run_ends_at_the_goal_and_keeps_it) {
  for (const Output output : {Output::torque, Output::acceleration, Output::velocity, Output::position}) {
    Setup s(output);
    Loop loop(s.controller, s.driver, {.until_arrived = true});
    loop.start();
    const RunReport report = loop.finish();
    BOOST_TEST(to_string(report.end) == "arrived");
    BOOST_TEST(report.at_rest);
    BOOST_TEST(report.is_success());
    BOOST_TEST(report.cycles > 500u);
    BOOST_TEST(report.late.size() == report.taken.size());
    BOOST_TEST((loop.state().q.array() - 0.8).abs().maxCoeff() < 0.01);
    BOOST_TEST(s.driver.stops_ == 1);
    BOOST_TEST(!s.controller.is_paused());
    // and back, with the same controller: its goal was kept, another is set, and the robot is where it was
    s.controller.set_goal(Eigen::VectorXd::Zero(nv));
    Loop back(s.controller, s.driver, {.until_arrived = true});
    back.start();
    BOOST_TEST(to_string(back.finish().end) == "arrived");
    BOOST_TEST(back.state().q.cwiseAbs().maxCoeff() < 0.01);
  }
}

BOOST_AUTO_TEST_CASE(whoever_ends_a_run_the_arm_comes_to_rest_within_its_limits) {
  for (const RunEnd end : {RunEnd::stopped, RunEnd::interrupted, RunEnd::failed}) {
    Setup s;
    Loop loop(s.controller, s.driver);
    s.driver.fault_ = [&](int read) {
      if (read == 400) {
        loop.stop(end, "as the test wants");
      }
      return DriverResult::ok;
    };
    loop.start();
    const RunReport report = loop.finish();
    BOOST_TEST(to_string(report.end) == to_string(end));
    BOOST_TEST(report.why == "as the test wants");
    BOOST_TEST(report.at_rest);
    BOOST_TEST(s.driver.largest_ > 0.1);
    BOOST_TEST(s.driver.last_.cwiseAbs().maxCoeff() < 0.005);
    BOOST_TEST(s.driver.reads_ > 420);
    BOOST_TEST(report.cycles > 420u);
  }
}

BOOST_AUTO_TEST_CASE(nobody_resumes_an_arm_that_is_being_stopped) {
  Setup s;
  Loop loop(s.controller, s.driver);
  double sent = 0.0;
  s.driver.fault_ = [&](int read) {
    if (read == 400) {
      loop.stop();
      sent = s.driver.last_.cwiseAbs().maxCoeff();
    }
    if (read > 402) {
      s.controller.resume();
      BOOST_TEST_REQUIRE(s.driver.last_.cwiseAbs().maxCoeff() < 1.2 * sent);
    }
    return DriverResult::ok;
  };
  loop.start();
  const RunReport report = loop.finish();
  BOOST_TEST(to_string(report.end) == "stopped");
  BOOST_TEST(report.at_rest);
  BOOST_TEST(report.stop_time < 1.0);
  BOOST_TEST(!s.controller.is_paused());
}

BOOST_AUTO_TEST_CASE(a_pause_of_the_user_outlasts_the_run) {
  for (const DriverResult result : {DriverResult::ok, DriverResult::lost}) {
    Setup s;
    Loop loop(s.controller, s.driver, {.duration = 0.5});
    s.driver.fault_ = [&](int read) {
      if (read == 300) {
        s.controller.pause();
      }
      return read == 400 ? result : DriverResult::ok;
    };
    loop.start();
    loop.finish();
    BOOST_TEST(s.controller.is_paused());
  }
}

BOOST_AUTO_TEST_CASE(time_and_silence_end_a_run) {
  Setup s;
  Loop timed(s.controller, s.driver, {.duration = 0.3});
  timed.start();
  BOOST_TEST(to_string(timed.finish().end) == "duration");
  BOOST_TEST(timed.finish().cycles >= 300u);

  s.controller.set_obstacles(test::ball({5.0, 0.0, 0.0}, 0.1),
                             {.source = "camera", .time = s.controller.time(), .valid_for = 0.2});
  Loop silent(s.controller, s.driver, {.silent_timeout = 0.5});
  silent.start();
  const RunReport report = silent.finish();
  BOOST_TEST(to_string(report.end) == "source_silent");
  BOOST_TEST(to_string(report.worst) == "stale");
  BOOST_TEST(report.cycles > 650u);
  BOOST_TEST(report.cycles < 1500u);
}

BOOST_AUTO_TEST_CASE(a_lost_state_is_braked_without_one_and_a_lost_robot_is_let_go) {
  Setup blind(Output::position, true);
  blind.driver.fault_ = [](int read) {
    std::this_thread::sleep_for(std::chrono::microseconds(read >= 400 ? 500 : 0));
    return read >= 400 ? DriverResult::waiting : DriverResult::ok;
  };
  Loop loop(blind.controller, blind.driver, {.state_timeout = 0.03, .longest_gap = 10.0});
  loop.start();
  const RunReport lost = loop.finish();
  BOOST_TEST(to_string(lost.end) == "state_lost");
  BOOST_TEST(lost.why == "no new state came from the robot");
  BOOST_TEST(blind.driver.writes_ > 410);  // braked
  BOOST_TEST(blind.driver.last_.cwiseAbs().maxCoeff() < 0.01);
  BOOST_TEST(blind.driver.stops_ == 1);

  // A model on its own clock too is braked in the machine's time, and a robot that says what it was told is not led there again.
  Setup model(Output::position, false);
  model.driver.lost_cycles_ = 1;
  model.driver.fault_ = [](int read) { return read >= 400 ? DriverResult::waiting : DriverResult::ok; };
  Loop modelled(model.controller, model.driver, {.state_timeout = 0.03});
  modelled.start();
  BOOST_TEST(to_string(modelled.finish().end) == "state_lost");
  BOOST_TEST(model.driver.writes_ > 500);  // 0.5 s of braking at 1 kHz
  BOOST_TEST(model.driver.writes_ < 1500);
  BOOST_TEST(model.driver.last_.cwiseAbs().maxCoeff() < 0.01);

  for (const auto& [result, end] :
       {std::pair(DriverResult::lost, RunEnd::state_lost), std::pair(DriverResult::stopped, RunEnd::robot_stopped)}) {
    Setup s;
    s.driver.fault_ = [result = result](int read) { return read == 300 ? result : DriverResult::ok; };
    Loop cut(s.controller, s.driver);
    cut.start();
    const RunReport report = cut.finish();
    BOOST_TEST(to_string(report.end) == to_string(end));
    BOOST_TEST(report.why.ends_with(": the cable is out"));
    BOOST_TEST(s.driver.writes_ == 298);  // one read was before the run
    BOOST_TEST(!report.is_success());
  }
}

BOOST_AUTO_TEST_CASE(a_clock_that_jumps_ends_the_run_and_the_next_goes_on) {
  for (const double jump : {-5.0, -0.11, 0.11, 5.0}) {
    Setup s;
    s.driver.fault_ = [&](int read) {
      s.driver.clock_ahead_ = read < 400 ? 0.0 : jump;
      return DriverResult::ok;
    };
    Loop loop(s.controller, s.driver);
    loop.start();
    const RunReport report = loop.finish();
    BOOST_TEST(to_string(report.end) == "state_lost");
    BOOST_TEST(report.why == std::string("the clock of the robot's states has jumped ") + (jump < 0.0 ? "back" : "ahead"));
    BOOST_TEST(report.at_rest);
    BOOST_TEST(s.driver.largest_ > 0.1);
    BOOST_TEST(s.driver.last_.cwiseAbs().maxCoeff() < 0.005);
    BOOST_TEST(s.controller.time() == 0.001 * static_cast<double>(s.driver.reads_), boost::test_tools::tolerance(0.01));
    Loop again(s.controller, s.driver, {.until_arrived = true});
    again.start();
    BOOST_TEST(to_string(again.finish().end) == "arrived");
  }
}

BOOST_AUTO_TEST_CASE(a_clock_that_is_late_within_the_longest_gap_is_borne) {
  for (const double jump : {-0.05, 0.05}) {
    Setup s;
    s.driver.fault_ = [&](int read) {
      s.driver.clock_ahead_ = read < 400 ? 0.0 : jump;
      return DriverResult::ok;
    };
    Loop loop(s.controller, s.driver, {.until_arrived = true});
    loop.start();
    BOOST_TEST(to_string(loop.finish().end) == "arrived");
  }
}

BOOST_AUTO_TEST_CASE(a_robot_that_takes_long_to_start_has_no_clock_that_jumps) {
  Setup s(Output::position, true);
  s.driver.starts_within_ = std::chrono::milliseconds(800);
  Loop loop(s.controller, s.driver, {.duration = 0.1, .longest_gap = 0.7});
  loop.start();
  BOOST_TEST(to_string(loop.finish().end) == "duration");
}

BOOST_AUTO_TEST_CASE(a_loop_that_hangs_is_noticed_and_stops_the_arm) {
  Setup s(Output::position, true);
  s.driver.fault_ = [](int read) {
    if (read == 200) {
      std::this_thread::sleep_for(std::chrono::milliseconds(400));
    }
    return DriverResult::ok;
  };
  Loop loop(s.controller, s.driver);
  loop.start();
  const RunReport report = loop.finish();
  BOOST_TEST(to_string(report.end) == "late");
  BOOST_TEST(report.at_rest);
}

BOOST_AUTO_TEST_CASE(what_is_not_approved_is_not_written) {
  class Refuses final : public CycleObserver {
   public:
    void observe(const RobotState&, const Command&, double) noexcept override { ++seen; }
    bool approves() noexcept override { return seen < 200; }
    std::string why() const override { return "as the test wants"; }
    int seen = 0;
  } refuses;
  std::optional<Loop> stopped;
  Setup s;
  Loop loop(s.controller, s.driver, {}, {&refuses});
  loop.start();
  const RunReport report = loop.finish();
  BOOST_TEST(to_string(report.end) == "denied");
  BOOST_TEST(s.driver.writes_ == 199);
  BOOST_TEST(report.unwritten == 2u);

  // Refused while the arm is brought to rest: no success, whoever asked for the end.
  refuses.seen = 0;
  Setup again;
  again.driver.fault_ = [&](int read) {
    if (read == 190) {
      stopped->stop();
    }
    return DriverResult::ok;
  };
  stopped.emplace(again.controller, again.driver, LoopSettings{}, std::vector<CycleObserver*>{&refuses});
  stopped->start();
  const RunReport late = stopped->finish();
  BOOST_TEST(to_string(late.end) == "denied");
  BOOST_TEST(late.why == "a command was not approved: as the test wants", late.why);
  BOOST_TEST(!late.at_rest);
  BOOST_TEST(!late.is_success());
}

BOOST_AUTO_TEST_CASE(a_controller_that_does_not_fit_the_robot_is_refused) {
  Setup s;
  s.driver.shown_.outputs = {Output::torque, Output::velocity};
  CHECK_SAYS(Loop(s.controller, s.driver), std::invalid_argument,
             "takes torque, velocity, the controller's output is position");
  s.driver.shown_ = s.driver.robot_.description();
  s.driver.shown_.period = 0.002;
  CHECK_SAYS(Loop(s.controller, s.driver), std::invalid_argument, "the controller's period is 0.001 s, that of robot");
  s.driver.shown_ = s.driver.robot_.description();
  std::swap(s.driver.shown_.joints[0], s.driver.shown_.joints[1]);
  CHECK_SAYS(Loop(s.controller, s.driver), std::invalid_argument, "they must be the same, in the same order");
  s.driver.shown_ = s.driver.robot_.description();
  s.driver.shown_.limits.velocity[2] *= 0.5;
  CHECK_SAYS(Loop(s.controller, s.driver), std::invalid_argument, "the velocity limit of the arm is");
  s.driver.shown_ = s.driver.robot_.description();
  s.driver.shown_.limits.lower[1] += 0.1;
  CHECK_SAYS(Loop(s.controller, s.driver), std::invalid_argument, "lower position limit");
  s.driver.shown_ = s.driver.robot_.description();
  Loop first(s.controller, s.driver);
  CHECK_SAYS(Loop(s.controller, s.driver), std::runtime_error, "the controller is in use");
  CHECK_SAYS(Loop(s.controller, s.driver, {.longest_gap = 0.0}), std::invalid_argument, "longest_gap is 0");
}

BOOST_AUTO_TEST_CASE(nothing_is_written_before_state_and_world_are_known) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  Controller untold(arm, test::repeatable_settings(Output::position));
  FaultyDriver driver(arm);
  {
    Loop loop(untold, driver, {.start_timeout = 0.05});
    CHECK_SAYS(loop.start(), std::runtime_error, "no obstacles are known");
    CHECK_SAYS(loop.start(), std::runtime_error, "a run starts once");
  }
  untold.set_obstacles(Obstacles::none());
  untold.expect_obstacles("side");
  {
    Loop loop(untold, driver, {.start_timeout = 0.05});
    CHECK_SAYS(loop.start(), std::runtime_error, "source 'side' was expected and has not come");
  }
  Setup s;
  s.driver.fault_ = [](int) { return DriverResult::waiting; };
  {
    Loop loop(s.controller, s.driver, {.start_timeout = 0.05});
    CHECK_SAYS(loop.start(), std::runtime_error, "sent no state");
  }
  s.driver.fault_ = nullptr;
  s.controller.set_obstacles(test::ball({0.0, 0.0, 0.45}, 0.1));
  {
    Loop loop(s.controller, s.driver);
    CHECK_SAYS(loop.start(), std::runtime_error, "before the first motion");
  }
  s.controller.set_obstacles(Obstacles::none());
  s.driver.masses_ = Eigen::MatrixXd::Identity(nv, nv - 1);
  {
    Loop loop(s.controller, s.driver);
    CHECK_SAYS(loop.start(), std::runtime_error, "the robot's mass matrix is");
  }
  IdealDriver outside(arm, arm.robot().limits().upper + Eigen::VectorXd::Constant(nv, 0.1), 0.001, false);
  {
    Loop loop(s.controller, outside);
    CHECK_SAYS(loop.start(), std::runtime_error, "outside its limits");
  }
  BOOST_TEST(driver.writes_ + s.driver.writes_ == 0);
}

BOOST_AUTO_TEST_CASE(a_model_that_the_caller_moves_gets_the_commands_of_a_step_and_is_brought_to_rest) {
  for (const Output output : {Output::torque, Output::position}) {
    Setup stepped(output), turned(output);
    ModelLoop loop(turned.controller);
    RobotState state(nv);
    const auto move = [&](const Command& command) {
      state.v = output == Output::position ? command.velocity : Eigen::VectorXd(state.v + 0.001 * command.acceleration);
      state.q = output == Output::position ? command.position : Eigen::VectorXd(state.q + 0.001 * state.v);
    };
    for (int k = 0; k < 300; ++k) {
      state.time = 0.001 * k;
      if (output == Output::torque) {  // of a robot that says its own
        state.mass_matrix = 1.5 * Eigen::MatrixXd::Identity(nv, nv);
        state.bias = Eigen::VectorXd::Constant(nv, 0.1);
      }
      const Command& expected = state.has_dynamics()
                                    ? stepped.controller.step(state.q, state.v, state.mass_matrix, state.bias, state.time)
                                    : stepped.controller.step(state.q, state.v, state.time);
      const Command& command = loop.cycle(state);
      BOOST_TEST_REQUIRE(command.torque == expected.torque);
      BOOST_TEST_REQUIRE(command.position == expected.position);
      BOOST_TEST_REQUIRE(command.acceleration == expected.acceleration);
      move(command);
    }
    BOOST_TEST(state.v.cwiseAbs().maxCoeff() > 0.05);
    loop.stop(RunEnd::stopped, "as the test wants");
    for (int k = 300; !loop.is_over(); ++k) {
      BOOST_REQUIRE(k < 3000);
      state.time = 0.001 * k;
      move(loop.cycle(state));
    }
    const RunReport report = loop.report();
    BOOST_TEST(to_string(report.end) == "stopped");
    BOOST_TEST(report.why == "as the test wants");
    BOOST_TEST(report.at_rest);
    BOOST_TEST(state.v.cwiseAbs().maxCoeff() < 0.01);
    BOOST_TEST(!turned.controller.is_paused());
    CHECK_SAYS(loop.cycle(state), std::runtime_error, "the run is over: as the test wants");
    // the controller is free between two cycles, and taken while it is in a loop of its own
    ModelLoop next(turned.controller);
    next.cycle(state);
    const Controller::ClaimedController use(turned.controller);
    CHECK_SAYS(next.cycle(state), std::runtime_error, "in use");
    state.q.resize(nv - 1);
    CHECK_SAYS(next.cycle(state), std::invalid_argument, "positions and");
  }
}

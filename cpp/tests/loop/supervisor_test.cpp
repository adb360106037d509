// What a supervisor denies, and that a loop writes nothing without its approval.
#include "sidestep/loop/supervisor.hpp"

#include <atomic>
#include <chrono>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <system_error>
#include <thread>

#include "sidestep/loop/ideal_driver.hpp"
#include "sidestep/loop/loop.hpp"
#include "support/covered_arm.hpp"
#include "support/numbers.hpp"
#include "support/repeatable_settings.hpp"

using namespace sidestep;
using test::covered_arm;
using test::nv;

namespace {

using Output = ControllerSettings::Output;

// What a busy machine may take [s].
LoopSettings patient() { return {.state_timeout = 10.0, .longest_gap = 10.0}; }

JointLimits supervised_limits() {
  JointLimits limits = test::arm_limits(nv);
  limits.effort_rate = Eigen::VectorXd::Constant(nv, 1000.0);
  return limits;
}

CycleReport quiet_report(std::uint64_t cycle) {
  CycleReport report;
  report.cycle = cycle;
  report.now = 100.0 + 1e-3 * static_cast<double>(cycle);
  report.state_age = 0.001;
  report.writes_torque = report.writes_position = true;
  return report;
}

/// A supervisor in a thread of this process.
class Supervising {
 public:
  explicit Supervising(const std::string& path) : thread_([this, path] { supervise(path, [this] { return ends.load(); }); }) {}
  ~Supervising() {
    ends = true;
    thread_.join();
  }
  std::atomic<bool> ends{false};

 private:
  std::thread thread_;
};

}  // namespace

BOOST_AUTO_TEST_CASE(each_limit_is_denied_once_it_is_exceeded_and_stays_denied) {
  const JointLimits limits = supervised_limits();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  struct Case {
    Denial denial;
    int joint;
    std::function<void(CycleReport&)> make;
  };
  const Case cases[] = {
      {Denial::not_finite, 2, [&](CycleReport& r) { r.q[2] = nan; }},
      {Denial::not_finite, 6, [&](CycleReport& r) { r.torque[6] = nan; }},
      {Denial::position, 1, [&](CycleReport& r) { r.q[1] = r.position[1] = limits.upper[1] + 0.03; }},
      {Denial::position, 1, [&](CycleReport& r) { r.q[1] = r.position[1] = limits.lower[1] - 0.03; }},
      {Denial::velocity, 0, [&](CycleReport& r) { r.v[0] = -1.2 * limits.velocity[0]; }},
      {Denial::velocity, 3, [&](CycleReport& r) { r.velocity[3] = 1.2 * limits.velocity[3]; }},
      {Denial::tracking, 4, [&](CycleReport& r) { r.position[4] = 0.4; }},
      {Denial::torque, 5, [&](CycleReport& r) { r.torque[5] = 1.2 * limits.effort[5]; }},
      {Denial::torque_rate, 5, [&](CycleReport& r) { r.torque[5] = 1.5; }},  // [Nm] in 1 ms
      {Denial::old_state, -1, [&](CycleReport& r) { r.state_age = 0.06; }},
  };
  for (const Case& one : cases) {
    SupervisorRules rules(limits, 1e-3);
    BOOST_TEST(rules.judge(quiet_report(1)).approves());
    CycleReport report = quiet_report(2);
    one.make(report);
    const Verdict verdict = rules.judge(report);
    BOOST_TEST((verdict.denial == one.denial), verdict.words({}));
    BOOST_TEST(verdict.joint == one.joint);
    BOOST_TEST(verdict.cycle == 2u);
    BOOST_TEST(!rules.judge(quiet_report(3)).approves());
    rules.reset();
    BOOST_TEST(rules.judge(quiet_report(4)).approves());
  }
}

BOOST_AUTO_TEST_CASE(noise_within_the_tolerance_is_approved) {
  const JointLimits limits = supervised_limits();
  SupervisorRules rules(limits, 1e-3);
  for (std::uint64_t k = 1; k < 100; ++k) {
    CycleReport report = quiet_report(k);
    report.v[0] = 1.05 * limits.velocity[0];
    report.q[1] = report.position[1] = limits.upper[1] + 0.01;
    report.torque[2] = k % 2 == 0 ? 0.9 : 0.0;  // 900 Nm/s of 1000
    BOOST_REQUIRE(rules.judge(report).approves());
  }
}

BOOST_AUTO_TEST_CASE(silence_and_blind_motion_are_denied) {
  SupervisorRules silent(supervised_limits(), 1e-3);
  BOOST_TEST(silent.wait(50.0).approves());  // nothing was reported yet
  BOOST_TEST(silent.judge(quiet_report(1)).approves());
  BOOST_TEST(silent.wait(100.015).approves());
  BOOST_TEST((silent.wait(100.03).denial == Denial::silent_loop));
  BOOST_TEST(!silent.judge(quiet_report(2)).approves());

  SupervisorRules between(supervised_limits(), 1e-3);
  BOOST_TEST(between.judge(quiet_report(1)).approves());
  CycleReport over;
  over.now = 100.002;
  over.is_over = true;
  BOOST_TEST(between.judge(over).approves());
  BOOST_TEST(between.wait(200.0).approves());  // nobody runs
  CycleReport next = quiet_report(2);
  next.torque[5] = 1.5;  // of another run: no rate leads there from the last torque
  BOOST_TEST(between.judge(next).approves());
  next.q[2] = std::numeric_limits<double>::quiet_NaN();
  BOOST_TEST(!between.judge(next).approves());
  BOOST_TEST(!between.judge(over).approves());  // a denial outlasts its run

  SupervisorRules blind(supervised_limits(), 1e-3);
  for (std::uint64_t k = 1; k <= 1500; ++k) {
    CycleReport report = quiet_report(k);
    report.stale = true;
    report.v[3] = 0.2;
    BOOST_REQUIRE(blind.judge(report).approves() == (k <= 1001));
  }

  SupervisorRules braked(supervised_limits(), 1e-3, {.blind_time = 0.5});
  for (std::uint64_t k = 1; k <= 700; ++k) {
    CycleReport report = quiet_report(k);
    report.is_blind = k > 100;
    report.position[3] = k > 100 ? 1e-3 * static_cast<double>(k - 100) : 0.0;  // away from where the arm was last seen
    const Verdict& verdict = braked.judge(report);
    BOOST_REQUIRE_MESSAGE(verdict.approves() == (k <= 601), verdict.words({}));
  }
  BOOST_TEST((braked.judge(quiet_report(701)).denial == Denial::old_state));
  braked.reset();
  BOOST_TEST(braked.judge(quiet_report(702)).approves());
  CycleReport jump = quiet_report(703);
  jump.is_blind = true;
  jump.position[3] = 0.4;
  BOOST_TEST((braked.judge(jump).denial == Denial::tracking));

  const JointLimits many = JointLimits::unlimited(65);
  BOOST_CHECK_THROW(SupervisorRules(many, 1e-3), std::invalid_argument);
}

BOOST_AUTO_TEST_CASE(a_loop_writes_only_what_is_approved) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  Controller controller(arm, test::repeatable_settings(Output::position));
  controller.set_obstacles(Obstacles::none());
  controller.set_goal(Eigen::VectorXd::Constant(nv, 0.8));
  IdealDriver robot(arm, Eigen::VectorXd::Zero(nv));
  SupervisorLink link(arm.robot(), Output::position, 1e-3, {.state_age = 10.0, .command_age = 10.0, .approval_age = 0.7});
  {
    Loop alone(controller, robot, patient(), {&link});
    alone.start();
    const RunReport report = alone.finish();
    BOOST_TEST(to_string(report.end) == "denied");
    BOOST_TEST(report.unwritten == report.cycles);
  }
  link.reset();
  Supervising supervisor(link.path());
  BOOST_TEST(link.wait_for_supervisor(5.0));
  {
    LoopSettings until_arrived = patient();
    until_arrived.until_arrived = true;
    Loop loop(controller, robot, until_arrived, {&link});
    loop.start();
    const RunReport report = loop.finish();
    BOOST_TEST(to_string(report.end) == "arrived", report.why);
    BOOST_TEST(report.unwritten == 0u);
    BOOST_TEST(link.verdict().approves());
    BOOST_TEST(link.verdict().cycle > 500u);
  }
  controller.set_goal(Eigen::VectorXd::Zero(nv));
  link.reset();
  Loop loop(controller, robot, patient(), {&link});
  loop.start();
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  supervisor.ends = true;  // it dies
  const RunReport report = loop.finish();
  BOOST_TEST(to_string(report.end) == "denied");
  const std::string silent = "a command was not approved: the supervisor has not answered for [s] ";
  BOOST_REQUIRE_MESSAGE(report.why.starts_with(silent), report.why);
  const double silence = std::stod(report.why.substr(silent.size()));
  BOOST_TEST(silence >= 0.7);
  BOOST_TEST(silence < 1.4);
}

BOOST_AUTO_TEST_CASE(a_lost_state_is_braked_under_a_supervisor) {
  class Silent final : public Driver {
   public:
    explicit Silent(const Arm& arm) : robot_(arm, Eigen::VectorXd::Zero(nv)) {}
    const RobotDescription& description() const noexcept override { return robot_.description(); }
    void start(Output output) override { robot_.start(output); }
    DriverResult read(RobotState& state, double timeout) noexcept override {
      if (++reads >= 400) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return DriverResult::waiting;
      }
      return robot_.read(state, timeout);
    }
    DriverResult write(const Command& command) noexcept override {
      last = command.velocity.cwiseAbs().maxCoeff();
      fastest = std::max(fastest, last);
      return robot_.write(command);
    }
    void stop() noexcept override {}
    std::string trouble() const override { return {}; }
    IdealDriver robot_;
    int reads = 0;
    double last = 0.0, fastest = 0.0;
  };
  const Arm arm = covered_arm(test::arm_limits(nv));
  Controller controller(arm, test::repeatable_settings(Output::position));
  controller.set_obstacles(Obstacles::none());
  controller.set_goal(Eigen::VectorXd::Constant(nv, 0.8));
  Silent robot(arm);
  // The state is missed for longer than the loop may be silent, and its age is judged strictly.
  SupervisorLink link(arm.robot(), Output::position, 1e-3,
                      {.state_age = 0.5, .blind_time = 10.0, .command_age = 1.0, .approval_age = 1.0});
  Supervising supervisor(link.path());
  BOOST_TEST(link.wait_for_supervisor(5.0));
  Loop loop(controller, robot, {.state_timeout = 1.5, .longest_gap = 10.0}, {&link});
  loop.start();
  const RunReport report = loop.finish();
  BOOST_TEST(to_string(report.end) == "state_lost", report.why);
  BOOST_TEST(report.unwritten == 0u);
  BOOST_TEST(robot.fastest > 0.1);
  BOOST_TEST(robot.last < 0.01);
}

BOOST_AUTO_TEST_CASE(a_supervisor_denies_what_another_arm_reports) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  SupervisorLink link(arm.robot(), Output::position, 1e-3, {.command_age = 1.0, .approval_age = 0.5});
  Supervising supervisor(link.path());
  BOOST_TEST(link.wait_for_supervisor(5.0));
  RobotState state(nv - 1);
  Command command(nv - 1);
  command.position = command.velocity = Eigen::VectorXd::Zero(nv - 1);
  link.observe(state, command, state.time);
  BOOST_TEST(!link.approves());
  BOOST_TEST((link.verdict().denial == Denial::not_finite), link.why());
}

BOOST_AUTO_TEST_CASE(a_supervisor_that_comes_later_judges_nothing_of_before) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  SupervisorLink link(arm.robot(), Output::position, 1e-3, {.command_age = 0.02, .approval_age = 0.5});
  RobotState state(nv);
  Command command(nv);
  command.position = command.velocity = Eigen::VectorXd::Zero(nv);
  const double long_ago = std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count() - 10.0;
  state.time = long_ago;
  link.observe(state, command, long_ago);
  Supervising supervisor(link.path());
  BOOST_TEST(link.wait_for_supervisor(5.0));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  BOOST_TEST(link.verdict().approves(), link.why());
}

BOOST_AUTO_TEST_CASE(a_robot_with_a_clock_of_its_own_has_no_old_states_until_it_lags) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  SupervisorLink link(arm.robot(), Output::position, 1e-3, {.command_age = 1.0, .approval_age = 0.5});
  Supervising supervisor(link.path());
  BOOST_TEST(link.wait_for_supervisor(5.0));
  RobotState state(nv);
  Command command(nv);
  command.position = command.velocity = Eigen::VectorXd::Zero(nv);
  const double begin = std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  for (int k = 0; k < 500; ++k) {  // its clock has an offset and a drift of 0.05 %
    const double now = begin + 1e-3 * k;
    state.time = 7.0 + 0.9995e-3 * k;
    link.observe(state, command, now);
    BOOST_REQUIRE_MESSAGE(link.approves(), link.why());
  }
  for (int k = 500; k < 560; ++k) {  // it stands still
    link.observe(state, command, begin + 1e-3 * k);
    BOOST_REQUIRE(link.approves() == (k < 550) || (k > 545 && k < 555));
  }
  BOOST_TEST(link.why().starts_with("age of the state [s]"));
}

BOOST_AUTO_TEST_CASE(a_supervisor_refuses_what_is_not_its_memory) {
  BOOST_CHECK_THROW(supervise("/nowhere/supervisor", [] { return true; }), std::system_error);
  BOOST_CHECK_THROW(supervise("/proc/self/status", [] { return true; }), std::exception);
}

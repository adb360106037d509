#include "loop_cycle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "real_time_thread.hpp"
#include "short_number.hpp"
#include "start_checks.hpp"

namespace sidestep {
namespace {

constexpr double first_read = 0.1;  // Longest wait for one read before the run [s].
constexpr double patience = 0.005;  // Longest wait for one read of a run, where periods are shorter [s].
constexpr double blind_braking = 0.5, longest_blind = 1.0;  // Least and longest time of braking where no state comes [s].
constexpr double rest_time = 0.05;  // Time for which the arm must be at rest before the loop lets go of it [s].
constexpr double rest_speed = 0.1;  // Share of the arrival speed below which the commanded velocity counts as rest.
constexpr const char* denied = "a command was not approved";
constexpr int first_steps = 3;  // Steps before the first motion: a clock that begins anew costs one.

/// A source that is expected and has not come; empty: there is none.
std::string missing_source(const Controller& controller) {
  for (const SourceState& source : controller.sources()) {
    if (source.age == std::numeric_limits<double>::infinity()) {
      return source.name;
    }
  }
  return {};
}

}  // namespace

LoopCycle::LoopCycle(Controller& controller, Driver& driver, const LoopSettings& settings,
                     std::vector<CycleObserver*> observers)
    : controller_(controller),
      driver_(driver),
      settings_(settings),
      observers_(std::move(observers)),
      output_(output_of(controller)),
      period_(controller.settings().period),
      state_(controller.num_coordinates()),
      shown_(state_),
      unknown_(Eigen::VectorXd::Constant(controller.num_coordinates(), std::numeric_limits<double>::quiet_NaN())),
      times_(settings.kept_times) {}

void LoopCycle::check_before_motion() {
  step_until_the_world_is_known();
  const SafetyStatus status = controller_.command().status;
  if (status == SafetyStatus::stopping || (status == SafetyStatus::clearance_lost && !settings_.start_in_contact)) {
    throw std::runtime_error("loop: before the first motion: " + controller_.explain());
  }
  shown_.put(state_);
}

void LoopCycle::begin() {
  driver_.start(output_);
  heard_ = due_ = monotonic_time();
  beat_.store(due_);
}

void LoopCycle::step_until_the_world_is_known() {
  const double give_up = monotonic_time() + settings_.start_timeout;
  controller_.restart();
  // Steps without a command to the robot: a camera's images need to know where the arm is.
  bool first = true;
  double stepped = 0.0;
  for (int known = 0; known < first_steps;) {
    read_first_state(give_up);
    check_state(state_, controller_.arm().robot());
    if (first) {  // a robot whose clock begins anew goes on from the time of the run before
      const double before = controller_.time();
      shift_ = state_.time <= before ? before + period_ - state_.time : 0.0;
    }
    state_.time += shift_;
    // The time of a simulator may stand still until it is started.
    const bool goes_on = first || !(state_.time <= stepped);
    first = false;
    stepped = state_.time;
    const Command& command = goes_on ? step_at_state() : controller_.command();
    const SafetyStatus status = command.status;
    for (CycleObserver* const observer : observers_) {
      observer->observe_before_motion(state_, command, monotonic_time());
    }
    const std::string missing = missing_source(controller_);
    if (missing.empty() && !controller_.said().empty()) {
      ++known;
      if (status != SafetyStatus::stopping) {
        return;
      }
    } else if (monotonic_time() > give_up) {
      throw std::runtime_error(
          !missing.empty()
              ? "loop: source '" + missing +
                    "' was expected and has not come, so the arm would stay where it is; start it, or call remove_obstacles"
              : "loop: no obstacles are known, so the arm would stay where it is; call set_obstacles (Obstacles.none() where nothing is "
                "in the way), or feed images to a Perception");
    }
    if (!driver_.description().paced) {
      sleep_until(monotonic_time() + period_);
    }
  }
}

void LoopCycle::read_first_state(double give_up) {
  const std::string robot = "loop: robot '" + driver_.description().name + "'";
  DriverResult result = DriverResult::waiting;
  while ((result = driver_.read(state_, first_read)) == DriverResult::waiting) {
    if (monotonic_time() > give_up) {
      throw std::runtime_error(robot + " sent no state for " + short_number(settings_.start_timeout) + " s");
    }
  }
  if (result != DriverResult::ok) {
    throw std::runtime_error(robot + ": " + driver_.trouble());
  }
}

void LoopCycle::stop(RunEnd end, const std::string& why) noexcept {
  const std::lock_guard lock(words_);
  RunEnd before = RunEnd::running;
  if (end_.compare_exchange_strong(before, end)) {
    try {
      why_ = why;
    } catch (...) {  // out of memory: without words
    }
  }
}

void LoopCycle::end_by(RunEnd end, const char* why) noexcept {
  RunEnd before = RunEnd::running;
  if (end_.compare_exchange_strong(before, end)) {
    own_why_ = why;
  }
}

void LoopCycle::end() noexcept {
  if (ending_since_ >= 0.0) {
    report_.stop_time = clock(monotonic_time()) - ending_since_;
  }
  driver_.stop();
  for (CycleObserver* const observer : observers_) {
    observer->end();
  }
  if (ending_since_ >= 0.0 && !was_paused_) {
    controller_.resume();
  }
  report_.cycles = times_.number();
  try {
    if (report_.at_the_end.empty()) {  // it was cut off
      report_.at_the_end = controller_.explain();
    }
  } catch (...) {  // out of memory: without words
  }
}

RunReport LoopCycle::report() const {
  RunReport report = report_;
  report.end = end_;
  report.why = why_.empty() ? own_why_ : why_;
  if (was_denied_ && report.is_success()) {  // while it was brought to rest
    report.end = RunEnd::denied;
    report.why += (report.why.empty() ? "" : "; ") + std::string(denied);
  }
  if (const std::string trouble = cut_ ? driver_.trouble() : std::string(); !trouble.empty()) {
    report.why += (report.why.empty() ? "" : ": ") + trouble;
  }
  if (was_denied_) {
    for (const CycleObserver* const observer : observers_) {
      const std::string reason = observer->why();
      report.why += reason.empty() ? "" : ": " + reason;
    }
  }
  report.late = times_.late();
  report.taken = times_.taken();
  return report;
}

bool LoopCycle::run() noexcept {
  const double late = wait_for_turn(), began = monotonic_time();
  beat_.store(began, std::memory_order_relaxed);
  if (late > settings_.longest_gap) {
    end_by(RunEnd::late, "the loop was woken too late: the machine is too busy");
  }
  const bool heard = read(began);
  if (cut_) {
    return false;
  }
  if (!heard && !blind_) {  // the robot goes on by itself for now
    observe(controller_.command());
    return true;
  }
  const double got = monotonic_time();
  const Command& command = step(got);
  const bool written = write(command);
  const double ended = monotonic_time();
  const double taken = ended - (driver_.description().paced ? got : began);  // without the wait for the robot's cycle
  times_.add(late, taken);
  report_.missed += late + taken > period_ ? 1 : 0;
  judge(command, ended);
  const bool goes_on_now = written && goes_on(command, ended);
  if (is_stopping() && ending_since_ < 0.0) {
    begin_to_stop(ended);
  }
  return goes_on_now;
}

double LoopCycle::wait_for_turn() noexcept {
  const RobotDescription& robot = driver_.description();
  if (!blind_ && (robot.paced || !robot.real_time)) {
    return 0.0;
  }
  due_ += period_;
  sleep_until(due_);
  const double late = std::max(0.0, monotonic_time() - due_);
  due_ += std::floor(late / period_) * period_;  // cycles that are over are left out
  return late;
}

bool LoopCycle::read(double began) noexcept {
  const DriverResult result = driver_.read(state_, blind_ ? 0.0 : longest_read());
  if (result == DriverResult::lost) {
    end_by(RunEnd::state_lost, "the connection to the robot is gone");
    cut_ = true;
    return false;
  }
  if (result == DriverResult::stopped) {
    end_by(RunEnd::robot_stopped, "the robot has stopped itself");
    cut_ = true;
    return false;
  }
  if (result == DriverResult::waiting) {
    state_.is_lost = true;
    if (!blind_ && monotonic_time() - heard_ > settings_.state_timeout) {
      end_by(RunEnd::state_lost, "no new state came from the robot");
      blind_ = true;
      due_ = began;
    }
    return false;
  }
  state_.time += shift_;
  take_time(monotonic_time());
  blind_ = state_.is_lost = false;
  report_.lost += static_cast<std::uint64_t>(std::max(0, state_.lost_cycles));
  if (state_.lost_cycles * period_ > settings_.longest_gap) {
    end_by(RunEnd::late, "the robot went without commands for too long");
  }
  shown_.draft() = state_;
  shown_.submit();
  return true;
}

void LoopCycle::take_time(double now) noexcept {
  const double gap = state_.time - time_;  // NaN of the first state of a run, and where the robot does not say
  if (gap < -settings_.longest_gap || gap > settings_.longest_gap + (now - heard_)) {
    end_by(RunEnd::state_lost,
           gap < 0.0 ? "the clock of the robot's states has jumped back" : "the clock of the robot's states has jumped ahead");
    shift_ += period_ - gap;  // the arm is brought to rest in a time that goes on
    state_.time += period_ - gap;
  }
  time_ = state_.time;
  heard_ = now;
}

const Command& LoopCycle::step(double now) noexcept {
  if (ending_since_ >= 0.0) {
    controller_.pause();  // again in each cycle: nobody resumes an arm that is being stopped
  }
  if (blind_) {
    return controller_.step(unknown_, unknown_, state_.time + (now - heard_));
  }
  if (state_.lost_cycles > 0 && state_.is_told()) {  // it has gone on by itself
    controller_.continue_from(state_.told_position, state_.told_velocity, state_.told_acceleration);
  }
  return step_at_state();
}

const Command& LoopCycle::step_at_state() noexcept {
  return state_.has_dynamics() ? controller_.step(state_.q, state_.v, state_.mass_matrix, state_.bias, state_.time)
                               : controller_.step(state_.q, state_.v, state_.time);
}

bool LoopCycle::write(const Command& command) noexcept {
  observe(command);
  bool approved = true;
  for (CycleObserver* const observer : observers_) {
    approved = observer->approves() && approved;
  }
  if (!approved) {
    ++report_.unwritten;
    was_denied_ = true;
    end_by(RunEnd::denied, denied);
    return ending_since_ < 0.0;  // the arm's own stop is tried once
  }
  if (output_ == ControllerSettings::Output::position && !command.position.allFinite()) {
    ++report_.unwritten;
    return true;
  }
  switch (driver_.write(command)) {
    case DriverResult::ok:
    case DriverResult::waiting: return true;
    case DriverResult::lost: end_by(RunEnd::state_lost, "the connection to the robot is gone"); break;
    case DriverResult::stopped: end_by(RunEnd::robot_stopped, "the robot has stopped itself"); break;
  }
  cut_ = true;
  return false;
}

void LoopCycle::observe(const Command& command) noexcept {
  const double now = monotonic_time();
  for (CycleObserver* const observer : observers_) {
    observer->observe(state_, command, now);
  }
}

void LoopCycle::begin_to_stop(double now) noexcept {
  ending_since_ = clock(now);
  was_paused_ = controller_.is_paused();
  try {  // the command of this cycle has been sent, and a paused controller would only say that it is paused
    report_.at_the_end = controller_.explain();
  } catch (...) {  // out of memory: without words
  }
}

void LoopCycle::judge(const Command& command, double now) noexcept {
  report_.worst = std::max(report_.worst, command.status);
  const double time = clock(now);
  const auto lasts = [&](double& since, bool holds, double for_how_long) {
    since = !holds ? -1.0 : since < 0.0 ? time : since;
    return holds && time - since >= for_how_long;
  };
  if (lasts(arrived_since_, settings_.until_arrived && command.activity == Activity::arrived, settings_.hold)) {
    end_by(RunEnd::arrived, "the arm is at its goal");
  }
  if (lasts(stale_since_, command.activity == Activity::stale, settings_.silent_timeout)) {
    end_by(RunEnd::source_silent, "a source of obstacles has been silent for too long");
  }
  if (static_cast<double>(times_.number()) * period_ >= settings_.duration) {
    end_by(RunEnd::duration, "the time of the run is over");
  }
}

bool LoopCycle::goes_on(const Command& command, double now) noexcept {
  if (ending_since_ < 0.0) {
    return true;
  }
  const double time = clock(now), braking = time - ending_since_;
  const double speed = controller_.settings().arrival.speed;
  const bool commanded_rest = command.velocity.cwiseAbs().maxCoeff() < rest_speed * speed;
  if (blind_) {
    return braking < blind_braking || (!commanded_rest && braking < longest_blind);
  }
  report_.at_rest = state_.v.cwiseAbs().maxCoeff() < speed && commanded_rest;
  resting_since_ = !report_.at_rest ? -1.0 : resting_since_ < 0.0 ? time : resting_since_;
  const bool rests = report_.at_rest && time - resting_since_ >= rest_time;
  return !rests && braking < settings_.stop_timeout;
}

double LoopCycle::clock(double now) const noexcept {
  return driver_.description().real_time ? now : static_cast<double>(times_.number()) * period_;
}

double LoopCycle::longest_read() const noexcept { return std::max(2.0 * period_, patience); }

}  // namespace sidestep

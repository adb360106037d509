#include "sidestep/loop/loop.hpp"

#include <chrono>
#include <stdexcept>
#include <utility>

#include "loop_cycle.hpp"
#include "real_time_thread.hpp"
#include "start_checks.hpp"

namespace sidestep {
namespace {

constexpr double watch_period = 0.02;  // Time between two looks of the watchdog [s].

}  // namespace

Loop::Loop(Controller& controller, Driver& driver, const LoopSettings& settings, std::vector<CycleObserver*> observers)
    : settings_((settings.validate(), settings)),
      use_((check_description(driver.description(), controller), controller)),
      cycle_(std::make_unique<LoopCycle>(controller, driver, settings, std::move(observers))) {}

Loop::~Loop() {
  stop();
  finish();
}

void Loop::start() {
  if (started_.exchange(true)) {
    throw std::runtime_error("loop: a run starts once; make another Loop for the next run");
  }
  cycle_->check_before_motion();
  locked_ = settings_.lock_memory && lock_memory();  // takes long: before the robot waits for commands
  cycle_->begin();
  running_.store(true, std::memory_order_release);
  thread_ = std::thread([this] { run(); });
  watchdog_ = std::thread([this] { watch(); });
}

void Loop::stop(RunEnd end, const std::string& why) noexcept { cycle_->stop(end, why); }

bool Loop::is_stopping() const noexcept { return cycle_->is_stopping(); }

const RobotState& Loop::state() noexcept { return cycle_->state(); }

const RunReport& Loop::finish() {
  if (thread_.joinable()) {
    thread_.join();
    watchdog_.join();
    report_ = cycle_->report();
    report_.prioritised = prioritised_;
    report_.scheduling = std::move(scheduling_);
  }
  use_.end();
  return report_;
}

void Loop::run() noexcept {
  RealTimeGrant grant = ask_for_real_time(settings_.priority);
  grant.locked = locked_;
  while (cycle_->run()) {
  }
  cycle_->end();
  prioritised_ = grant.prioritised;
  try {
    scheduling_ = grant.words();
  } catch (...) {  // out of memory: without words
  }
  running_.store(false, std::memory_order_release);
}

void Loop::watch() noexcept {
  const double longest = settings_.longest_gap + cycle_->longest_read();
  while (is_running()) {
    std::this_thread::sleep_for(std::chrono::duration<double>(watch_period));
    if (monotonic_time() - cycle_->beat() > longest) {
      stop(RunEnd::late, "the driver did not return in time");
    }
  }
}

}  // namespace sidestep

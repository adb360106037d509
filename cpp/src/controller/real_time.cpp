#include "sidestep/controller/real_time.hpp"

#include <chrono>
#include <stdexcept>
#include <string>
#include <utility>

#ifdef __linux__
#include <pthread.h>
#include <sched.h>
#include <sys/prctl.h>
#endif

#include "../math/settings.hpp"

namespace sidestep {
namespace {

using SteadyClock = std::chrono::steady_clock;

double seconds(SteadyClock::duration duration) { return std::chrono::duration<double>(duration).count(); }

/// Whether this thread is now before all others that are not prioritised themselves.
bool prioritise() noexcept {
#ifdef __linux__
  sched_param parameters{};
  parameters.sched_priority = sched_get_priority_min(SCHED_FIFO);
  return pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0;
#else
  return false;
#endif
}

/// Has it woken when it asked for, not up to 50 µs later to save power.
void wake_promptly() noexcept {
#ifdef __linux__
  prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
#endif
}

ArmState checked(ArmState start, Eigen::Index nv) {
  if (start.q.size() != nv || start.v.size() != nv || !start.q.allFinite() || !start.v.allFinite()) {
    throw std::invalid_argument("real-time run: q and v must have the size of the arm, " + std::to_string(nv) +
                                ", and be finite");
  }
  return start;
}

}  // namespace

void RealTimeSettings::validate() const {
  require(steps >= 1 && steps <= most_steps, "real-time run: steps", static_cast<double>(steps), "from 1 to 100,000,000");
}

RealTimeRun::RealTimeRun(Controller& controller, ArmState start, RealTimeSettings settings)
    : controller_(controller),
      use_(controller),
      settings_((settings.validate(), settings)),
      now_(checked(std::move(start), controller.arm().num_coordinates())),
      state_(now_) {
  record_.late = record_.taken = Eigen::VectorXd::Zero(settings_.steps);
  thread_ = std::thread([this] { run(); });
}

RealTimeRun::~RealTimeRun() {
  stop();
  if (thread_.joinable()) {
    thread_.join();
  }
}

const RealTimeRecord& RealTimeRun::finish() {
  if (thread_.joinable()) {
    thread_.join();
  }
  return record_;
}

void RealTimeRun::run() noexcept {
  record_.prioritised = settings_.priority && prioritise();
  wake_promptly();
  const double step = controller_.settings().period;
  const auto period = std::chrono::duration_cast<SteadyClock::duration>(std::chrono::duration<double>(step));
  const SteadyClock::time_point begin = SteadyClock::now();
  std::int64_t done = 0;
  for (; done < settings_.steps && !stop_; ++done) {
    const SteadyClock::time_point due = begin + (done + 1) * period;
    std::this_thread::sleep_until(due);
    const SteadyClock::time_point woken = SteadyClock::now();
    const Command& command = controller_.step(now_.q, now_.v, static_cast<double>(done + 1) * step);  // the model's own clock
    const SteadyClock::time_point ended = SteadyClock::now();
    record_.late[done] = seconds(woken - due);
    record_.taken[done] = seconds(ended - woken);
    record_.missed += ended > due + period;
    now_.v += step * command.acceleration;
    now_.q += step * now_.v;
    state_.draft().q = now_.q;
    state_.draft().v = now_.v;
    state_.submit();
  }
  record_.late.conservativeResize(done);
  record_.taken.conservativeResize(done);
  use_.end();
  running_.store(false, std::memory_order_release);
}

}  // namespace sidestep

#include "sidestep/control/real_time.hpp"

#include <chrono>
#include <stdexcept>
#include <string>
#include <utility>

#ifdef __linux__
#include <pthread.h>
#include <sched.h>
#include <sys/prctl.h>
#endif

#include "../settings.hpp"

namespace sidestep {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int most_steps = 100'000'000;  // a day at 1 kHz, of which the record takes 1.6 GB
constexpr double longest_period = 60.0;   // [s]: so many steps of it are still a time of the clock
constexpr std::chrono::milliseconds nap{20};  // between two looks whether to stop, while no step is due

double seconds(Clock::duration duration) { return std::chrono::duration<double>(duration).count(); }

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

ArmState checked(ArmState start, const Loop& loop, const Eigen::MatrixXd& mass_matrix, const Eigen::VectorXd& bias) {
  const Eigen::Index nv = loop.system().robot().num_coordinates();
  const auto fits = [nv](const auto& x) { return x.rows() == nv && x.allFinite(); };
  if (!fits(start.q) || !fits(start.v) || !fits(bias) || !fits(mass_matrix) || mass_matrix.cols() != nv) {
    throw std::invalid_argument("real-time run: q, v, bias (" + std::to_string(nv) +
                                ") and mass matrix must have the size of the arm and be finite");
  }
  return start;
}

}  // namespace

void RealTimeSettings::validate() const {
  require_positive(period, "real-time run: period");
  require(period <= longest_period, "real-time run: period", period, "at most 60 s");
  require(steps >= 1 && steps <= most_steps, "real-time run: steps", steps, "from 1 to 100,000,000");
}

RealTimeRun::RealTimeRun(Loop& loop, ArmState start, Eigen::MatrixXd mass_matrix, Eigen::VectorXd bias,
                         RealTimeSettings settings)
    : loop_(loop),
      use_(loop),
      settings_((settings.validate(), settings)),
      mass_matrix_(std::move(mass_matrix)),
      bias_(std::move(bias)),
      now_(checked(std::move(start), loop, mass_matrix_, bias_)),
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
  const auto period = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(settings_.period));
  const Clock::time_point begin = Clock::now();
  int done = 0;
  for (; done < settings_.steps; ++done) {
    const Clock::time_point due = begin + (done + 1) * period;
    while (due - Clock::now() > nap && !stop_) {
      std::this_thread::sleep_for(nap);
    }
    if (stop_) {
      break;
    }
    std::this_thread::sleep_until(due);
    const Clock::time_point woken = Clock::now();
    static_cast<void>(loop_.step(now_.q, now_.v, mass_matrix_, bias_));
    const Clock::time_point ended = Clock::now();
    record_.late[done] = seconds(woken - due);
    record_.taken[done] = seconds(ended - woken);
    record_.missed += ended > due + period;
    const Eigen::VectorXd& a = loop_.solution().acceleration;
    if (a.allFinite()) {
      now_.v += settings_.period * a;
      now_.q += settings_.period * now_.v;
    }
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

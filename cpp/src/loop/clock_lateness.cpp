#include "sidestep/loop/clock_lateness.hpp"

#include <algorithm>
#include <cmath>
#include <thread>

#include "../math/settings.hpp"
#include "real_time_thread.hpp"

namespace sidestep {
namespace {

constexpr double most_turns = 1e8;

}  // namespace

Eigen::VectorXd clock_lateness(double seconds, double period, int priority) {
  require_positive(period, "clock lateness: period");
  const double turns = std::round(seconds / period);
  require(turns >= 1.0 && turns <= most_turns, "clock lateness: turns", turns, "from 1 to 100,000,000");
  Eigen::VectorXd late = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(turns));
  std::thread([&] {
    static_cast<void>(ask_for_real_time(priority));
    double due = monotonic_time();
    for (double& one : late) {
      due += period;
      sleep_until(due);
      one = std::max(0.0, monotonic_time() - due);
      due += std::floor(one / period) * period;
    }
  }).join();
  return late;
}

}  // namespace sidestep

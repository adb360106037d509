#include "sidestep/link/commands_in_flight.hpp"

#include <algorithm>
#include <cmath>

namespace sidestep::link {
namespace {

constexpr double delay_filter = 0.2;  // share by which a new delay changes the filtered one [-]

}  // namespace

CommandsInFlight::CommandsInFlight(Eigen::Index num_joints, double period) : period_(period) {
  for (Sent& one : ring_) {
    one.acceleration = Eigen::VectorXd::Zero(num_joints);
  }
}

void CommandsInFlight::clear() noexcept {
  begin_ = count_ = 0;
  delay_ = 0.0;
  has_delay_ = false;
  last_sequence_ = 0;
}

void CommandsInFlight::taken(std::uint64_t sequence, std::uint64_t cycle) noexcept {
  while (count_ > 1 && at(0).sequence < sequence) {
    begin_ = (begin_ + 1) % most;
    --count_;
  }
  if (count_ > 0 && at(0).sequence == sequence && sequence > last_sequence_ && cycle >= at(0).cycle) {
    last_sequence_ = sequence;
    const double delay = static_cast<double>(cycle - at(0).cycle);
    delay_ = has_delay_ ? delay_ + delay_filter * (delay - delay_) : delay;
    has_delay_ = true;
  }
}

void CommandsInFlight::sent(std::uint64_t sequence, std::uint64_t cycle, const Eigen::VectorXd& acceleration) noexcept {
  if (count_ == most) {
    begin_ = (begin_ + 1) % most;
    --count_;
  }
  Sent& one = ring_[(begin_ + count_) % most];
  one.sequence = sequence;
  one.cycle = cycle;
  one.acceleration = acceleration;
  ++count_;
}

int CommandsInFlight::predict(std::uint64_t cycle, Eigen::VectorXd& q, Eigen::VectorXd& v) const noexcept {
  const auto delay = static_cast<std::uint64_t>(std::lround(delay_));
  const std::uint64_t until = cycle + delay;
  std::size_t now = 0;
  for (std::uint64_t at_cycle = cycle; at_cycle < until && count_ > 0; ++at_cycle) {
    while (now + 1 < count_ && at(now + 1).cycle + delay <= at_cycle) {
      ++now;
    }
    v += period_ * at(now).acceleration;
    q += period_ * v;
  }
  return static_cast<int>(delay);
}

}  // namespace sidestep::link

#include "clock.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace sidestep {
namespace {

constexpr double longest_pause = 0.1;        // Longest time between two steps of a loop that is late [s].
constexpr double longest_periods = 5.0;      // the same, of loops of long periods [periods]
constexpr double stamp_rounding = 1e-6;      // difference of two stamps from a period that is their rounding [s]
constexpr double least_share = 0.05;         // share of a period from which on a told time goes on: no loop is as fast [-]
constexpr double late_from = 1.5;            // periods after which a step is late [-]
constexpr double most_lead = 0.5;            // jitter of the machine's clock that averages out [periods]
constexpr double most_uncounted = 0.5;       // jitter that the reference does not count [periods]
constexpr double steadiness = 0.15;          // change of the measured period that is jitter, as a share of it [-]
constexpr double most_missed_at_once = 1e8;  // missed periods that are counted of one step
constexpr double recall = 1.0;               // over which the share of missing steps is taken [s]
constexpr double at_once = 0.01;    // most that one step counts of it: a single stall is no connection that loses steps [s]
constexpr double said_from = 0.05;  // share of missing steps that is said [-]

double in_seconds(std::chrono::steady_clock::duration duration) noexcept {
  return std::chrono::duration<double>(duration).count();
}

}  // namespace

Clock::Clock(double period, bool synchronous) noexcept
    : period_(period),
      longest_gap_(std::max(longest_pause, longest_periods * period)),
      synchronous_(synchronous),
      tick_(Tick::regular(period)) {
  recent_.fill(period);
}

const Tick& Clock::begin_step(double time) noexcept {
  const auto now = std::chrono::steady_clock::now();
  if (!given_) {
    machine_ = {};
    machine_.now = in_seconds(now.time_since_epoch());
    if (has_begun_) {
      machine_.since_begin = in_seconds(now - begun_);
      machine_.since_end = in_seconds(now - ended_);
    }
  }
  given_ = false;
  has_begun_ = true;
  begun_ = now;
  return advance(time, machine_);
}

const Tick& Clock::advance(double time, const Machine& machine) noexcept {
  const bool is_told = std::isfinite(time);
  Tick& t = tick_;
  t.expected = t.period;
  t.back = std::numeric_limits<double>::quiet_NaN();
  t.elapsed = is_told ? since_told(time) : synchronous_ ? period_ : since_machine(machine.since_begin);
  t.gap = t.elapsed > longest_gap_;
  t.pauses = t.gap || (!is_told && machine.since_end > longest_gap_);
  t.moved = t.gap ? t.expected : t.elapsed;
  t.held = held();
  t.period = next_period();
  count(t.elapsed);
  if (t.elapsed == period_) {
    periods_ += 1.0;
  } else {
    anchor_ = t.time + t.elapsed;
    periods_ = 0.0;
  }
  t.time = anchor_ + periods_ * period_;
  told_before_ = is_told;
  if (is_told) {
    has_told_ = true;
    last_time_ = time;
    t.offset = t.time - time;
  } else if (!has_told_ && !synchronous_ && std::isfinite(machine.now)) {
    t.offset = t.time - machine.now;
  }
  return t;
}

double Clock::since_told(double time) noexcept {
  if (!has_told_) {
    return period_;
  }
  const double passed = time - last_time_;
  if (passed < least_share * period_) {
    tick_.back = std::max(0.0, -passed);
    return period_;
  }
  // Periods that were not told in between have been counted.
  const double elapsed = told_before_ ? passed : tick_.own_time(time) - tick_.time;
  return elapsed < least_share * period_ || std::abs(elapsed - period_) < stamp_rounding ? period_ : elapsed;
}

double Clock::since_machine(double since_begin) noexcept {
  if (std::isnan(since_begin)) {
    return period_;
  }
  lead_ += period_ - since_begin;
  if (lead_ >= 0.0) {
    lead_ = std::min(lead_, most_lead * period_);
    return period_;
  }
  return period_ - std::exchange(lead_, 0.0);
}

double Clock::held() noexcept {
  const Tick& t = tick_;
  slip_ += t.moved - t.expected;
  if (std::abs(slip_) <= most_uncounted * std::min(period_, t.expected)) {
    return t.expected;
  }
  const double held = std::max(0.0, t.expected + slip_);
  slip_ -= held - t.expected;
  return held;
}

double Clock::next_period() noexcept {
  const Tick& t = tick_;
  if (t.gap || !t.goes_on()) {
    return t.period;
  }
  recent_[static_cast<std::size_t>(next_)] = t.elapsed;
  next_ = (next_ + 1) % num_recent;
  std::array<double, num_recent> sorted = recent_;
  std::sort(sorted.begin(), sorted.end());
  // A loop is slower by its median, and faster where all of its steps are: a period that is too long is the safe error.
  const double usual = std::max(sorted[num_recent / 2], std::min(sorted.back(), period_));
  const auto is_near = [usual](double period) { return std::abs(usual - period) <= steadiness * period; };
  return is_near(period_) ? period_ : is_near(t.period) ? t.period : usual;
}

void Clock::count(double elapsed) noexcept {
  Tick& t = tick_;
  if (elapsed > late_from * period_) {
    ++t.late;
    t.missed += static_cast<int>(std::min(std::round(elapsed / period_) - 1.0, most_missed_at_once));
  }
  if (!t.gap) {  // a pause says nothing of what comes after it
    const double missing = elapsed > late_from * t.expected ? 1.0 - t.expected / elapsed : 0.0;
    t.missed_share += std::min(elapsed, at_once) / recall * (missing - t.missed_share);
  }
}

std::string Clock::explain() const {
  char text[96] = "";
  if (!tick_.goes_on() && tick_.back > 0.0) {
    std::snprintf(text, sizeof text, "the time went back by %.3g s", tick_.back);
  } else if (!tick_.goes_on()) {
    std::snprintf(text, sizeof text, "the time stands still");
  } else if (tick_.period != period_) {
    std::snprintf(text, sizeof text, "called every %.1f ms, told %.1f ms", 1e3 * tick_.period, 1e3 * period_);
  } else if (tick_.missed_share > said_from) {
    std::snprintf(text, sizeof text, "%.0f %% of the steps are missing", 1e2 * tick_.missed_share);
  }
  return text;
}

}  // namespace sidestep

#include "sidestep/loop/ideal_driver.hpp"

#include <algorithm>
#include <stdexcept>

#include "real_time_thread.hpp"

namespace sidestep {
namespace {

constexpr double longest_pause = 0.1, longest_periods = 5.0;  // Time for which it holds a command [s], [periods]; as of Clock.
constexpr double beyond_speed = 1.2,
                 beyond_stop = 0.1;  // Drives and stops of a real arm: no command asks for more [limits], [rad | m].

}  // namespace

IdealDriver::IdealDriver(const Arm& arm, const Eigen::VectorXd& q, double period, bool real_time, const Eigen::VectorXd& v)
    : state_(arm.num_coordinates()), acceleration_(Eigen::VectorXd::Zero(arm.num_coordinates())) {
  using Output = ControllerSettings::Output;
  description_.name = "ideal " + arm.name();
  description_.joints = arm.robot().coordinate_names();
  description_.limits = arm.robot().limits();
  description_.outputs = {Output::torque, Output::acceleration, Output::velocity, Output::position};
  description_.period = period;
  description_.paced = false;
  description_.real_time = real_time;
  description_.when_silent = "it stays where it is";
  description_.validate();
  if (q.size() != arm.num_coordinates() || !q.allFinite()) {
    throw std::invalid_argument("ideal driver: q has " + std::to_string(q.size()) + " numbers, must have " +
                                std::to_string(arm.num_coordinates()) + ", and all must be finite");
  }
  if (v.size() != 0 && (v.size() != q.size() || !v.allFinite())) {
    throw std::invalid_argument("ideal driver: v has " + std::to_string(v.size()) + " numbers, must have " +
                                std::to_string(arm.num_coordinates()) + ", and all must be finite");
  }
  state_.q = q;
  state_.v = v.size() == 0 ? Eigen::VectorXd(Eigen::VectorXd::Zero(q.size())) : v;
  state_.time = real_time ? monotonic_time() : 0.0;
}

DriverResult IdealDriver::read(RobotState& state, double) noexcept {
  const double before = state_.time, period = description_.period;
  state_.time = description_.real_time ? monotonic_time() : before + period;
  if (has_command_ && output_ != ControllerSettings::Output::position) {
    const double passed = description_.real_time ? std::max(period, state_.time - before) : period;
    const double held = passed > std::max(longest_pause, longest_periods * period) ? period : passed;
    state_.v += held * acceleration_;
    state_.q += held * state_.v;
    if (held > period) {
      keep_within_drives();
    }
  }
  has_command_ = false;
  state = state_;
  return DriverResult::ok;
}

void IdealDriver::keep_within_drives() noexcept {
  const JointLimits& limits = description_.limits;
  for (Eigen::Index k = 0; k < state_.q.size(); ++k) {
    const double fastest = beyond_speed * limits.velocity[k];
    state_.v[k] = std::clamp(state_.v[k], -fastest, fastest);
    const double stopped = std::clamp(state_.q[k], limits.lower[k] - beyond_stop, limits.upper[k] + beyond_stop);
    if (stopped != state_.q[k]) {
      state_.q[k] = stopped;
      state_.v[k] = 0.0;
    }
  }
}

DriverResult IdealDriver::write(const Command& command) noexcept {
  using Output = ControllerSettings::Output;
  if (output_ == Output::position) {
    state_.q = command.position;
  }
  if (output_ == Output::position || output_ == Output::velocity) {
    state_.v = command.velocity;
  } else {
    acceleration_ = command.acceleration;
  }
  has_command_ = true;
  return DriverResult::ok;
}

}  // namespace sidestep

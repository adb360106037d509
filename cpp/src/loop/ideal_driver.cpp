#include "sidestep/loop/ideal_driver.hpp"

#include <algorithm>
#include <stdexcept>

#include "real_time_thread.hpp"

namespace sidestep {

IdealDriver::IdealDriver(const Arm& arm, const Eigen::VectorXd& q, double period, bool real_time, const Eigen::VectorXd& v)
    : state_(arm.num_coordinates()) {
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
  elapsed_ = period;
}

DriverResult IdealDriver::read(RobotState& state, double) noexcept {
  const double before = state_.time;
  state_.time = description_.real_time ? monotonic_time() : before + description_.period;
  elapsed_ = description_.real_time ? std::max(description_.period, state_.time - before) : description_.period;
  state = state_;
  return DriverResult::ok;
}

DriverResult IdealDriver::write(const Command& command) noexcept {
  using Output = ControllerSettings::Output;
  if (output_ == Output::position) {
    state_.q = command.position;
    state_.v = command.velocity;
    return DriverResult::ok;
  }
  if (output_ == Output::velocity) {
    state_.v = command.velocity;
  } else {
    state_.v += elapsed_ * command.acceleration;
  }
  state_.q += elapsed_ * state_.v;
  return DriverResult::ok;
}

}  // namespace sidestep

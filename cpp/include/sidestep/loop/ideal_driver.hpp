#pragma once

#include <Eigen/Core>
#include <string>

#include "sidestep/arm/arm.hpp"
#include "sidestep/loop/driver.hpp"

namespace sidestep {

/// An ideal robot: it tracks every command exactly. With torque or acceleration v ← v + a T, q ← q + v T; with velocity or position it is
/// where the reference is, at its speed. T is the time between the last two reads, at least a period: its clock is the machine's, or its own, which goes on
/// by a period with each read.
class IdealDriver final : public Driver {
 public:
  /// Starts at q (nv) with velocity v (nv); empty: at rest. Throws std::invalid_argument on a wrong size or what is not finite, or a
  /// period that is not allowed.
  IdealDriver(const Arm& arm, const Eigen::VectorXd& q, double period = 0.001, bool real_time = true,
              const Eigen::VectorXd& v = {});

  const RobotDescription& description() const noexcept override { return description_; }
  void start(ControllerSettings::Output output) override { output_ = output; }
  DriverResult read(RobotState& state, double timeout) noexcept override;
  DriverResult write(const Command& command) noexcept override;
  void stop() noexcept override { state_.v.setZero(); }
  std::string trouble() const override { return {}; }

 private:
  RobotDescription description_;
  ControllerSettings::Output output_ = ControllerSettings::Output::acceleration;
  RobotState state_;
  double elapsed_;  // between the last two reads [s]
};

}  // namespace sidestep

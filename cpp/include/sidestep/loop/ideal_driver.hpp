#pragma once

#include <Eigen/Core>
#include <string>

#include "sidestep/arm/arm.hpp"
#include "sidestep/loop/driver.hpp"

namespace sidestep {

/// An ideal robot: it tracks every command exactly, and holds it until the next read. With torque or acceleration v ← v + a T,
/// q ← q + v T; with velocity q ← q + v T; with position it is where the reference is, at its speed. T is the time since the read before,
/// at least a period: its clock is the machine's, or its own, which goes on by a period with each read. A longer T than
/// 0.1 s and five periods counts as one period, as for the controller: nobody led the robot, and it stayed. A command that is held for
/// longer than a period leaves it no faster than 1.2 times the arm's limits, and no farther than 0.1 rad | m beyond its ends.
class IdealDriver final : public Driver {
 public:
  /// Starts at q (nv) with velocity v (nv); empty: at rest. Throws std::invalid_argument on a wrong size or what is not finite, or a
  /// period that is not allowed.
  IdealDriver(const Arm& arm, const Eigen::VectorXd& q, double period = 0.001, bool real_time = true,
              const Eigen::VectorXd& v = {});

  const RobotDescription& description() const noexcept override { return description_; }
  void start(ControllerSettings::Output output) override {
    output_ = output;
    acceleration_.setZero();
    has_command_ = false;
  }
  DriverResult read(RobotState& state, double timeout) noexcept override;
  DriverResult write(const Command& command) noexcept override;
  void stop() noexcept override {
    state_.v.setZero();
    has_command_ = false;
  }
  std::string trouble() const override { return {}; }

 private:
  void keep_within_drives() noexcept;

  RobotDescription description_;
  ControllerSettings::Output output_ = ControllerSettings::Output::acceleration;
  RobotState state_;
  Eigen::VectorXd acceleration_;  // of the last command
  bool has_command_ = false;      // since the last read
};

}  // namespace sidestep

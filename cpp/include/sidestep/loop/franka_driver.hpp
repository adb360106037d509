#pragma once

#include <memory>
#include <string>

#include "sidestep/loop/driver.hpp"

namespace sidestep {

/// Drives a Franka Research 3 by libfranka: joint torques, velocities or positions, 1,000 a second. Only in builds with
/// -DSIDESTEP_FRANKA=ON.
///
/// A command that does not reach the robot within its cycle is lost: the robot goes on by itself, and judges the next command
/// against that. So each command goes on from what the robot says that it was told (StreamLimiter); one that would come late is not
/// sent; and the first state after a gap is not answered, as a command may still be on its way.
class FrankaDriver final : public Driver {
 public:
  /// Connects. `enforce_real_time`: only on a real-time kernel. Throws what libfranka throws.
  explicit FrankaDriver(const std::string& address, bool enforce_real_time = true);
  ~FrankaDriver() override;

  const RobotDescription& description() const noexcept override;
  void start(ControllerSettings::Output output) override;
  /// Waits as long as libfranka does, 1 s, whatever `timeout`.
  DriverResult read(RobotState& state, double timeout) noexcept override;
  DriverResult write(const Command& command) noexcept override;
  void stop() noexcept override;
  std::string trouble() const override;

  /// Ends a reflex, so that `start` may be called again. Throws what libfranka throws.
  void recover();
  int late() const noexcept;  ///< commands that were not sent because they would have come late

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sidestep

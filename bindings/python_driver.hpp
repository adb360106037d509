#pragma once

#include <nanobind/nanobind.h>

#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>

#include "sidestep/loop/driver.hpp"

namespace sidestep::python {

namespace nb = nanobind;

/// The robot has stopped itself, as a driver in Python says.
struct RobotStopped : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A driver in Python: an object with `description`, `start`, `read`, `write` and `stop`. An exception of RobotStopped means that the
/// robot has stopped itself, any other that the connection is lost.
class PythonDriver final : public Driver {
 public:
  /// With the GIL. Raises TypeError that names what the object lacks.
  explicit PythonDriver(nb::object object);

  const RobotDescription& description() const noexcept override { return description_; }
  void start(ControllerSettings::Output output) override;
  DriverResult read(RobotState& state, double timeout) noexcept override;
  DriverResult write(const Command& command) noexcept override;
  void stop() noexcept override;
  std::string trouble() const override;
  /// Raises the exception of `start` or of the last call that failed; without one returns. With the GIL.
  void raise_error();

 private:
  template <class Call>
  DriverResult guarded(Call&& call) noexcept;
  DriverResult fail(nb::python_error& error);

  nb::object object_, read_, write_;
  RobotDescription description_;
  std::optional<nb::python_error> error_;  // under the GIL
  mutable std::mutex words_;
  std::string trouble_;
};

}  // namespace sidestep::python

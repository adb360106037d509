#include "python_driver.hpp"

#include <utility>

#include "arguments.hpp"

namespace sidestep::python {

PythonDriver::PythonDriver(nb::object object) : object_(std::move(object)) {
  for (const char* name : {"description", "start", "read", "write", "stop"}) {
    if (!nb::hasattr(object_, name)) {
      throw nb::type_error((std::string("driver is ") + nb::repr(object_).c_str() + ", it lacks '" + name +
                            "'; a driver has description, start, read, write and stop").c_str());
    }
  }
  description_ = as_instance<RobotDescription>(object_.attr("description"), "driver.description", "a RobotDescription");
  read_ = object_.attr("read");
  write_ = object_.attr("write");
}

DriverResult PythonDriver::fail(nb::python_error& error) {
  const bool stopped = error.matches(nb::module_::import_("sidestep._core").attr("RobotStopped"));
  {
    const std::lock_guard lock(words_);
    trouble_ = nb::str(error.value()).c_str();
    if (trouble_.empty()) {
      trouble_ = nb::str(error.type().attr("__name__")).c_str();
    }
  }
  error_.reset();
  error_.emplace(std::move(error));
  return stopped ? DriverResult::stopped : DriverResult::lost;
}

template <class Call>
DriverResult PythonDriver::guarded(Call&& call) noexcept {
  const nb::gil_scoped_acquire acquire;
  try {
    return call();
  } catch (nb::python_error& error) {
    return fail(error);
  } catch (const std::exception& error) {
    const std::lock_guard lock(words_);
    trouble_ = error.what();
    return DriverResult::lost;
  }
}

void PythonDriver::start(ControllerSettings::Output output) {
  const DriverResult result = guarded([&] {
    object_.attr("start")(to_string(output));
    return DriverResult::ok;
  });
  if (result != DriverResult::ok) {
    throw std::runtime_error("driver: robot '" + description_.name + "' did not start: " + trouble());
  }
}

DriverResult PythonDriver::read(RobotState& state, double timeout) noexcept {
  return guarded([&] {
    const nb::object got = read_(timeout);
    if (got.is_none()) {
      return DriverResult::waiting;
    }
    const RobotState& read = as_instance<RobotState>(got, "what driver.read gave", "a RobotState or None");
    if (read.q.size() != state.q.size()) {
      throw std::runtime_error("driver.read gave " + std::to_string(read.q.size()) + " joints, the arm has " +
                               std::to_string(state.q.size()));
    }
    state = read;
    return DriverResult::ok;
  });
}

DriverResult PythonDriver::write(const Command& command) noexcept {
  return guarded([&] {
    write_(nb::cast(&command, nb::rv_policy::reference));
    return DriverResult::ok;
  });
}

void PythonDriver::stop() noexcept {
  guarded([&] {
    object_.attr("stop")();
    return DriverResult::ok;
  });
}

std::string PythonDriver::trouble() const {
  const std::lock_guard lock(words_);
  return trouble_;
}

void PythonDriver::raise_error() {
  if (error_) {
    nb::python_error error(std::move(*error_));
    error_.reset();
    throw error;
  }
}

}  // namespace sidestep::python

#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/string.h>

#include <filesystem>
#include <system_error>

namespace sidestep::python {

namespace nb = nanobind;

/// Runs `action`; what the system refuses becomes OSError with the number that Python makes FileNotFoundError and such
/// of, and the path.
template <class Action>
auto with_os_errors(const std::filesystem::path& path, Action&& action) {
  try {
    return action();
  } catch (const std::system_error& error) {
    const nb::object arguments = nb::make_tuple(error.code().value(), error.code().message(), path);
    PyErr_SetObject(PyExc_OSError, arguments.ptr());
    throw nb::python_error();
  }
}

}  // namespace sidestep::python

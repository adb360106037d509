#pragma once

#include <nanobind/nanobind.h>

#include "sidestep/perception/depth_image.hpp"

namespace sidestep::python {

namespace nb = nanobind;

/// An array of depths that keeps what it shows alive.
struct DepthPixels {
  nb::object owner;
  RawDepth raw;
  int height = 0, width = 0;
};

/// An array (height, width) of uint16 or floats; `unit` [m], None: 0.001 of uint16, 1 of floats. Raises ValueError or TypeError that
/// names the value and what is allowed.
DepthPixels as_depth_pixels(nb::handle given, nb::handle unit);

}  // namespace sidestep::python

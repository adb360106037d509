#pragma once

#include <cstdio>
#include <string>

namespace sidestep {

/// A number for a message, with five digits at most.
inline std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.5g", value);
  return text;
}

}  // namespace sidestep

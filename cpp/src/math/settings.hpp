#pragma once

#include <limits>
#include <stdexcept>
#include <string>

namespace sidestep {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

/// Throws std::invalid_argument "<setting> is <value>, must be <range>" unless the value is allowed.
inline void require(bool allowed, const char* setting, double value, const char* range) {
  if (!allowed) {
    throw std::invalid_argument(std::string(setting) + " is " + std::to_string(value) + ", must be " + range);
  }
}

inline void require_positive(double value, const char* setting) {
  require(value > 0.0 && value < infinity, setting, value, "finite and positive");
}

}  // namespace sidestep

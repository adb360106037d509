#pragma once

#include <string>

#include "sidestep/attractor/embedding.hpp"
#include "sidestep/constraints/acceleration_bounds.hpp"

namespace sidestep {

/// For example "link 'hand' and 'ball'".
std::string parties(const CoordinateLabel& label, const std::string& obstacle);
/// For example "12 mm".
std::string millimetres(double metres);
/// For example "0.62 s old, more than inputs.timeout (0.5 s)".
std::string age_in_words(double seconds, const char* setting, double timeout);
/// A number with some digits, and no sign where they are all zero.
std::string in_digits(double value, int digits);
/// For example "0.12 of 0.30 rad/s".
std::string rates_in_words(double got, double asked, const char* unit);
/// The limit in a set that is named first, for example "velocity limit".
const char* limit_in_words(Limit set) noexcept;

}  // namespace sidestep

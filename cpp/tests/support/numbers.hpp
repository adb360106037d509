#pragma once

#include <limits>

namespace sidestep::test {

inline constexpr double infinity = std::numeric_limits<double>::infinity();
inline constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
inline constexpr int nv = 7;  // coordinates of the arm in most tests

}  // namespace sidestep::test

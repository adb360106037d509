#pragma once

namespace sidestep::kernels {

inline constexpr int most_lanes = 8;  // Doubles in the widest register.

}  // namespace sidestep::kernels

#pragma once

// A link as the inner loops write and read it (KinematicState::Link::numbers).
namespace sidestep::kernels {

/// Numbers of a link at a state, in this order: orientation by columns (9), position, screw, velocity and bias
/// (angular, then linear, each), and one that vectors of four go on to.
inline constexpr int link_numbers = 9 + 3 + 6 + 6 + 6 + 1;
inline constexpr int position_at = 9, screw_at = 12, velocity_at = 18, bias_at = 24;

}  // namespace sidestep::kernels

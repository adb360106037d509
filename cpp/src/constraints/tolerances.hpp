#pragma once

namespace sidestep {

/// Slack that is rounding and not worth a status, relative to 1 /s² plus the bound.
inline constexpr double slack_tolerance = 1e-9;
/// Shortest gradient that joints can change [m/rad].
inline constexpr double shortest_gradient = 1e-6;
/// Closing speed that does not count [m/s]: rounding, or a clearance that joints hardly change.
inline constexpr double creeping = 1e-4;

}  // namespace sidestep

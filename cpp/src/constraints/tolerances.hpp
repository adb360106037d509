#pragma once

namespace sidestep {

/// Slack below this, relative to 1 /s² plus the bound, is rounding and not worth a status.
inline constexpr double slack_tolerance = 1e-9;
/// [m/rad] A gradient shorter than this is one that no joint can change.
inline constexpr double shortest_gradient = 1e-6;
/// [m/s] What closes no faster does not close: rounding, or a clearance that joints hardly change.
inline constexpr double creeping = 1e-4;

}  // namespace sidestep

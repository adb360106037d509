#pragma once

namespace sidestep {

/// Order in which constraints give way if not all can be kept: the last one first. The task gives way to all of them, since it is
/// only the cost.
enum class Priority {
  never,      ///< Torque limits and the rate of torque. If they cannot be kept, the arm makes a damped stop.
  position,   ///< Position limits, and the overruns of speed and acceleration: left only as far as torque requires.
  clearance,  ///< Clearances: each row falls short by its share of the least sum of squares.
  comfort,    ///< Velocity and acceleration limits up to the overruns, by a slack per joint; speed, by one slack for all rows.
  jerk,       ///< Jerk limits: dropped as a whole.
};

}  // namespace sidestep

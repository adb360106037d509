#pragma once

#include <Eigen/Core>

namespace sidestep {

/// How late a thread wakes that does nothing but wait for its turn, once a period [s]: what a loop on this machine cannot be better than
/// [s]. `priority`: as LoopSettings::priority. Throws std::invalid_argument for more than 100,000,000 turns, or none.
Eigen::VectorXd clock_lateness(double seconds, double period, int priority);

}  // namespace sidestep

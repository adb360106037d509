#include "sidestep/math/progress_monitor.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

namespace sidestep {

ProgressMonitor::ProgressMonitor(double patience, double fraction) : patience_(patience), fraction_(fraction) {
  if (!(patience > 0.0) || !std::isfinite(patience)) {
    throw std::invalid_argument("progress monitor: patience is " + std::to_string(patience) +
                                " s, must be positive and finite");
  }
  if (!(fraction > 0.0 && fraction < 1.0)) {
    throw std::invalid_argument("progress monitor: fraction is " + std::to_string(fraction) + ", must be in (0, 1)");
  }
}

}  // namespace sidestep

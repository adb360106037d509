#include "sidestep/attractor/clearance_barrier.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace sidestep {
ClearanceBarrier::ClearanceBarrier(const Robot& robot, const Body& body, BarrierFunction barrier, double temperature,
                                   double reach, double window)
    : Barrier(robot, barrier, "clearance barrier"),
      field_(robot, body, temperature, window),
      reach_(std::max(reach, barrier.activation)),
      links_(body.links) {
  if (!std::isfinite(reach)) {
    throw std::invalid_argument("clearance barrier: reach is " + std::to_string(reach) + " m, must be finite");
  }
  set_num_coordinates(field_.size());
}

void ClearanceBarrier::add_to(EmbeddingView out, const KinematicState& state, const Obstacles& obstacles) const noexcept {
  Horizon ahead = horizon(state);
  ahead.time = std::max(ahead.time, out.horizon);
  field_.evaluate(state, obstacles, reach_, ahead, out.clearances);
  add_barriers(out);
}

CoordinateLabel ClearanceBarrier::label(int k) const {
  return {CoordinateLabel::Kind::obstacle, links_[static_cast<std::size_t>(field_.component(k))], {}, function().floor};
}

}  // namespace sidestep

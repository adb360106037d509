#include "sidestep/embedding/clearance_table_barrier.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace sidestep {

ClearanceTableBarrier::ClearanceTableBarrier(const Robot& robot, std::vector<ClearanceTable> tables,
                                             BarrierFunction barrier, double reach)
    : Barrier(robot, barrier, "clearance table barrier"),
      reach_(std::max(reach, barrier.activation)),
      tables_(std::move(tables)) {
  if (!std::isfinite(reach)) {
    throw std::invalid_argument("clearance table barrier: reach is " + std::to_string(reach) + " m, must be finite");
  }
  if (tables_.empty()) {
    throw std::invalid_argument("clearance table barrier: there is no table");
  }
  for (const ClearanceTable& table : tables_) {
    robot.frame_index(table.first), robot.frame_index(table.second);
    table.validate(robot.num_coordinates());
  }
  set_num_coordinates(static_cast<int>(tables_.size()));
}

void ClearanceTableBarrier::add_to(EmbeddingView out, const KinematicState& state,
                                   const Obstacles& /*obstacles*/) const noexcept {
  const Horizon ahead = horizon(state);
  for (std::size_t i = 0; i < tables_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const int x = tables_[i].axes[0].coordinate, y = tables_[i].axes[1].coordinate;
    const ClearanceTable::Sample h = tables_[i].at(state.q()[x], state.q()[y]);
    const Eigen::Vector2d v(state.v()[x], state.v()[y]);
    const double rate = h.gradient.dot(v);
    if (!(h.value < reach_) && !(h.value + ahead.time * rate < ahead.distance)) {
      continue;
    }
    for (ClearanceStateView* view : {static_cast<ClearanceStateView*>(&out.clearances), &out.clearances.approach}) {
      view->values[k] = h.value;
      view->rates[k] = rate;
      view->curvatures[k] = v.dot(h.hessian * v);
      view->gradients.col(k).setZero();
      view->gradients(x, k) = h.gradient.x();
      view->gradients(y, k) = h.gradient.y();
    }
    out.clearances.nearest[k] = 0;
  }
  add_barriers(out);
}

CoordinateLabel ClearanceTableBarrier::label(int k) const {
  const ClearanceTable& table = tables_[static_cast<std::size_t>(k)];
  return {CoordinateLabel::Kind::self, table.first, table.second, function().floor};
}

}  // namespace sidestep

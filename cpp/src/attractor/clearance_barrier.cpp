#include "sidestep/attractor/clearance_barrier.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace sidestep {
namespace {

constexpr const char* pairs_owner = "self-collision barrier";
constexpr const char* tables_owner = "clearance table barrier";
constexpr const char* plane_owner = "plane barrier";

}  // namespace

ClearanceBarrier::ClearanceBarrier(const Robot& robot, std::shared_ptr<const ClearanceGroup> group,
                                   const BarrierFunction& function, double reach, const char* owner)
    : Barrier(robot, function, owner), group_(std::move(group)), reach_(std::max(reach, function.activation)) {
  if (!std::isfinite(reach)) {
    throw std::invalid_argument(std::string(owner) + ": reach is " + std::to_string(reach) + " m, must be finite");
  }
  if (group_->size() == 0) {
    throw std::invalid_argument(std::string(owner) + ": there is no clearance to keep");
  }
  set_num_coordinates(group_->size());
  for (int k = 0; k < group_->size(); ++k) {
    shorten_activation(k, group_->longest_activation(k));
  }
}

ClearanceBarrier::ClearanceBarrier(const Robot& robot, const Body& body, const BarrierFunction& function, double temperature,
                                   double reach, double window)
    : ClearanceBarrier(robot, std::make_shared<ClearanceField>(robot, body, temperature, window), function, reach) {}

void ClearanceBarrier::add_to(EmbeddingView out, const KinematicState& state, const Obstacles& obstacles) const noexcept {
  Horizon ahead = horizon(state);
  if (group_->is_seen()) {
    ahead.time = std::max(ahead.time, out.horizon);
  }
  group_->evaluate(state, obstacles, reach_, ahead, out.clearances);
  add_barriers(out);
}

CoordinateLabel ClearanceBarrier::label(int k) const {
  CoordinateLabel label = group_->label(k);
  label.floor = floor(k);
  return label;
}

SelfCollisionBarrier::SelfCollisionBarrier(const Robot& robot, const Body& body, const std::vector<LinkPair>& pairs,
                                           const BarrierFunction& function, double temperature, double reach)
    : ClearanceBarrier(robot,
                       std::make_shared<PairClearances>(robot, std::make_shared<BodyLinks>(robot, body, pairs_owner), pairs,
                                                        temperature, pairs_owner),
                       function, reach, pairs_owner) {}

PairDistanceTableBarrier::PairDistanceTableBarrier(const Robot& robot, std::vector<PairDistanceTable> tables,
                                                   const BarrierFunction& function, double reach)
    : ClearanceBarrier(robot, std::make_shared<TableClearances>(robot, std::move(tables), tables_owner), function, reach,
                       tables_owner) {}

PlaneBarrier::PlaneBarrier(const Robot& robot, const Body& body, const KeptPlane& plane, const BarrierFunction& function,
                           double temperature, double reach)
    : ClearanceBarrier(robot,
                       std::make_shared<PlaneClearances>(robot, std::make_shared<BodyLinks>(robot, body, plane_owner), plane,
                                                         temperature, plane_owner),
                       function, reach, plane_owner) {}

}  // namespace sidestep

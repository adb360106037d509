#include "sidestep/planning/plan.hpp"

#include <cmath>

namespace sidestep {

const char* name(PlanStatus status) noexcept {
  switch (status) {
    case PlanStatus::found: return "found";
    case PlanStatus::no_path: return "no_path";
    case PlanStatus::timeout: return "timeout";
    case PlanStatus::start_in_collision: return "start_in_collision";
    case PlanStatus::goal_in_collision: return "goal_in_collision";
    case PlanStatus::invalid: return "invalid";
  }
  return "unknown";
}

double length(const Eigen::MatrixXd& path) noexcept {
  double sum = 0.0;
  for (Eigen::Index k = 1; k < path.cols(); ++k) {
    sum += (path.col(k) - path.col(k - 1)).norm();
  }
  return sum;
}

std::string describe(const Obstruction& obstruction) {
  const std::string millimetres = std::to_string(static_cast<int>(std::lround(1e3 * obstruction.depth)));
  const std::string in = " is " + millimetres + " mm deep in ";
  switch (obstruction.label.kind) {
    case CoordinateLabel::Kind::obstacle: return "link '" + obstruction.label.name + "'" + in + obstruction.obstacle;
    case CoordinateLabel::Kind::self:
      return "links '" + obstruction.label.name + "' and '" + obstruction.label.other + "' touch, " + millimetres + " mm deep";
    case CoordinateLabel::Kind::plane: return "link '" + obstruction.label.name + "'" + in + "a plane";
    case CoordinateLabel::Kind::effort:
      return "joint '" + obstruction.label.name + "' cannot hold the arm against gravity within its effort limit";
    default: return "nothing";
  }
}

}  // namespace sidestep

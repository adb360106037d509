#include "sidestep/attractor/clearance_table_barrier.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace sidestep {
namespace {

/// The way to a stop is looked at as often as it passes cells of the table, but no more often than this.
constexpr double most_steps_ahead = 16.0;

/// Of h along the path, as it is seen from here.
struct Tangent {
  double value, rate, curvature;
  Eigen::Vector2d gradient;
};

}  // namespace

ClearanceTableBarrier::ClearanceTableBarrier(const Robot& robot, std::vector<ClearanceTable> tables, BarrierFunction barrier,
                                             double reach)
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
    steepest_.push_back(table.steepest());
  }
  set_num_coordinates(static_cast<int>(tables_.size()));
  for (std::size_t i = 0; i < tables_.size(); ++i) {
    shorten_for_usual(static_cast<int>(i), tables_[i].median());
  }
}

void ClearanceTableBarrier::add_to(EmbeddingView out, const KinematicState& state,
                                   const Obstacles& /*obstacles*/) const noexcept {
  const Horizon ahead = horizon(state);
  for (std::size_t i = 0; i < tables_.size(); ++i) {
    const ClearanceTable& table = tables_[i];
    const int x = table.axes[0].coordinate, y = table.axes[1].coordinate;
    const Eigen::Vector2d v(state.v()[x], state.v()[y]);
    // The tangent at `time` along the straight path, seen from where the arm is.
    const auto tangent = [&](double time) {
      const ClearanceTable::Sample h = table.at(state.q()[x] + time * v.x(), state.q()[y] + time * v.y());
      const double rate = h.gradient.dot(v);
      return Tangent{h.value - time * rate, rate, v.dot(h.hessian * v), h.gradient};
    };
    const Tangent here = tangent(0.0);
    Tangent minded = here;
    if (here.value - ahead.time * steepest_[i].dot(v.cwiseAbs()) < ahead.distance) {
      const double cells =
          ahead.time * std::max(std::abs(v.x()) / table.axes[0].spacing, std::abs(v.y()) / table.axes[1].spacing);
      const double steps = std::ceil(std::min(cells, most_steps_ahead));
      for (double step = 1.0; step <= steps; ++step) {
        const Tangent there = tangent(ahead.time * step / steps);
        if (there.value + ahead.time * there.rate < minded.value + ahead.time * minded.rate) {
          minded = there;
        }
      }
    }
    if (!(here.value < reach_) && !(minded.value + ahead.time * minded.rate < ahead.distance)) {
      continue;
    }
    const auto write = [k = static_cast<Eigen::Index>(i), x, y](const Tangent& of, ClearanceStateView& to) {
      to.values[k] = of.value;
      to.rates[k] = of.rate;
      to.curvatures[k] = of.curvature;
      to.gradients.col(k).setZero();
      to.gradients(x, k) = of.gradient.x();
      to.gradients(y, k) = of.gradient.y();
    };
    write(here, out.clearances);
    minded.curvature = std::max(minded.curvature, 0.0);  // see the header
    write(minded, out.clearances.approach);
    out.clearances.nearest[static_cast<Eigen::Index>(i)] = 0;
    out.clearances.least[static_cast<Eigen::Index>(i)] = here.value;
  }
  add_barriers(out);
}

CoordinateLabel ClearanceTableBarrier::label(int k) const {
  const ClearanceTable& table = tables_[static_cast<std::size_t>(k)];
  return {CoordinateLabel::Kind::self, table.first, table.second, floor(k)};
}

}  // namespace sidestep

#include "sidestep/clearance/table_clearances.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace sidestep {
namespace {

/// Most samples along the stop: otherwise one per cell of the table that it passes.
constexpr double most_steps_ahead = 16.0;

/// Of h along the path, as it is seen from here.
struct Tangent {
  double value, rate, curvature;
  Eigen::Vector2d gradient;
};

}  // namespace

TableClearances::TableClearances(const Robot& robot, std::vector<PairDistanceTable> tables, const char* owner)
    : tables_(std::move(tables)) {
  if (tables_.empty()) {
    throw std::invalid_argument(std::string(owner) + ": there is no table");
  }
  for (const PairDistanceTable& table : tables_) {
    robot.frame_index(table.first), robot.frame_index(table.second);
    table.validate(robot.num_coordinates());
    steepest_.push_back(table.steepest());
    activations_.push_back(activation_for_usual(table.median()));
  }
}

void TableClearances::evaluate(const KinematicState& state, const Obstacles& /*obstacles*/, double reach, const Horizon& ahead,
                               ClearanceView out) const noexcept {
  for (std::size_t i = 0; i < tables_.size(); ++i) {
    const PairDistanceTable& table = tables_[i];
    const int x = table.axes[0].coordinate, y = table.axes[1].coordinate;
    const Eigen::Vector2d v(state.v()[x], state.v()[y]);
    // The tangent at `time` along the straight path, seen from where the arm is.
    const auto tangent = [&](double time) {
      const PairDistanceTable::Sample h = table.at(state.q()[x] + time * v.x(), state.q()[y] + time * v.y());
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
    if (!(here.value < reach) && !(minded.value + ahead.time * minded.rate < ahead.distance)) {
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
    write(here, out);
    minded.curvature = std::max(minded.curvature, 0.0);  // see the header
    write(minded, out.approach);
    out.nearest[static_cast<Eigen::Index>(i)] = 0;
    out.least[static_cast<Eigen::Index>(i)] = here.value;
  }
}

CoordinateLabel TableClearances::label(int k) const {
  const PairDistanceTable& table = tables_[static_cast<std::size_t>(k)];
  return {CoordinateLabel::Kind::self, table.first, table.second};
}

}  // namespace sidestep

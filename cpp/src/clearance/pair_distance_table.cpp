#include "sidestep/clearance/pair_distance_table.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace sidestep {
namespace {

/// The four control points that matter at a coordinate, with the values and derivatives of their basis functions.
struct Weights {
  std::array<Eigen::Index, 4> index;
  Eigen::Vector4d value, first, second;

  Weights(const PairDistanceTable::Axis& axis, Eigen::Index count, double q) noexcept {
    const double x = (q - axis.begin) / axis.spacing;
    const auto last = static_cast<double>(count - 3);
    // Of a state that is not finite the weights are not, and the indices valid.
    double cell = std::floor(axis.periodic ? x - std::floor(x / static_cast<double>(count)) * static_cast<double>(count)
                                           : std::clamp(x, 1.0, last));
    const double t = axis.periodic ? x - std::floor(x) : std::clamp(x, 1.0, last + 1.0) - cell;
    cell = std::isfinite(cell) ? cell : 1.0;
    for (int k = 0; k < 4; ++k) {
      index[static_cast<std::size_t>(k)] = (static_cast<Eigen::Index>(cell) + k - 1 + count) % count;
    }
    const double u = 1.0 - t, per = 1.0 / axis.spacing;
    value = Eigen::Vector4d(u * u * u, (3.0 * t - 6.0) * t * t + 4.0, (3.0 * u - 6.0) * u * u + 4.0, t * t * t) / 6.0;
    first = Eigen::Vector4d(-u * u, (3.0 * t - 4.0) * t, (4.0 - 3.0 * u) * u, t * t) * (0.5 * per);
    second = Eigen::Vector4d(u, 3.0 * t - 2.0, 3.0 * u - 2.0, t) * (per * per);
  }
};

}  // namespace

PairDistanceTable::Sample PairDistanceTable::at(double x, double y) const noexcept {
  const Weights a(axes[0], control.rows(), x), b(axes[1], control.cols(), y);
  Eigen::Matrix4d c;
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < 4; ++i) {
      c(i, j) = control(a.index[static_cast<std::size_t>(i)], b.index[static_cast<std::size_t>(j)]);
    }
  }
  const Eigen::Vector4d along = c * b.value, slope = c * b.first;
  const double mixed = a.first.dot(slope);
  return {a.value.dot(along),
          {a.first.dot(along), a.value.dot(slope)},
          Eigen::Matrix2d{{a.second.dot(along), mixed}, {mixed, a.value.dot(c * b.second)}}};
}

Eigen::Vector2d PairDistanceTable::steepest() const noexcept {
  const auto slope = [&](const Eigen::MatrixXd& along, const Axis& axis) {
    const Eigen::Index last = along.rows() - 1;
    double most = (along.bottomRows(last) - along.topRows(last)).cwiseAbs().maxCoeff();
    if (axis.periodic) {
      most = std::max(most, (along.row(0) - along.row(last)).cwiseAbs().maxCoeff());
    }
    return most / axis.spacing;
  };
  return {slope(control, axes[0]), slope(control.transpose(), axes[1])};
}

double PairDistanceTable::median() const {
  std::vector<double> values(control.data(), control.data() + control.size());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

void PairDistanceTable::validate(int coordinates) const {
  const std::string name = "clearance table of links '" + first + "' and '" + second + "': ";
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const Axis& axis = axes[k];
    const Eigen::Index count = k == 0 ? control.rows() : control.cols();
    if (axis.coordinate < 0 || axis.coordinate >= coordinates) {
      throw std::invalid_argument(name + "coordinate is " + std::to_string(axis.coordinate) + ", must be from 0 to " +
                                  std::to_string(coordinates - 1));
    }
    if (!std::isfinite(axis.begin)) {
      throw std::invalid_argument(name + "begin is " + std::to_string(axis.begin) + ", must be finite");
    }
    if (!(axis.spacing > 0.0) || !std::isfinite(axis.spacing)) {
      throw std::invalid_argument(name + "spacing is " + std::to_string(axis.spacing) + ", must be positive and finite");
    }
    if (count < 4) {
      throw std::invalid_argument(name + "there are " + std::to_string(count) + " control points in a direction, " +
                                  "must be at least 4");
    }
    const double turn = axis.spacing * static_cast<double>(count);
    if (axis.periodic && std::abs(turn - 2.0 * std::numbers::pi) > 1e-9) {
      throw std::invalid_argument(name + "periodic control points span " + std::to_string(turn) + " rad, must be 2 pi");
    }
  }
  if (axes[0].coordinate == axes[1].coordinate) {
    throw std::invalid_argument(name + "both coordinates are " + std::to_string(axes[0].coordinate) + ", must differ");
  }
  if (!control.allFinite()) {
    throw std::invalid_argument(name + "control points must be finite");
  }
}

}  // namespace sidestep

#include "sidestep/body/cover_refinement.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace sidestep {
namespace {

constexpr double momentum = 0.9;          // Decay rate of Adam's first moment.
constexpr double second_momentum = 0.98;  // Decay rate of Adam's second moment: it forgets in about 50 steps.
constexpr int selection_steps = 5;        // Steps for which the selected points near the union's boundary are kept.
constexpr double reach_in_rates = 1.5;    // Motion of the boundary assumed in that time, in lengths of a step.
constexpr double least_axis = 0.1;        // Smallest semi-axis, in `unit`: it must not vanish during the descent.
constexpr double point_weight = 0.025;    // Weight of a point against the overshoot, at stiffness 1.
constexpr double tiny = 1e-12;            // Smallest denominator: keeps quotients finite.

struct Adam {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3d shape = Eigen::Matrix3d::Zero();
  double centre_square = 0.0;
  double shape_square = 0.0;
};

class Descent {
 public:
  Descent(const DistanceGrid& grid, const Eigen::Matrix3Xd& points, const CoverRefinement& settings,
          SolidEllipsoids& ellipsoids, Eigen::VectorXd& multipliers)
      : grid_(grid),
        points_(points),
        settings_(settings),
        ellipsoids_(ellipsoids),
        multipliers_(multipliers),
        num_(ellipsoids.size()),
        inverses_(num_),
        centre_gradients_(num_),
        shape_gradients_(num_),
        adam_(num_),
        squared_(num_),
        surely_(num_),
        keepers_(static_cast<std::size_t>(points.cols()), 0) {}

  void step(int number, const Eigen::Matrix3Xd& directions) {
    const double share = static_cast<double>(number) / settings_.steps;
    const double rate = settings_.first_rate * std::pow(settings_.last_rate / settings_.first_rate, share);
    for (std::size_t k = 0; k < num_; ++k) {
      inverses_[k] = ellipsoids_.shapes[k].inverse();
      centre_gradients_[k].setZero();
      shape_gradients_[k].setZero();
    }
    if (number % selection_steps == 0) {
      select(rate);
    }
    pull_in_points(number % settings_.multiplier_steps == settings_.multiplier_steps - 1);
    push_in_boundary(directions);
    descend(number, rate);
    limit_slimness();
  }

 private:
  /// Keeps the points that can be bare before the next selection, and those that push.
  void select(double rate) {
    for (std::size_t k = 0; k < num_; ++k) {
      const double shortest = Eigen::JacobiSVD<Eigen::Matrix3d>(ellipsoids_.shapes[k]).singularValues()[2];
      const double depth = (reach_in_rates * rate + 2.0 * settings_.margin) / std::max(shortest, tiny);
      const double radius = std::max(0.3, 1.0 - depth);
      surely_[k] = radius * radius;
    }
    selected_.clear();
    for (Eigen::Index i = 0; i < points_.cols(); ++i) {
      if (multipliers_[i] > 0.0 || !stays_covered(points_.col(i), keepers_[static_cast<std::size_t>(i)])) {
        selected_.push_back(i);
      }
    }
  }

  /// Whether a point is deep in an ellipsoid; tries the one that kept it last and tells the one that does now.
  bool stays_covered(const Eigen::Vector3d& y, std::size_t& keeper) const {
    const auto deep = [&](std::size_t k) { return (inverses_[k] * (y - ellipsoids_.centres[k])).squaredNorm() < surely_[k]; };
    if (deep(keeper)) {
      return true;
    }
    for (std::size_t k = 0; k < num_; ++k) {
      if (deep(k)) {
        keeper = k;
        return true;
      }
    }
    return false;
  }

  void pull_in_points(bool update_multipliers) {
    const double weight = 2.0 * point_weight / (settings_.unit * settings_.unit);
    for (const Eigen::Index i : selected_) {
      const Eigen::Vector3d y = points_.col(i);
      std::size_t owner = 0;
      for (std::size_t k = 0; k < num_; ++k) {
        squared_[k] = (inverses_[k] * (y - ellipsoids_.centres[k])).squaredNorm();
        if (squared_[k] < squared_[owner]) {
          owner = k;
        }
      }
      double gap = gap_to(owner, y);
      if (gap + settings_.margin <= 0.0 && multipliers_[i] <= 0.0) {
        continue;
      }
      for (std::size_t k = 0; k < num_; ++k) {
        const double other = gap_to(k, y);
        if (other < gap) {
          gap = other;
          owner = k;
        }
      }
      const double force = multipliers_[i] + settings_.stiffness * (gap + settings_.margin);
      if (update_multipliers) {
        multipliers_[i] = std::max(0.0, force);
      }
      if (force <= 0.0) {
        continue;
      }
      const Eigen::Vector3d arm = y - ellipsoids_.centres[owner];
      const Eigen::Vector3d z = inverses_[owner] * arm;
      const double squared = std::max(squared_[owner], tiny);
      const Eigen::Vector3d pull = inverses_[owner].transpose() * z * (weight * force * arm.norm() / squared);
      centre_gradients_[owner] -= pull;
      shape_gradients_[owner] -= pull * z.transpose();
    }
  }

  double gap_to(std::size_t k, const Eigen::Vector3d& y) const {
    return (y - ellipsoids_.centres[k]).norm() * (1.0 - 1.0 / std::sqrt(std::max(squared_[k], tiny)));
  }

  void push_in_boundary(const Eigen::Matrix3Xd& directions) {
    const double solid_angle = 4.0 * std::numbers::pi / static_cast<double>(directions.cols());
    for (std::size_t k = 0; k < num_; ++k) {
      const double determinant = std::abs(ellipsoids_.shapes[k].determinant());
      for (Eigen::Index j = 0; j < directions.cols(); ++j) {
        const Eigen::Vector3d u = directions.col(j);
        const Eigen::Vector3d y = ellipsoids_.centres[k] + ellipsoids_.shapes[k] * u;
        Eigen::Vector3d slope;
        const double outside = grid_(y, slope) / settings_.unit;
        if (outside <= 0.0 || in_another(k, y)) {
          continue;
        }
        const double area = solid_angle * determinant * (inverses_[k].transpose() * u).norm();
        const double squared = outside * outside;
        const double derivative = 1.0 + 2.0 * outside + 6.0 * squared * squared * outside;
        const Eigen::Vector3d push = slope * (area / settings_.area * derivative / settings_.unit);
        centre_gradients_[k] += push;
        shape_gradients_[k] += push * u.transpose();
      }
    }
  }

  bool in_another(std::size_t own, const Eigen::Vector3d& y) const {
    for (std::size_t k = 0; k < num_; ++k) {
      if (k != own && (inverses_[k] * (y - ellipsoids_.centres[k])).squaredNorm() <= 1.0) {
        return true;
      }
    }
    return false;
  }

  void descend(int number, double rate) {
    const double bias = 1.0 - std::pow(momentum, number + 1);
    const double second_bias = 1.0 - std::pow(second_momentum, number + 1);
    const auto blend = [](double factor, auto& old, const auto& now) { old = factor * old + (1.0 - factor) * now; };
    for (std::size_t k = 0; k < num_; ++k) {
      Adam& a = adam_[k];
      blend(momentum, a.centre, centre_gradients_[k]);
      blend(momentum, a.shape, shape_gradients_[k]);
      blend(second_momentum, a.centre_square, centre_gradients_[k].squaredNorm() / 3.0);
      blend(second_momentum, a.shape_square, shape_gradients_[k].squaredNorm() / 9.0);
      ellipsoids_.centres[k] -= a.centre * (rate / bias / (std::sqrt(a.centre_square / second_bias) + tiny));
      ellipsoids_.shapes[k] -= a.shape * (rate / bias / (std::sqrt(a.shape_square / second_bias) + tiny));
    }
  }

  void limit_slimness() {
    for (Eigen::Matrix3d& shape : ellipsoids_.shapes) {
      const Eigen::JacobiSVD<Eigen::Matrix3d> svd(shape, Eigen::ComputeFullU);
      const Eigen::Vector3d axes =
          svd.singularValues().cwiseMax(std::max(settings_.slimness * svd.singularValues()[0], least_axis * settings_.unit));
      shape = svd.matrixU() * axes.asDiagonal() * svd.matrixU().transpose();
    }
  }

  const DistanceGrid& grid_;
  const Eigen::Matrix3Xd& points_;
  const CoverRefinement& settings_;
  SolidEllipsoids& ellipsoids_;
  Eigen::VectorXd& multipliers_;
  std::size_t num_;
  std::vector<Eigen::Matrix3d> inverses_;
  std::vector<Eigen::Vector3d> centre_gradients_;
  std::vector<Eigen::Matrix3d> shape_gradients_;
  std::vector<Adam> adam_;
  std::vector<double> squared_;       // Squared radii of the current point in each ellipsoid.
  std::vector<double> surely_;        // Squared radii within which a point stays covered until the next selection.
  std::vector<std::size_t> keepers_;  // Ellipsoid that held the point at the last selection.
  std::vector<Eigen::Index> selected_;
};

}  // namespace

double DistanceGrid::operator()(const Eigen::Vector3d& point, Eigen::Vector3d& gradient) const noexcept {
  std::array<int, 3> cell;
  Eigen::Vector3d t;
  for (int axis = 0; axis < 3; ++axis) {
    const double position = (point[axis] - origin[axis]) / spacing;
    const double last = shape[static_cast<std::size_t>(axis)] - 2;
    const double node = std::clamp(std::floor(position), 0.0, last);
    cell[static_cast<std::size_t>(axis)] = static_cast<int>(node);
    t[axis] = std::clamp(position - node, 0.0, 1.0);
  }
  const std::size_t row = static_cast<std::size_t>(shape[2]);
  const std::size_t plane = static_cast<std::size_t>(shape[1]) * row;
  const double* v = values.data() + static_cast<std::size_t>(cell[0]) * plane + static_cast<std::size_t>(cell[1]) * row +
                    static_cast<std::size_t>(cell[2]);
  const auto mix = [](double a, double b, double s) { return a + s * (b - a); };
  const double x00 = mix(v[0], v[plane], t[0]), x01 = mix(v[1], v[plane + 1], t[0]);
  const double x10 = mix(v[row], v[plane + row], t[0]), x11 = mix(v[row + 1], v[plane + row + 1], t[0]);
  const double y0 = mix(x00, x10, t[1]), y1 = mix(x01, x11, t[1]);
  gradient[0] = mix(mix(v[plane] - v[0], v[plane + row] - v[row], t[1]),
                    mix(v[plane + 1] - v[1], v[plane + row + 1] - v[row + 1], t[1]), t[2]) /
                spacing;
  gradient[1] = mix(x10 - x00, x11 - x01, t[2]) / spacing;
  gradient[2] = (y1 - y0) / spacing;
  return mix(y0, y1, t[2]);
}

void refine_cover(const DistanceGrid& grid, const Eigen::Matrix3Xd& points, const std::vector<Eigen::Matrix3Xd>& directions,
                  const CoverRefinement& settings, SolidEllipsoids& ellipsoids, Eigen::VectorXd& multipliers,
                  const Interrupted& interrupted) {
  const auto refuse = [](const std::string& what) { throw std::invalid_argument("refine_cover: " + what); };
  const auto nodes = static_cast<std::size_t>(grid.shape[0]) * static_cast<std::size_t>(grid.shape[1]) *
                     static_cast<std::size_t>(grid.shape[2]);
  if (*std::min_element(grid.shape.begin(), grid.shape.end()) < 2 || grid.values.size() != nodes) {
    refuse("the grid needs at least 2 nodes along each axis and a value at each");
  }
  if (ellipsoids.centres.empty() || ellipsoids.shapes.size() != ellipsoids.centres.size()) {
    refuse("there are " + std::to_string(ellipsoids.centres.size()) + " centres and " +
           std::to_string(ellipsoids.shapes.size()) + " shapes; give as many of each, at least one");
  }
  if (multipliers.size() != points.cols()) {
    refuse("there are " + std::to_string(points.cols()) + " points and " + std::to_string(multipliers.size()) +
           " multipliers; the numbers must be equal");
  }
  if (directions.empty()) {
    refuse("there are no directions, at least one set is needed");
  }
  if (settings.steps < 1 || settings.multiplier_steps < 1) {
    refuse("steps and multiplier_steps must be at least 1");
  }
  Descent descent(grid, points, settings, ellipsoids, multipliers);
  for (int number = 0; number < settings.steps; ++number) {
    if (interrupted()) {
      throw Interruption();
    }
    descent.step(number, directions[static_cast<std::size_t>(number) % directions.size()]);
  }
}

}  // namespace sidestep

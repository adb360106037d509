#include "sidestep/obstacles/point_tree.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

namespace sidestep {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Spreads the lowest 21 bits of x three apart.
std::uint64_t spread_bits(std::uint64_t x) noexcept {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffff;
  x = (x | x << 16) & 0x1f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  x = (x | x << 2) & 0x1249249249249249;
  return x;
}

std::vector<int> morton_order(const Eigen::Matrix3Xd& points) {
  std::vector<int> order(static_cast<std::size_t>(points.cols()));
  std::iota(order.begin(), order.end(), 0);
  if (points.cols() <= PointTree::leaf_size) {
    return order;
  }
  const Eigen::Vector3d low = points.rowwise().minCoeff();
  const double extent = (points.rowwise().maxCoeff() - low).maxCoeff();
  const double scale = extent > 0.0 ? 0x1fffff / extent : 0.0;
  std::vector<std::uint64_t> keys(order.size());
  for (Eigen::Index n = 0; n < points.cols(); ++n) {
    const Eigen::Vector3d cell = scale * (points.col(n) - low);
    keys[static_cast<std::size_t>(n)] = spread_bits(static_cast<std::uint64_t>(cell.x())) |
                                        spread_bits(static_cast<std::uint64_t>(cell.y())) << 1 |
                                        spread_bits(static_cast<std::uint64_t>(cell.z())) << 2;
  }
  std::stable_sort(order.begin(), order.end(), [&keys](int a, int b) {
    return keys[static_cast<std::size_t>(a)] < keys[static_cast<std::size_t>(b)];
  });
  return order;
}

std::size_t groups(std::size_t count, int of) { return (count + static_cast<std::size_t>(of) - 1) / static_cast<std::size_t>(of); }

}  // namespace

PointTree::PointTree(const Eigen::Matrix3Xd& points, const Eigen::VectorXd& radii, const Eigen::Matrix3Xd& velocities)
    : order_(morton_order(points)), fastest_(velocities.size() == 0 ? 0.0 : velocities.colwise().norm().maxCoeff()) {
  if (order_.empty()) {
    return;
  }
  const std::size_t leaves = groups(order_.size(), leaf_size);
  for (int c = 0; c < 7; ++c) {
    columns_[static_cast<std::size_t>(c)].assign(leaves * leaf_size, c < 3 ? padding : 0.0);
    for (std::size_t n = 0; n < order_.size(); ++n) {
      columns_[static_cast<std::size_t>(c)][n] = c < 3    ? points(c, order_[n])
                                                 : c == 3 ? radii[order_[n]]
                                                          : velocities(c - 4, order_[n]);
    }
  }
  levels_.emplace_back(static_cast<int>(leaves));
  while (levels_.back().size > 1) {
    levels_.emplace_back(static_cast<int>(groups(static_cast<std::size_t>(levels_.back().size), fan_out)));
  }
  refit();
}

PointTree::Level::Level(int count) : size(count) {
  const std::size_t room = groups(static_cast<std::size_t>(count), fan_out) * fan_out + leaf_size - fan_out;
  for (std::vector<double>* centre : {&x, &y, &z}) {
    centre->assign(room, padding);
  }
  radius.assign(room, 0.0);
}

void PointTree::refit() noexcept {
  // A node's ball is around the middle of the box of the centres below it.
  const auto fit = [](int first, int count, auto&& member) {
    Eigen::Vector3d low = Eigen::Vector3d::Constant(infinity), high = -low;
    for (int i = first; i < first + count; ++i) {
      const Ball m = member(i);
      low = low.cwiseMin(Eigen::Vector3d(m.x, m.y, m.z));
      high = high.cwiseMax(Eigen::Vector3d(m.x, m.y, m.z));
    }
    const Eigen::Vector3d centre = 0.5 * (low + high);
    Ball ball{centre.x(), centre.y(), centre.z(), 0.0};
    for (int i = first; i < first + count; ++i) {
      const Ball m = member(i);
      ball.radius = std::max(ball.radius, (Eigen::Vector3d(m.x, m.y, m.z) - centre).norm() + m.radius);
    }
    return ball;
  };
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    const int per_node = level == 0 ? leaf_size : fan_out;
    const int members = level == 0 ? size() : levels_[level - 1].size;
    for (int node = 0; node < levels_[level].size; ++node) {
      const int first = node * per_node;
      const Ball ball = fit(first, std::min(per_node, members - first), [this, level](int i) {
        const auto n = static_cast<std::size_t>(i);
        return level == 0 ? Ball{columns_[0][n], columns_[1][n], columns_[2][n], columns_[3][n]}
                          : levels_[level - 1].ball(i);
      });
      const auto n = static_cast<std::size_t>(node);
      levels_[level].x[n] = ball.x;
      levels_[level].y[n] = ball.y;
      levels_[level].z[n] = ball.z;
      levels_[level].radius[n] = ball.radius;
    }
  }
}

void PointTree::advance(double duration) noexcept {
  if (!moves()) {
    return;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t n = 0; n < order_.size(); ++n) {
      columns_[axis][n] += duration * columns_[4 + axis][n];
    }
  }
  refit();
}

void PointTree::freeze() noexcept {
  fastest_ = 0.0;
  for (std::size_t axis = 4; axis < 7; ++axis) {
    std::fill(columns_[axis].begin(), columns_[axis].end(), 0.0);
  }
}

}  // namespace sidestep

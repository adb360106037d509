#include "sidestep/obstacles/point_tree.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "../settings.hpp"

namespace sidestep {
namespace {


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
  for (std::size_t axis = 0; axis < 3; ++axis) {
    centre[axis].assign(room, padding);
    half[axis].assign(room, 0.0);
  }
  largest.assign(room, 0.0);
  radius.assign(room, 0.0);
}

void PointTree::refit() noexcept {
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    for (int node = 0; node < levels_[level].size; ++node) {
      fit(level, node);
    }
  }
}

void PointTree::fit(std::size_t level, int node) noexcept {
  Level& at = levels_[level];
  const bool leaf = level == 0;
  const Level& below = levels_[leaf ? 0 : level - 1];
  const auto n = static_cast<std::size_t>(node);
  const std::size_t per_node = leaf ? leaf_size : fan_out;
  const std::size_t begin = n * per_node;
  const std::size_t end = std::min(begin + per_node, leaf ? order_.size() : static_cast<std::size_t>(below.size));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<double>& x = leaf ? columns_[axis] : below.centre[axis];
    double low = infinity, high = -infinity;
    for (std::size_t i = begin; i < end; ++i) {
      const double half = leaf ? 0.0 : below.half[axis][i];
      low = std::min(low, x[i] - half);
      high = std::max(high, x[i] + half);
    }
    at.centre[axis][n] = 0.5 * (low + high);
    at.half[axis][n] = 0.5 * (high - low);
  }
  at.radius[n] = at.largest[n] = 0.0;
  for (std::size_t i = begin; i < end; ++i) {
    const Ball member = leaf ? Ball{columns_[0][i], columns_[1][i], columns_[2][i], columns_[3][i]}
                             : below.ball(static_cast<int>(i));
    const Eigen::Vector3d away(member.x - at.centre[0][n], member.y - at.centre[1][n], member.z - at.centre[2][n]);
    at.radius[n] = std::max(at.radius[n], away.norm() + member.radius);
    at.largest[n] = std::max(at.largest[n], leaf ? member.radius : below.largest[i]);
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

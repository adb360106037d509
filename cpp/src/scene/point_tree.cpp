#include "sidestep/scene/point_tree.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "../math/settings.hpp"

namespace sidestep {
namespace {

struct Item {
  Eigen::Vector3d point;
  int index;
};

/// Points are halved across the axis along which they spread most until no more than this is left: those of one
/// register lie together. Where surfaces meet, halving by the variance leaves smaller boxes than halving the longest
/// side.
constexpr std::ptrdiff_t smallest_group = 4;
static_assert(PointTree::leaf_size % smallest_group == 0);

/// Where to cut `count` points in two: the first part fills whole leaves, whole nodes, whole nodes of nodes.
std::ptrdiff_t first_part(std::ptrdiff_t count) noexcept {
  std::ptrdiff_t part = smallest_group;
  while (2 * part < count) {
    part *= 2;
  }
  return part;
}

void cut(std::vector<Item>::iterator begin, std::vector<Item>::iterator end) {
  if (end - begin <= smallest_group) {
    return;
  }
  const Eigen::Vector3d origin = begin->point;  // near: squares cancel little
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), sum_of_squares = sum;
  for (auto item = begin; item != end; ++item) {
    const Eigen::Vector3d offset = item->point - origin;
    sum += offset;
    sum_of_squares += offset.cwiseAbs2();
  }
  // The first axis of those that are as good but for rounding, which depends on the order of points and on the machine.
  const Eigen::Vector3d spread = sum_of_squares - sum.cwiseAbs2() / static_cast<double>(end - begin);
  const double enough = (1.0 - 1e-9) * spread.maxCoeff();
  const Eigen::Index axis = spread[0] >= enough ? 0 : spread[1] >= enough ? 1 : 2;
  const auto middle = begin + first_part(end - begin);
  std::nth_element(begin, middle, end, [axis](const Item& a, const Item& b) {
    return a.point[axis] < b.point[axis] || (a.point[axis] == b.point[axis] && a.index < b.index);
  });
  cut(begin, middle);
  cut(middle, end);
}

/// Neighbours stand together, whatever the order of the input; the same on every machine.
std::vector<int> spatial_order(const Eigen::Matrix3Xd& points) {
  std::vector<int> order(static_cast<std::size_t>(points.cols()));
  std::iota(order.begin(), order.end(), 0);
  if (points.cols() <= PointTree::leaf_size) {
    return order;
  }
  std::vector<Item> items;
  items.reserve(order.size());
  for (const int n : order) {
    items.push_back({points.col(n), n});
  }
  cut(items.begin(), items.end());
  std::transform(items.begin(), items.end(), order.begin(), [](const Item& item) { return item.index; });
  const auto group = static_cast<std::size_t>(smallest_group);
  for (std::size_t n = 0; n < order.size(); n += group) {
    std::sort(order.begin() + static_cast<std::ptrdiff_t>(n),
              order.begin() + static_cast<std::ptrdiff_t>(std::min(n + group, order.size())));
  }
  return order;
}

std::size_t groups(std::size_t count, int of) {
  return (count + static_cast<std::size_t>(of) - 1) / static_cast<std::size_t>(of);
}

}  // namespace

PointTree::PointTree(const Eigen::Matrix3Xd& points, const Eigen::VectorXd& radii, const Eigen::Matrix3Xd& velocities)
    : PointTree(points, radii, velocities, spatial_order(points)) {
  in_usual_order_ = true;
}

PointTree::PointTree(const Eigen::Matrix3Xd& points, const Eigen::VectorXd& radii, const Eigen::Matrix3Xd& velocities,
                     std::vector<int> order)
    : fastest_(velocities.size() == 0 ? 0.0 : velocities.colwise().norm().maxCoeff()) {
  std::erase(order, -1);
  num_points_ = static_cast<int>(order.size());
  if (order.empty()) {
    return;
  }
  // What moves stands behind what rests, in nodes of its own: only these are moved and fitted again.
  const auto moving = std::stable_partition(order.begin(), order.end(), [&](int n) { return velocities.col(n).isZero(0.0); });
  const auto num_resting = static_cast<std::size_t>(moving - order.begin());
  std::size_t resting_leaves = groups(num_resting, leaf_size);
  if (num_resting > 0 && moving != order.end()) {
    resting_leaves = groups(resting_leaves, fan_out) * fan_out;
  }
  const std::size_t moving_leaves = groups(order.size() - num_resting, leaf_size), leaves = resting_leaves + moving_leaves;
  common_radius_ = (radii.array() == radii[0]).all() ? radii[0] : -1.0;
  order_.assign(leaves * leaf_size, -1);
  counts_.assign(leaves, 0);
  for (std::size_t c = 0; c < num_columns; ++c) {
    columns_[c].assign(leaves * leaf_size, c < 3 ? padding : 0.0);
  }
  for (std::size_t k = 0; k < order.size(); ++k) {
    const std::size_t n = k < num_resting ? k : k - num_resting + resting_leaves * leaf_size;
    order_[n] = order[k];
    ++counts_[n / leaf_size];
    for (std::size_t c = 0; c < num_columns; ++c) {
      const auto axis = static_cast<Eigen::Index>(c);
      columns_[c][n] = c < 3 ? points(axis, order[k]) : c == 3 ? radii[order[k]] : velocities(axis - 4, order[k]);
    }
  }
  parts_ = {{0, static_cast<int>(leaves), static_cast<int>(resting_leaves), fastest_}};
  build(leaves);
}

PointTree PointTree::moving(const Eigen::Matrix3Xd& points, const Eigen::VectorXd& radii,
                            const Eigen::Matrix3Xd& velocities) const {
  PointTree made(points, radii, velocities, order_);
  // Where all points rested, or all moved, they stand as their places alone have it.
  const bool by_place = std::all_of(parts_.begin(), parts_.end(), [](const Part& part) {
    return part.first_moving == part.first_leaf || part.first_moving == part.first_leaf + part.num_leaves;
  });
  made.in_usual_order_ = in_usual_order_ && by_place;
  return made;
}

PointTree PointTree::join(const std::vector<const PointTree*>& trees) {
  PointTree joined;
  int num_points = 0;
  for (const PointTree* const tree : trees) {
    const std::size_t begin = joined.counts_.size();
    for (std::size_t k = 0; k < tree->parts_.size(); ++k) {
      joined.parts_.push_back(tree->parts_[k]);
      joined.parts_.back().first_leaf += static_cast<int>(begin);
      joined.parts_.back().first_moving += static_cast<int>(begin);
    }
    if (tree->parts_.empty()) {
      joined.parts_.emplace_back(Part{static_cast<int>(begin), 0, static_cast<int>(begin)});
      continue;
    }
    const std::size_t leaves = groups(begin + tree->counts_.size(), fan_out) * fan_out;
    joined.counts_.insert(joined.counts_.end(), tree->counts_.begin(), tree->counts_.end());
    joined.counts_.resize(leaves, 0);
    joined.order_.reserve(leaves * leaf_size);
    for (const int n : tree->order_) {
      joined.order_.push_back(n < 0 ? n : n + num_points);
    }
    joined.order_.resize(leaves * leaf_size, -1);
    for (std::size_t c = 0; c < num_columns; ++c) {
      joined.columns_[c].insert(joined.columns_[c].end(), tree->columns_[c].begin(), tree->columns_[c].end());
      joined.columns_[c].resize(leaves * leaf_size, c < 3 ? padding : 0.0);
    }
    joined.common_radius_ = begin == 0 || joined.common_radius_ == tree->common_radius_ ? tree->common_radius_ : -1.0;
    num_points += tree->num_points_;
  }
  joined.num_points_ = num_points;
  if (!joined.counts_.empty()) {
    joined.build(joined.counts_.size());
  }
  joined.find_fastest();
  return joined;
}

void PointTree::build(std::size_t num_leaves) {
  levels_.emplace_back(static_cast<int>(num_leaves));
  while (levels_.back().size > 1) {
    levels_.emplace_back(static_cast<int>(groups(static_cast<std::size_t>(levels_.back().size), fan_out)));
  }
  refit(0, static_cast<int>(num_leaves));
}

PointTree::Level::Level(int count) : size(count) {
  const std::size_t padded = groups(static_cast<std::size_t>(count), fan_out) * fan_out + leaf_size - fan_out;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    centre[axis].assign(padded, padding);
    half[axis].assign(padded, 0.0);
  }
  largest.assign(padded, 0.0);
  radius.assign(padded, 0.0);
}

void PointTree::refit(int first, int end) noexcept {
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    for (int node = first; node < end; ++node) {
      fit(level, node);
    }
    first /= fan_out;
    end = (end + fan_out - 1) / fan_out;
  }
}

void PointTree::fit(std::size_t level, int node) noexcept {
  Level& at = levels_[level];
  const bool leaf = level == 0;
  const Level& below = levels_[leaf ? 0 : level - 1];
  const auto n = static_cast<std::size_t>(node);
  const std::size_t per_node = leaf ? leaf_size : fan_out;
  const std::size_t begin = n * per_node;
  const std::size_t end =
      leaf ? begin + static_cast<std::size_t>(counts_[n]) : std::min(begin + per_node, static_cast<std::size_t>(below.size));
  const auto is_empty = [&](std::size_t i) { return !leaf && below.centre[0][i] == padding; };
  at.radius[n] = at.largest[n] = 0.0;
  bool any = false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<double>& x = leaf ? columns_[axis] : below.centre[axis];
    double low = infinity, high = -infinity;
    for (std::size_t i = begin; i < end; ++i) {
      if (is_empty(i)) {
        continue;
      }
      const double half = leaf ? 0.0 : below.half[axis][i];
      low = std::min(low, x[i] - half);
      high = std::max(high, x[i] + half);
      any = true;
    }
    at.centre[axis][n] = any ? 0.5 * (low + high) : padding;
    at.half[axis][n] = any ? 0.5 * (high - low) : 0.0;
  }
  for (std::size_t i = begin; i < end; ++i) {
    if (is_empty(i)) {
      continue;
    }
    const Ball member =
        leaf ? Ball{columns_[0][i], columns_[1][i], columns_[2][i], columns_[3][i]} : below.ball(static_cast<int>(i));
    const Eigen::Vector3d away(member.x - at.centre[0][n], member.y - at.centre[1][n], member.z - at.centre[2][n]);
    at.radius[n] = std::max(at.radius[n], away.norm() + member.radius);
    at.largest[n] = std::max(at.largest[n], leaf ? member.radius : below.largest[i]);
  }
}

void PointTree::advance(std::size_t part, double duration) noexcept {
  const Part& moved = parts_[part];
  if (!(moved.fastest > 0.0)) {
    return;
  }
  in_usual_order_ = false;
  const int end = moved.first_leaf + moved.num_leaves;
  for (int leaf = moved.first_moving; leaf < end; ++leaf) {
    const std::size_t first = static_cast<std::size_t>(leaf) * leaf_size;
    for (std::size_t n = first; n < first + static_cast<std::size_t>(count(leaf)); ++n) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        columns_[axis][n] += duration * columns_[4 + axis][n];
      }
    }
  }
  refit(moved.first_moving, end);
}

void PointTree::freeze(std::size_t part) noexcept {
  Part& frozen = parts_[part];
  in_usual_order_ = in_usual_order_ && !(frozen.fastest > 0.0);
  frozen.fastest = 0.0;
  for (std::size_t c = 4; c < num_columns; ++c) {
    const auto begin = columns_[c].begin() + std::ptrdiff_t{frozen.first_leaf} * leaf_size;
    std::fill_n(begin, std::ptrdiff_t{frozen.num_leaves} * leaf_size, 0.0);
  }
  find_fastest();
}

void PointTree::hide(std::size_t part) noexcept {
  freeze(part);
  in_usual_order_ = false;
  const Part& hidden = parts_[part];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto begin = columns_[axis].begin() + std::ptrdiff_t{hidden.first_leaf} * leaf_size;
    std::fill_n(begin, std::ptrdiff_t{hidden.num_leaves} * leaf_size, padding);
  }
  std::fill_n(counts_.begin() + hidden.first_leaf, hidden.num_leaves, 0);
  refit(hidden.first_leaf, hidden.first_leaf + hidden.num_leaves);
}

void PointTree::find_fastest() noexcept {
  fastest_ = 0.0;
  for (const Part& part : parts_) {
    fastest_ = std::max(fastest_, part.fastest);
  }
}

}  // namespace sidestep

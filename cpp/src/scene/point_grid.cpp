#include "point_grid.hpp"

#include <algorithm>
#include <cmath>

namespace sidestep {
namespace {

constexpr int most_looked_at = 48;  // Points of one cell that a query looks at: many at one place say no more.

}  // namespace

PointGrid::PointGrid(const Eigen::Matrix3Xd& points) : points_(points) {
  const auto num = static_cast<std::size_t>(points.cols());
  table_.reset(num);
  std::vector<int> cell_of(num);
  std::vector<int> counts;
  for (std::size_t n = 0; n < num; ++n) {
    const Cell cell = cell_at(points.col(static_cast<Eigen::Index>(n)), edge);
    const int k = table_.add(cell);
    if (k == static_cast<int>(cells_.size())) {
      cells_.push_back(cell);
      counts.push_back(0);
    }
    cell_of[n] = k;
    ++counts[static_cast<std::size_t>(k)];
  }
  begins_.assign(cells_.size() + 1, 0);
  for (std::size_t k = 0; k < cells_.size(); ++k) {
    begins_[k + 1] = begins_[k] + counts[k];
  }
  order_.resize(num);
  std::vector<int> next(begins_.begin(), begins_.end() - 1);
  for (std::size_t n = 0; n < num; ++n) {
    order_[static_cast<std::size_t>(next[static_cast<std::size_t>(cell_of[n])]++)] = static_cast<int>(n);
  }
}

PointGrid::Nearest PointGrid::nearest(const Eigen::Vector3d& place) const noexcept {
  const Cell middle = cell_at(place, edge);
  double least = edge * edge;
  int found = -1;
  const auto look_in = [&](const Cell& cell) {
    const int k = table_.find(cell);
    if (k < 0) {
      return;
    }
    const auto inside = points_in(k);
    for (const int n : inside.first(std::min<std::size_t>(inside.size(), most_looked_at))) {
      const double squared = (points_.col(n) - place).squaredNorm();
      if (squared < least) {
        least = squared;
        found = n;
      }
    }
  };
  look_in(middle);
  std::array<std::array<double, 3>, 3> gaps;  // squared distance to the cells before, at and behind along an axis
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double low = place[static_cast<Eigen::Index>(axis)] - edge * middle[axis], high = edge - low;
    gaps[axis] = {low * low, 0.0, high * high};
  }
  for (int i = 0; i < 27; ++i) {
    const std::size_t x = static_cast<std::size_t>(i) / 9, y = static_cast<std::size_t>(i) / 3 % 3,
                      z = static_cast<std::size_t>(i) % 3;
    if (i != 13 && gaps[0][x] + gaps[1][y] + gaps[2][z] < least) {
      look_in({middle[0] + static_cast<int>(x) - 1, middle[1] + static_cast<int>(y) - 1, middle[2] + static_cast<int>(z) - 1});
    }
  }
  return {found, std::sqrt(least)};
}

std::vector<std::vector<int>> PointGrid::clusters(const std::vector<char>& left_out) const {
  std::vector<char> open(cells_.size(), 0);
  for (std::size_t k = 0; k < cells_.size(); ++k) {
    const auto inside = points_in(static_cast<int>(k));
    open[k] = std::any_of(inside.begin(), inside.end(), [&](int n) { return left_out[static_cast<std::size_t>(n)] == 0; });
  }
  std::vector<std::vector<int>> found;
  std::vector<int> waiting;
  for (std::size_t first = 0; first < cells_.size(); ++first) {
    if (open[first] == 0) {
      continue;
    }
    found.emplace_back();
    open[first] = 0;
    waiting.assign(1, static_cast<int>(first));
    while (!waiting.empty()) {
      const int k = waiting.back();
      waiting.pop_back();
      for (const int n : points_in(k)) {
        if (left_out[static_cast<std::size_t>(n)] == 0) {
          found.back().push_back(n);
        }
      }
      const Cell& at = cells_[static_cast<std::size_t>(k)];
      for (int i = 0; i < 27; ++i) {
        const int other = table_.find({at[0] + i / 9 - 1, at[1] + i / 3 % 3 - 1, at[2] + i % 3 - 1});
        if (other >= 0 && open[static_cast<std::size_t>(other)] != 0) {
          open[static_cast<std::size_t>(other)] = 0;
          waiting.push_back(other);
        }
      }
    }
  }
  return found;
}

}  // namespace sidestep

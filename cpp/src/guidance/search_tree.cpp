#include "sidestep/guidance/search_tree.hpp"

#include <limits>

namespace sidestep {

SearchTree::SearchTree(int num_coordinates, int capacity)
    : capacity_(capacity),
      nodes_(num_coordinates, capacity),
      coordinates_(capacity, num_coordinates),
      distances_(capacity),
      parents_(static_cast<std::size_t>(capacity)),
      domains_(static_cast<std::size_t>(capacity)) {}

int SearchTree::add(const Eigen::VectorXd& q, int parent) noexcept {
  nodes_.col(size_) = q;
  coordinates_.row(size_) = q.transpose().cast<float>();
  parents_[static_cast<std::size_t>(size_)] = parent;
  domains_[static_cast<std::size_t>(size_)] = std::numeric_limits<double>::infinity();
  return size_++;
}

int SearchTree::nearest(const Eigen::VectorXd& q) noexcept {
  auto squares = distances_.head(size_);
  squares = (coordinates_.col(0).head(size_) - static_cast<float>(q[0])).square();
  for (Eigen::Index i = 1; i < q.size(); ++i) {
    squares += (coordinates_.col(i).head(size_) - static_cast<float>(q[i])).square();
  }
  Eigen::Index nearest = 0;
  squares.minCoeff(&nearest);
  return static_cast<int>(nearest);
}

}  // namespace sidestep

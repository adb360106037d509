#include "sidestep/planning/search_tree.hpp"

#include <limits>

namespace sidestep {

SearchTree::SearchTree(const Eigen::VectorXd& weights, int capacity)
    : capacity_(capacity),
      weights_(weights),
      nodes_(weights.size(), capacity),
      coordinates_(capacity, weights.size()),
      distances_(capacity),
      parents_(static_cast<std::size_t>(capacity)),
      domains_(static_cast<std::size_t>(capacity)) {}

int SearchTree::add(const Eigen::VectorXd& q, int parent) noexcept {
  nodes_.col(size_) = q;
  coordinates_.row(size_) = q.cwiseProduct(weights_).transpose().cast<float>();
  parents_[static_cast<std::size_t>(size_)] = parent;
  domains_[static_cast<std::size_t>(size_)] = std::numeric_limits<double>::infinity();
  return size_++;
}

int SearchTree::nearest(const Eigen::VectorXd& q) noexcept {
  auto squares = distances_.head(size_);
  squares = (coordinates_.col(0).head(size_) - static_cast<float>(weights_[0] * q[0])).square();
  for (Eigen::Index i = 1; i < q.size(); ++i) {
    squares += (coordinates_.col(i).head(size_) - static_cast<float>(weights_[i] * q[i])).square();
  }
  Eigen::Index nearest = 0;
  squares.minCoeff(&nearest);
  return static_cast<int>(nearest);
}

}  // namespace sidestep

#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

namespace sidestep {

/// A tree of configurations. The nearest node is found by a scan, which for some thousands of nodes is as fast as an index.
/// Distances are weighted by joint: |Δq| = √Σ (w_i Δq_i)². Memory is allocated once.
class SearchTree {
 public:
  /// weights: (nv), not negative; 0 for a joint that moves nothing.
  SearchTree(const Eigen::VectorXd& weights, int capacity);

  void clear() noexcept { size_ = 0; }
  int size() const noexcept { return size_; }
  bool full() const noexcept { return size_ == capacity_; }

  /// Adds a node below `parent` (−1: the root) and returns its number. The tree must not be full.
  int add(const Eigen::VectorXd& q, int parent) noexcept;

  /// The node with the least |q − node|. The tree must not be empty.
  int nearest(const Eigen::VectorXd& q) noexcept;

  /// |q − node|, weighted.
  double distance(int k, const Eigen::VectorXd& q) const noexcept { return (q - nodes_.col(k)).cwiseProduct(weights_).norm(); }

  /// Largest distance of samples whose nearest node this is [rad | m]; infinite until `bound`.
  double domain(int k) const noexcept { return domains_[static_cast<std::size_t>(k)]; }
  bool bounded(int k) const noexcept { return std::isfinite(domain(k)); }
  void bound(int k, double distance) noexcept { domains_[static_cast<std::size_t>(k)] = distance; }

  auto node(int k) const noexcept { return nodes_.col(k); }
  int parent(int k) const noexcept { return parents_[static_cast<std::size_t>(k)]; }

 private:
  int size_ = 0, capacity_;
  Eigen::VectorXd weights_;
  Eigen::MatrixXd nodes_;  // Configurations (nv × capacity).
  // (capacity × nv), weighted: a run per coordinate, for the scan
  Eigen::Array<float, Eigen::Dynamic, Eigen::Dynamic> coordinates_;
  Eigen::ArrayXf distances_;
  std::vector<int> parents_;
  std::vector<double> domains_;
};

}  // namespace sidestep

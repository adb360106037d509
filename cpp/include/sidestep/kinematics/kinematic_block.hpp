#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "sidestep/kinematics/robot.hpp"

namespace sidestep {

/// States that are taken side by side: as many as the widest registers hold doubles.
inline constexpr int block_states = 8;

/// A number of each state of a block.
struct alignas(64) BlockRow {
  double of[block_states] = {};
};

/// What KinematicState computes, at `block_states` states side by side.
///
/// Mutable workspace, allocated once. Inner loops do for all states with one instruction what they do for one.
class KinematicBlock {
 public:
  explicit KinematicBlock(const Robot& robot);

  /// Computes everything at q and v, which have a row of states for each coordinate. No allocation.
  void update(const std::vector<BlockRow>& q, const std::vector<BlockRow>& v) noexcept;

  const std::vector<BlockRow>& q() const noexcept { return q_; }
  const std::vector<BlockRow>& v() const noexcept { return v_; }
  /// Of every joint: the index of its parent, -1 for the base, and which coordinate drives it.
  const std::vector<int>& parents() const noexcept { return parents_; }
  const std::vector<int>& coordinates() const noexcept { return coordinates_; }
  /// A row for each of KinematicState::Link::numbers, of one joint after the other.
  const double* links() const noexcept { return links_.front().of; }

 private:
  struct Joints;

  std::vector<BlockRow> q_, v_, links_;
  std::vector<int> parents_, coordinates_;
  std::shared_ptr<const Joints> joints_;
};

}  // namespace sidestep

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "sidestep/attractor/geometric_system.hpp"
#include "sidestep/math/triple_buffer.hpp"
#include "sidestep/scene/obstacles.hpp"

namespace sidestep {

/// Configurations near which activation distances shrink: narrow places of the path, and the target (nv × num).
struct Places {
  explicit Places(Eigen::Index nv);

  Eigen::MatrixXd q;
  Eigen::Index num = 0;
};

/// Activation distances of the barriers that shrink at places, as a worker found them for a target.
struct FoundActivations {
  std::uint64_t request_number = 0, posture_attempt = 0;
  Eigen::VectorXd values;
  bool target_blocked = false;  // the target itself is inside a barrier's clearance
};

/// Activation distances of the barriers: the usual ones among what moves, less at the places that the arm is led to.
class ActivationDistances {
 public:
  ActivationDistances(std::shared_ptr<const GeometricSystem> system, const std::vector<Eigen::Index>& clearances);

  /// Writes activation distances that shrink at places; whether the last of them is inside a barrier. For any thread with a
  /// workspace of its own.
  bool lower_at(const Places& places, const Obstacles& obstacles, GeometricSystem::Workspace& workspace,
                Eigen::VectorXd& activations) const noexcept;
  /// The same for `values`, in the thread of the step; nothing changes where places and obstacles are those of the last call. Writes
  /// whether the target is blocked.
  void update(const Places& places, const Obstacles& obstacles, bool& target_blocked) noexcept;
  /// Takes other values: the usual ones, or what a worker found.
  void take(const Eigen::VectorXd& values) noexcept {
    values_ = values;
    num_lowered_ = -1;
  }
  /// The next `update` looks anew.
  void forget() noexcept { num_lowered_ = -1; }
  const Eigen::VectorXd& values() const noexcept { return values_; }  // of each coordinate (m) [m | rad]

 private:
  std::shared_ptr<const GeometricSystem> system_;
  const std::vector<Eigen::Index>& clearances_;  // coordinates in metres
  GeometricSystem::Workspace workspace_;
  Eigen::VectorXd values_;
  Eigen::MatrixXd lowered_places_;
  Eigen::Index num_lowered_ = -1;
  std::uint64_t lowered_version_ = 0;  // Version of the obstacles.
};

}  // namespace sidestep

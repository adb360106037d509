#pragma once

#include <Eigen/Core>
#include <array>

#include "sidestep/clearance/clearance_query.hpp"
#include "sidestep/scene/obstacles.hpp"

namespace sidestep {

/// Table of configurations whose clearances are known, so that paths nearby need no new query.
///
/// At a place p every clearance is above its floor by a distance d. No point of the body moves farther than R·|q − p|, see
/// ClearanceQuery::reach, so at q it is above its floor by at least d − R·|q − p|.
///
/// One thread at a time; nothing here allocates after construction.
class CheckedPlaces {
 public:
  static constexpr int capacity = 512;          ///< Most places; a new one replaces the oldest.
  static constexpr int rechecks_per_step = 16;  ///< Most stale places that one step checks again.

  /// `body`, which stays. `spacing` [m]: motion for which a free place serves at least.
  CheckedPlaces(const ClearanceQuery& body, double spacing);

  /// Forgets all places, as when the floors change.
  void clear() noexcept { num_ = 0; }
  /// Marks all places as stale: the obstacles are others, or have moved.
  void invalidate() noexcept { stale_.fill(true); }
  /// Begins a step, which may check `rechecks_per_step` stale places again.
  void begin_step() noexcept { rechecks_left_ = rechecks_per_step; }

  /// Lower bound of the distance [m] by which the clearances at q (nv) are above `floors` (one per item of the body), by the
  /// places or else by a query, which becomes a place. Negative where one is below its floor.
  double distance_left_at(const Eigen::VectorXd& q, const Obstacles& obstacles, const Eigen::VectorXd& floors,
                          ClearanceQuery::Workspace& workspace) noexcept;

 private:
  /// Checks q, and writes it as place `at`; returns the distance left there.
  double check(ConstVectorRef q, int at, const Obstacles& obstacles, const Eigen::VectorXd& floors,
               ClearanceQuery::Workspace& workspace) noexcept;
  /// Lower bound of the distance left at q by place `at`; −∞ where it is too far away to serve.
  double distance_left_by(int at, const Eigen::VectorXd& q) const noexcept;

  const ClearanceQuery& body_;
  const double spacing_;           // Motion between two checks [m].
  Eigen::MatrixXd places_;         // Configurations (nv × capacity).
  Eigen::VectorXd distance_left_;  // Distances left there (capacity) [m].
  std::array<bool, capacity> stale_{};
  int num_ = 0;   // Places written, the newest over the oldest; above `capacity` the number counts on, to 2 * capacity.
  int last_ = 0;  // Place that served last.
  int rechecks_left_ = 0;
};

}  // namespace sidestep

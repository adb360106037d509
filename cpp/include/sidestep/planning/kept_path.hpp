#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>

#include "sidestep/clearance/clearance_query.hpp"
#include "sidestep/planning/path_rounding.hpp"
#include "sidestep/planning/timed_path.hpp"

namespace sidestep {

/// The path that a planner keeps to: its waypoints, the same with round corners, and as a motion.
class KeptPath {
 public:
  /// Rounds a path (nv × W) that keeps `margins`. What `motion` is of is still the path before.
  void replace(const Eigen::MatrixXd& waypoints, const Margins& margins, const ClearanceQuery& body, const Obstacles& obstacles,
               ClearanceQuery::Workspace& w);
  /// Gives it another motion, with a number of its own.
  void time(TimedPath motion);

  const Eigen::MatrixXd& waypoints() const noexcept { return waypoints_; }
  const Margins& margins() const noexcept { return margins_; }
  const RoundedPath& rounded() const noexcept { return *rounded_; }
  const std::shared_ptr<const TimedPath>& motion() const noexcept { return motion_; }
  std::uint64_t motion_number() const noexcept { return motion_number_; }

  /// Where it is after a length [rad | m].
  Eigen::VectorXd at(double station) const;
  /// The first waypoint beyond a length; not beyond the last.
  Eigen::Index waypoint_after(double station) const;
  /// Whether it is still free from a length on.
  bool is_free_from(double station, const ClearanceQuery& body, const Obstacles& obstacles, ClearanceQuery::Workspace& w) const;

 private:
  Eigen::MatrixXd waypoints_;
  Eigen::VectorXd stations_;  // Stations of the waypoints.
  Margins margins_;
  std::optional<RoundedPath> rounded_;
  std::shared_ptr<const TimedPath> motion_;
  std::uint64_t motion_number_ = 0;
};

}  // namespace sidestep

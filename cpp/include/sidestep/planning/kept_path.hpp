#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>

#include "sidestep/clearance/clearance_query.hpp"
#include "sidestep/planning/path_rounding.hpp"
#include "sidestep/planning/timed_path.hpp"

namespace sidestep {

/// Path of a planner: its waypoints, the same with round corners, and as a motion.
class KeptPath {
 public:
  /// Rounds a path (nv × W) that keeps `margins`. `motion` stays that of the previous path.
  void replace(const Eigen::MatrixXd& waypoints, const Margins& margins, const ClearanceQuery& body, const Obstacles& obstacles,
               ClearanceQuery::Workspace& w);
  /// Sets another motion, with a number of its own.
  void time(TimedPath motion);

  const Eigen::MatrixXd& waypoints() const noexcept { return waypoints_; }
  const Margins& margins() const noexcept { return margins_; }
  const RoundedPath& rounded() const noexcept { return *rounded_; }
  const std::shared_ptr<const TimedPath>& motion() const noexcept { return motion_; }
  std::uint64_t motion_number() const noexcept { return motion_number_; }

  /// Configuration at a station [rad | m].
  Eigen::VectorXd at(double station) const;
  /// First waypoint beyond a station; at most the last.
  Eigen::Index waypoint_after(double station) const;
  /// Whether the path is still free from a station on.
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

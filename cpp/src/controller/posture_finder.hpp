#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "sidestep/clearance/clearance_query.hpp"
#include "sidestep/controller/posture_search.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/planning/rrt_connect.hpp"

namespace sidestep {

/// Finds a posture for a pose goal that touches nothing. One thread at a time; allocates.
class PostureFinder {
 public:
  PostureFinder(const ClearanceQuery& body, const ControllerSettings& settings);

  /// The posture from `near` (nv), or from the goal's rest; `attempt` > 0: another one than before.
  Posture find(const PoseGoal& goal, const Eigen::VectorXd& near, const Obstacles& obstacles, std::uint64_t attempt);

 private:
  const ClearanceQuery& body_;
  const ControllerSettings& settings_;
  RrtConnect endpoint_checker_;  // says what is free at an end
  ClearanceQuery::Workspace workspace_;
};

}  // namespace sidestep

#include "sidestep/planning/kept_path.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace sidestep {

void KeptPath::replace(const Eigen::MatrixXd& waypoints, const Margins& margins, const ClearanceQuery& body,
                       const Obstacles& obstacles, ClearanceQuery::Workspace& w) {
  margins_ = margins;
  waypoints_ = waypoints;
  stations_ = Eigen::VectorXd::Zero(waypoints_.cols());
  for (Eigen::Index k = 1; k < waypoints_.cols(); ++k) {
    stations_[k] = stations_[k - 1] + (waypoints_.col(k) - waypoints_.col(k - 1)).norm();
  }
  rounded_.emplace(waypoints_, body, obstacles, margins_, w);
}

void KeptPath::time(TimedPath motion) {
  motion_ = std::make_shared<const TimedPath>(std::move(motion));
  ++motion_number_;
}

Eigen::VectorXd KeptPath::at(double station) const {
  RoundedPath::Point point;
  rounded_->at(station, point);
  return point.q;
}

Eigen::Index KeptPath::waypoint_after(double station) const {
  const auto next = std::upper_bound(stations_.begin(), stations_.end(), station) - stations_.begin();
  return std::min<Eigen::Index>(next, stations_.size() - 1);
}

bool KeptPath::is_free_from(double station, const ClearanceQuery& body, const Obstacles& obstacles,
                            ClearanceQuery::Workspace& w) const {
  // With what the path was made with. An obstacle that comes a little nearer bends the motion, it does not block the
  // path: half the margin is enough.
  Margins margins = margins_;
  margins.margin *= 0.5;
  margins.pair_margin *= 0.5;
  std::vector<Eigen::VectorXd> rest{at(station)};
  for (Eigen::Index next = waypoint_after(station); next < waypoints_.cols(); ++next) {
    rest.push_back(waypoints_.col(next));
  }
  return body.path_free(rest, obstacles, margins, w);
}

}  // namespace sidestep

#include "sidestep/planning/path_rounding.hpp"

#include <algorithm>
#include <cmath>

namespace sidestep {
namespace {

constexpr double shortest = 1e-9;  // Length of an edge that counts as none [rad].
// Largest deviation of any point of the arm from chords, and from a corner that is not free [m].
constexpr double deviation = 5e-4;
constexpr double straight = 1e-9;  // Change of direction that counts as none [rad].
constexpr int most_chords = 64;    // Most chords of a corner.
constexpr int pieces = 16;         // Fewest pieces of a rounding between stations.

}  // namespace

RoundedPath::RoundedPath(const Eigen::MatrixXd& path) {
  waypoints_.push_back(path.col(0));
  starts_.push_back(0.0);
  for (Eigen::Index k = 1; k < path.cols(); ++k) {
    const Eigen::VectorXd edge = path.col(k) - waypoints_.back();
    const double length = edge.norm();
    if (length < shortest) {
      continue;
    }
    directions_.push_back(edge / length);
    waypoints_.push_back(path.col(k));
    starts_.push_back(starts_.back() + length);
  }
  for (std::size_t k = 1; k + 1 < waypoints_.size(); ++k) {
    corners_.push_back({starts_[k], 0.0});
  }
}

RoundedPath::RoundedPath(const Eigen::MatrixXd& path, const ClearanceQuery& body, const Obstacles& obstacles,
                         const Margins& margins, ClearanceQuery::Workspace& workspace)
    : RoundedPath(path) {
  const double reach = std::max(1e-3, body.reach().maxCoeff());
  for (std::size_t k = 0; k < corners_.size(); ++k) {
    const double turn = (directions_[k + 1] - directions_[k]).norm();
    if (turn < straight) {
      continue;
    }
    const double before = (starts_[k + 1] - starts_[k]) * (k == 0 ? 1.0 : 0.5);
    const double after = (starts_[k + 2] - starts_[k + 1]) * (k + 1 == corners_.size() ? 1.0 : 0.5);
    const double widest = std::min(before, after), narrowest = std::min(widest, deviation / (0.1875 * turn * reach));
    for (corners_[k].half = widest; corners_[k].half > narrowest;
         corners_[k].half = std::max(narrowest, 0.5 * corners_[k].half)) {
      if (corner_is_free(k, body, obstacles, margins, workspace)) {
        break;
      }
    }
  }
}

bool RoundedPath::corner_is_free(std::size_t k, const ClearanceQuery& body, const Obstacles& obstacles, const Margins& margins,
                                 ClearanceQuery::Workspace& workspace) const {
  const double half = corners_[k].half, turn = (directions_[k + 1] - directions_[k]).norm();
  // A chord over Δs is left by at most Δs²/8 |q''|.
  const double reach = std::max(1e-3, body.reach().maxCoeff());
  const double sagitta = 0.5 * half * half * 0.75 * turn / half * reach;
  const int chords = std::clamp(static_cast<int>(std::ceil(std::sqrt(sagitta / deviation))), 2, most_chords);
  Point point;
  std::vector<Eigen::VectorXd> curve;
  for (int i = 0; i <= chords; ++i) {
    at(corners_[k].station + half * (2.0 * i / chords - 1.0), point);
    curve.push_back(point.q);
  }
  return body.path_free(curve, obstacles, margins, workspace);
}

void RoundedPath::at(double station, Point& point) const {
  if (directions_.empty()) {
    point.q = waypoints_.front();
    point.first = point.second = Eigen::VectorXd::Zero(point.q.size());
    return;
  }
  const double s = std::clamp(station, 0.0, length());
  const auto next = std::upper_bound(starts_.begin() + 1, starts_.end() - 1, s);
  const auto edge = static_cast<std::size_t>(next - starts_.begin()) - 1;
  const Eigen::VectorXd& u = directions_[edge];
  point.q = waypoints_[edge] + (s - starts_[edge]) * u;
  point.first = u;
  point.second = Eigen::VectorXd::Zero(u.size());
  for (const std::size_t k : {edge - 1, edge}) {  // the corners at both ends of the edge
    if (k >= corners_.size() || !(std::abs(s - corners_[k].station) < corners_[k].half)) {
      continue;
    }
    const double half = corners_[k].half, width = 2.0 * half, x = (s - corners_[k].station + half) / width;
    const Eigen::VectorXd turn = directions_[k + 1] - directions_[k];
    point.q =
        waypoints_[k + 1] - half * directions_[k] + x * width * directions_[k] + width * x * x * x * (1.0 - 0.5 * x) * turn;
    point.first = directions_[k] + x * x * (3.0 - 2.0 * x) * turn;
    point.second = 6.0 * x * (1.0 - x) / width * turn;
  }
}

Eigen::VectorXd RoundedPath::stations(double spacing) const {
  std::vector<double> all{0.0};
  const auto up_to = [&](double station, int least) {
    const double from = all.back(), way = station - from;
    if (way < shortest) {
      return;
    }
    const int count = std::max(least, static_cast<int>(std::ceil(way / spacing)));
    for (int i = 1; i <= count; ++i) {
      all.push_back(i == count ? station : from + way * i / count);
    }
  };
  for (const Corner& corner : corners_) {
    up_to(corner.station - corner.half, 1);
    up_to(corner.station + corner.half, corner.half > 0.0 ? pieces : 1);
  }
  up_to(length(), 1);
  return Eigen::Map<const Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size()));
}

}  // namespace sidestep

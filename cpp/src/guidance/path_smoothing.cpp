#include "sidestep/guidance/path_smoothing.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace sidestep {
namespace {

using Waypoints = std::vector<Eigen::VectorXd>;

/// From every waypoint on to the farthest that can be seen from it.
Waypoints skip(const Waypoints& path, const BodyClearance& body, const Obstacles& obstacles, const Margins& margins,
               BodyClearance::Workspace& w) {
  Waypoints kept{path.front()};
  for (std::size_t at = 0; at + 1 < path.size();) {
    std::size_t next = path.size() - 1;
    while (next > at + 1 && !body.edge_free(path[at], path[next], obstacles, margins, w)) {
      --next;
    }
    kept.push_back(path[next]);
    at = next;
  }
  return kept;
}

/// Lengths from the start to every waypoint.
std::vector<double> stations(const Waypoints& path) {
  std::vector<double> at{0.0};
  for (std::size_t i = 1; i < path.size(); ++i) {
    at.push_back(at.back() + (path[i] - path[i - 1]).norm());
  }
  return at;
}

constexpr double sample = 0.1;       // between clearances on an edge [rad]
constexpr double farthest = 0.3;     // that a waypoint is shifted at a time [rad]
constexpr int shifts = 8;            // tried for a waypoint

/// The least clearance on an edge, but for its ends, not above `cap`. At its ends a path may have to be near.
double least_clearance(const Eigen::VectorXd& a, const Eigen::VectorXd& b, const BodyClearance& body,
                       const Obstacles& obstacles, double cap, BodyClearance::Workspace& w) {
  const int pieces = 1 + static_cast<int>((b - a).norm() / sample);
  for (int i = 0; i < pieces; ++i) {
    cap = body.nearest(a + (i + 0.5) / pieces * (b - a), obstacles, cap, w).clearance;
  }
  return cap;
}

}  // namespace

Eigen::MatrixXd widen(const Eigen::MatrixXd& path, const BodyClearance& body, const Obstacles& obstacles,
                      const Margins& margins, double wide, RandomStream& random, BodyClearance::Workspace& workspace) {
  Eigen::MatrixXd way = path;
  const Eigen::VectorXd &low = body.robot().limits().lower, &high = body.robot().limits().upper;
  const auto clearance = [&](Eigen::Index k, const Eigen::VectorXd& q) {
    const double least = least_clearance(way.col(k - 1), q, body, obstacles, wide, workspace);
    return least_clearance(q, way.col(k + 1), body, obstacles, least, workspace);
  };
  for (Eigen::Index k = 1; k + 1 < way.cols(); ++k) {
    double best = clearance(k, way.col(k));
    for (int i = 0; i < shifts && best < wide; ++i) {
      Eigen::VectorXd q = way.col(k);
      for (Eigen::Index j = 0; j < q.size(); ++j) {
        q[j] = std::clamp(q[j] + random.uniform(-farthest, farthest), low[j], high[j]);
      }
      const double gained = clearance(k, q);
      if (gained > best && body.edge_free(way.col(k - 1), q, obstacles, margins, workspace) &&
          body.edge_free(q, way.col(k + 1), obstacles, margins, workspace)) {
        way.col(k) = q;
        best = gained;
      }
    }
  }
  return way;
}

Eigen::MatrixXd shorten(const Eigen::MatrixXd& path, const BodyClearance& body, const Obstacles& obstacles,
                        const Margins& margins, int attempts, RandomStream& random, BodyClearance::Workspace& workspace) {
  Waypoints way;
  for (Eigen::Index k = 0; k < path.cols(); ++k) {
    way.push_back(path.col(k));
  }
  way = skip(way, body, obstacles, margins, workspace);
  for (int attempt = 0; attempt < attempts && way.size() > 2; ++attempt) {
    const std::vector<double> at = stations(way);
    double from = random.uniform(0.0, at.back()), to = random.uniform(0.0, at.back());
    if (from > to) {
      std::swap(from, to);
    }
    // The edges that hold the two points.
    const auto edge = [&](double s) {
      const auto above = std::upper_bound(at.begin() + 1, at.end() - 1, s);
      return static_cast<std::size_t>(above - at.begin()) - 1;
    };
    const std::size_t i = edge(from), j = edge(to);
    if (i == j) {
      continue;
    }
    const auto on = [&](std::size_t k, double s) -> Eigen::VectorXd {
      const double length = at[k + 1] - at[k];
      return way[k] + (length > 0.0 ? (s - at[k]) / length : 0.0) * (way[k + 1] - way[k]);
    };
    const Eigen::VectorXd a = on(i, from), b = on(j, to);
    if (body.edge_free(a, b, obstacles, margins, workspace)) {
      Waypoints next(way.begin(), way.begin() + static_cast<std::ptrdiff_t>(i) + 1);
      next.push_back(a);
      next.push_back(b);
      next.insert(next.end(), way.begin() + static_cast<std::ptrdiff_t>(j) + 1, way.end());
      way = std::move(next);
    }
  }
  way = skip(way, body, obstacles, margins, workspace);
  Eigen::MatrixXd result(path.rows(), static_cast<Eigen::Index>(way.size()));
  for (std::size_t k = 0; k < way.size(); ++k) {
    result.col(static_cast<Eigen::Index>(k)) = way[k];
  }
  return result;
}

}  // namespace sidestep

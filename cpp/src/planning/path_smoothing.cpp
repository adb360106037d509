#include "sidestep/planning/path_smoothing.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace sidestep {
namespace {

using Waypoints = std::vector<Eigen::VectorXd>;

constexpr double slow_share = 0.5;  // Velocity limit below which a joint counts as slow, as a share of the median [-].

/// From every waypoint on to the farthest that can be seen from it.
Waypoints skip(const Waypoints& path, const ClearanceQuery& body, const Obstacles& obstacles, const Margins& margins,
               ClearanceQuery::Workspace& w) {
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

/// What a joint counts in a length: 1, or, of one slower than half the median, such as the lift of a torso, how much longer it takes.
Eigen::VectorXd slowness(const Robot& robot) {
  const Eigen::VectorXd& v = robot.limits().velocity;
  Eigen::VectorXd sorted = v;
  std::sort(sorted.begin(), sorted.end());
  const double median = sorted[sorted.size() / 2];
  return v.unaryExpr([&](double speed) { return std::isfinite(median) && speed < slow_share * median ? median / speed : 1.0; });
}

double length_of(const Eigen::VectorXd& a, const Eigen::VectorXd& b, const Eigen::VectorXd& slowness) {
  return (b - a).cwiseProduct(slowness).norm();
}

/// Lengths from the start to every waypoint.
std::vector<double> stations(const Waypoints& path, const Eigen::VectorXd& slowness) {
  std::vector<double> at{0.0};
  for (std::size_t i = 1; i < path.size(); ++i) {
    at.push_back(at.back() + length_of(path[i - 1], path[i], slowness));
  }
  return at;
}

constexpr double sample = 0.1;    // Distance between clearances on an edge [rad].
constexpr double shift = 0.3;     // Largest shift of a waypoint at a time [rad].
constexpr int shifts = 8;         // Shifts tried per waypoint.
constexpr double slowest = 0.25;  // Share of the speed that is left where there is no clearance [-].
constexpr int misses = 3;         // Attempts to shorten of which one may fail in a row.
constexpr double gain = 1e-3;     // Smallest reduction of length that is worth a check [rad].

/// How long it takes to pass an edge at speeds proportional to the clearance, 1 rad/s from `wide` on [s].
double duration(const Eigen::VectorXd& a, const Eigen::VectorXd& b, const Eigen::VectorXd& slowness, const ClearanceQuery& body,
                const Obstacles& obstacles, double wide, ClearanceQuery::Workspace& w) {
  const double length = length_of(a, b, slowness);
  const int pieces = 1 + static_cast<int>(length / sample);
  double sum = 0.0;
  for (int i = 0; i < pieces; ++i) {
    const double clearance = body.nearest(a + (i + 0.5) / pieces * (b - a), obstacles, wide, w).clearance;
    sum += 1.0 / std::clamp(clearance / wide, slowest, 1.0);
  }
  return sum * length / pieces;
}

/// A path whose stretch between two points of it is another.
class Stretch {
 public:
  Stretch(const Waypoints& way, const Eigen::VectorXd& slowness, RandomStream& random)
      : way_(way), at_(stations(way, slowness)) {
    from_ = random.uniform(0.0, at_.back());
    to_ = random.uniform(0.0, at_.back());
    if (from_ > to_) {
      std::swap(from_, to_);
    }
    first_ = edge(from_);
    last_ = edge(to_);
  }

  bool bends() const { return first_ < last_; }

  /// A straight edge.
  Waypoints straight() const { return {on(first_, from_), on(last_, to_)}; }

  /// As it is, but one joint at a constant rate.
  Waypoints evened(Eigen::Index joint) const {
    Waypoints between{on(first_, from_)};
    const double begin = between.front()[joint], end = on(last_, to_)[joint];
    for (std::size_t k = first_ + 1; k <= last_; ++k) {
      between.push_back(way_[k]);
      between.back()[joint] = begin + (at_[k] - from_) / (to_ - from_) * (end - begin);
    }
    between.push_back(on(last_, to_));
    return between;
  }

  /// [rad]
  double length() const { return to_ - from_; }

  Waypoints with(const Waypoints& between) const {
    const auto after = [&](std::size_t k) { return way_.begin() + static_cast<std::ptrdiff_t>(k) + 1; };
    Waypoints next(way_.begin(), after(first_));
    next.insert(next.end(), between.begin(), between.end());
    next.insert(next.end(), after(last_), way_.end());
    return next;
  }

 private:
  /// The edge that holds a point.
  std::size_t edge(double station) const {
    return static_cast<std::size_t>(std::upper_bound(at_.begin() + 1, at_.end() - 1, station) - at_.begin()) - 1;
  }
  Eigen::VectorXd on(std::size_t k, double station) const {
    const double length = at_[k + 1] - at_[k];
    return way_[k] + (length > 0.0 ? (station - at_[k]) / length : 0.0) * (way_[k + 1] - way_[k]);
  }

  const Waypoints& way_;
  std::vector<double> at_;
  double from_, to_;
  std::size_t first_, last_;
};

}  // namespace

Eigen::MatrixXd widen(const Eigen::MatrixXd& path, const ClearanceQuery& body, const Obstacles& obstacles,
                      const Margins& margins, double wide, RandomStream& random, ClearanceQuery::Workspace& workspace,
                      const Interrupted& interrupted) {
  Eigen::MatrixXd way = path;
  const Eigen::VectorXd &low = body.robot().limits().lower, &high = body.robot().limits().upper;
  const Eigen::VectorXd slow = slowness(body.robot());
  const auto around = [&](Eigen::Index k, const Eigen::VectorXd& q) {
    return duration(way.col(k - 1), q, slow, body, obstacles, wide, workspace) +
           duration(q, way.col(k + 1), slow, body, obstacles, wide, workspace);
  };
  for (Eigen::Index k = 1; k + 1 < way.cols() && !interrupted(); ++k) {
    double best = around(k, way.col(k));
    const double least = length_of(way.col(k - 1), way.col(k), slow) + length_of(way.col(k), way.col(k + 1), slow);
    for (int i = 0; i < shifts && best > least; ++i) {
      Eigen::VectorXd q = way.col(k);
      for (Eigen::Index j = 0; j < q.size(); ++j) {
        q[j] = std::clamp(q[j] + random.uniform(-shift, shift) / slow[j], low[j], high[j]);
      }
      const double found = around(k, q);
      if (found < best && body.edge_free(way.col(k - 1), q, obstacles, margins, workspace) &&
          body.edge_free(q, way.col(k + 1), obstacles, margins, workspace)) {
        way.col(k) = q;
        best = found;
      }
    }
  }
  return way;
}

Eigen::MatrixXd shorten(const Eigen::MatrixXd& path, const ClearanceQuery& body, const Obstacles& obstacles,
                        const Margins& margins, int attempts, RandomStream& random, ClearanceQuery::Workspace& workspace,
                        const Interrupted& interrupted) {
  Waypoints way;
  for (Eigen::Index k = 0; k < path.cols(); ++k) {
    way.push_back(path.col(k));
  }
  const Eigen::VectorXd slow = slowness(body.robot());
  way = skip(way, body, obstacles, margins, workspace);
  int missed = 0;
  for (int attempt = 0; attempt < attempts && missed < 1 + attempts / misses && way.size() > 2 && !interrupted(); ++attempt) {
    const Stretch stretch(way, slow, random);
    ++missed;
    if (!stretch.bends()) {
      continue;
    }
    const auto joint = static_cast<Eigen::Index>(random.uniform(0.0, static_cast<double>(path.rows())));
    for (const Waypoints& between : {stretch.straight(), stretch.evened(joint)}) {
      if (stations(between, slow).back() < stretch.length() - gain && body.path_free(between, obstacles, margins, workspace)) {
        way = stretch.with(between);
        missed = 0;
        break;
      }
    }
  }
  if (!interrupted()) {
    way = skip(way, body, obstacles, margins, workspace);
  }
  Eigen::MatrixXd result(path.rows(), static_cast<Eigen::Index>(way.size()));
  for (std::size_t k = 0; k < way.size(); ++k) {
    result.col(static_cast<Eigen::Index>(k)) = way[k];
  }
  return result;
}

}  // namespace sidestep

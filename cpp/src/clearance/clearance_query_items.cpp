// The clearance of one item at a configuration.
#include <algorithm>
#include <cmath>

#include "../math/settings.hpp"
#include "kernels/distance_kernel.hpp"
#include "sidestep/clearance/clearance_query.hpp"
#include "sidestep/clearance/ellipsoid_gap.hpp"

namespace sidestep {
namespace {

constexpr double closest_centres = 1e-6;  // Least distance of two centres whose direction is used [m].
constexpr int planes_of_pair = 3;         // Separating planes tried before the gap of two ellipsoids is computed.

static_assert(kernels::most_balls == PointTree::leaf_size);

kernels::PlacedEllipsoid placed(const Eigen::Vector3d& centre, const Eigen::Matrix3d& axes, const Eigen::Vector3d& squares,
                                double extent) noexcept {
  kernels::PlacedEllipsoid ellipsoid;
  ellipsoid.extent = extent;
  Eigen::Map<Eigen::Vector3d>(ellipsoid.centre) = centre;
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(ellipsoid.axes) = axes;
  Eigen::Map<Eigen::Vector3d>(ellipsoid.squares) = squares;
  return ellipsoid;
}

}  // namespace

ClearanceQuery::Found ClearanceQuery::measure(const ClearanceItem& item, const Obstacles& obstacles, const Asked& asked,
                                              Workspace& w) const noexcept {
  ++w.checks_;
  switch (item.source) {
    case ClearanceItem::Source::obstacles: break;
    case ClearanceItem::Source::pair: {
      const Asked gap_asked{asked.cap + item.contact, asked.near + item.contact, asked.stop + item.contact};
      const double gap = measure_pair(item, gap_asked, w);
      return {gap < gap_asked.cap ? gap - item.contact : asked.cap, -1};  // exactly the cap where nothing is nearer
    }
    case ClearanceItem::Source::table: {
      const PairDistanceTable& table = (*items_->tables())[item.index];
      const double clearance = table.at(w.placed_[table.axes[0].coordinate], w.placed_[table.axes[1].coordinate]).value;
      return {std::min(clearance, asked.cap), -1};
    }
    case ClearanceItem::Source::load: {
      const GravityTorqueLimit& gravity_torque = *items_->gravity_torque();
      return {std::min(gravity_torque.value(gravity_torque.loads()[static_cast<std::size_t>(item.index)], state(w)), asked.cap),
              -1};
    }
    case ClearanceItem::Source::plane: return {measure_plane(item, asked.cap, w), -1};
  }
  return measure_obstacles(item, obstacles, asked, w);
}

ClearanceQuery::Found ClearanceQuery::measure_obstacles(const ClearanceItem& item, const Obstacles& obstacles,
                                                        const Asked& asked, Workspace& w) const noexcept {
  const LinkEllipsoids& link = items_->links()[item.link];
  const Workspace::Pose& X = pose(w, link.joint);
  const auto bound = [&](const Eigen::Vector3d& place, double radius, double enough) {
    return w.field_.bound(place, enough + radius, obstacles) - radius;
  };
  Found found{asked.cap, -1};
  // From coarse to fine: the ball around the link, those around its ellipsoids, those that cover them, and themselves.
  const double around = bound(w.centres_[static_cast<std::size_t>(item.link)], link.radius, asked.cap);
  if (around >= std::min(asked.cap, asked.near)) {
    found.clearance = std::min(asked.cap, around);
    return found;
  }
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < link.ellipsoids.size(); ++i) {
    const LinkEllipsoid& e = link.ellipsoids[i];
    double least = bound(X.p + X.R * e.mean, e.extent, found.clearance);
    if (least < std::min(asked.near, found.clearance)) {
      double covered = infinity;
      for (const CoverBall& ball : e.cover) {
        covered = std::min(covered, bound(X.p + X.R * ball.centre, ball.radius, found.clearance));
        if (covered <= std::max(least, 0.0)) {
          break;  // they say no more
        }
      }
      if (covered > 0.0) {  // nothing is in them; of depths they say nothing
        least = std::max(least, covered);
      }
    }
    w.bounds_[i] = least;
    nearest = least < w.bounds_[nearest] ? i : nearest;
    if (least >= asked.near) {
      found.clearance = std::min(found.clearance, least);
    }
  }
  const PointTree& tree = obstacles.tree();
  const kernels::Distances distances = kernels::distances();
  // The one that seems nearest first: those whose bound is above its clearance need not be looked at.
  for (std::size_t k = 0; k < link.ellipsoids.size() && !(found.clearance < asked.stop); ++k) {
    const std::size_t i = k == 0 ? nearest : (k <= nearest ? k - 1 : k);
    if (!(w.bounds_[i] < std::min(asked.near, found.clearance))) {
      continue;
    }
    const LinkEllipsoid& e = link.ellipsoids[i];
    const kernels::PlacedEllipsoid ellipsoid = placed(X.p + X.R * e.mean, e.axes_T * X.R.transpose(), e.squares, e.extent);
    const auto measure = [&](const auto& nodes, int first, int count, double least, float* values) {
      return distances(ellipsoid, nodes, first, count, least, values);
    };
    const PointTree::Nearest at = tree.nearest(found.clearance, asked.stop, measure);
    if (at.point >= 0) {
      found = {at.distance, tree.order()[static_cast<std::size_t>(at.point)]};
    }
  }
  return found;
}

double ClearanceQuery::measure_pair(const ClearanceItem& item, const Asked& asked, const Workspace& w) const noexcept {
  const auto first = static_cast<std::size_t>(item.link), second = static_cast<std::size_t>(item.other);
  const LinkEllipsoids &a = items_->links()[item.link], &b = items_->links()[item.other];
  double least = asked.cap;
  const double far = a.radius + b.radius + asked.cap;
  const double squared = (w.centres_[second] - w.centres_[first]).squaredNorm();
  if (far <= 0.0 || squared >= far * far) {
    return least;
  }
  if (const double around = std::sqrt(squared) - a.radius - b.radius; around >= asked.near) {
    return around;
  }
  const Workspace::Pose &X = pose(w, a.joint), &Y = pose(w, b.joint);
  // In the frame of a's joint, where the centres of a stand still.
  const Eigen::Matrix3d R_XY = X.R.transpose() * Y.R;
  const Eigen::Vector3d p_XY = X.R.transpose() * (Y.p - X.p);
  for (const LinkEllipsoid& f : b.ellipsoids) {
    const Eigen::Vector3d centre = p_XY + R_XY * f.mean;
    const double reach = f.extent + a.radius + least;
    if (reach <= 0.0 || (centre - a.centre).squaredNorm() >= reach * reach) {
      continue;
    }
    for (const LinkEllipsoid& e : a.ellipsoids) {
      const Eigen::Vector3d d = centre - e.mean;
      const double cut = e.extent + f.extent + least;
      const double distance = d.squaredNorm();
      if (cut <= 0.0 || distance >= cut * cut) {
        continue;
      }
      const bool apart = distance > closest_centres * closest_centres;
      Eigen::Vector3d n = apart ? Eigen::Vector3d(d / std::sqrt(distance)) : Eigen::Vector3d::UnitX().eval();
      // A plane across n supports both; the next lies across what is between the places where it touches them.
      double bound = -infinity;
      for (int k = 0; k < planes_of_pair && bound < std::min(asked.near, least); ++k) {
        const Eigen::Vector3d on_a = e.shape * n, on_b = R_XY * (f.shape * (R_XY.transpose() * n));
        const double reach_a = std::sqrt(n.dot(on_a)), reach_b = std::sqrt(n.dot(on_b));
        bound = std::max(bound, n.dot(d) - reach_a - reach_b);
        n = (d - on_a / reach_a - on_b / reach_b).normalized();
      }
      if (bound < least) {
        const double gap = bound < asked.near ? ellipsoid_gap(d, e.shape, R_XY * f.shape * R_XY.transpose()).value : bound;
        least = std::min(least, gap);
        if (least < asked.stop) {
          return least;
        }
      }
    }
  }
  return least;
}

double ClearanceQuery::measure_plane(const ClearanceItem& item, double cap, const Workspace& w) const noexcept {
  const LinkEllipsoids& link = items_->links()[item.link];
  const PlaneClearances& plane = *items_->planes()[static_cast<std::size_t>(item.index)];
  const Workspace::Pose& X = pose(w, link.joint);
  double least = cap;
  if (plane.normal().dot(X.p + X.R * link.centre) - plane.offset() - link.radius >= cap) {
    return least;
  }
  const Eigen::Vector3d n = X.R.transpose() * plane.normal();
  for (const LinkEllipsoid& e : link.ellipsoids) {
    const double height = plane.normal().dot(X.p) + n.dot(e.mean) - plane.offset();
    least = std::min(least, height - std::sqrt(n.dot(e.shape * n)));
  }
  return least;
}

}  // namespace sidestep

#pragma once

#include <string>
#include <vector>

#include "sidestep/attractor/barrier.hpp"
#include "sidestep/body/body_ellipsoid.hpp"
#include "sidestep/clearance/boltzmann_mean.hpp"
#include "sidestep/clearance/ellipsoid_gap.hpp"
#include "sidestep/body/link_pair.hpp"

namespace sidestep {

/// One coordinate per pair of links that must not touch, a barrier of the clearance between their ellipsoids.
///
/// The clearance of two ellipsoids is the gap between them (see ellipsoid_gap.hpp), their distance, less the gap at
/// which the links touch (see link_pair.hpp). The pairs of ellipsoids of two links are reduced to one clearance by the
/// Boltzmann mean (see boltzmann_mean.hpp).
class SelfCollisionBarrier final : public Barrier {
 public:
  /// Clearances are measured up to `reach` [m], at least to the activation distance, as in ClearanceBarrier. Throws
  /// std::invalid_argument if there is no pair, a link is unknown or has no ellipsoid, the two are rigidly connected or
  /// `contact` is not finite; or names the setting at fault.
  SelfCollisionBarrier(const Robot& robot, const Body& body, const std::vector<LinkPair>& pairs, BarrierFunction barrier,
                       double temperature = 0.002, double reach = 0.0);

  void add_to(EmbeddingView out, const KinematicState& state, const Obstacles& obstacles) const noexcept override;
  CoordinateLabel label(int k) const override;

 private:
  void shorten_where_usually_near();
  struct Group {
    std::string link;
    int joint;
    std::vector<BodyEllipsoid> ellipsoids;
    std::vector<EllipsoidRow> rows;  // the same, side by side
    Eigen::Vector3d centre;          // of a ball around them
    double radius;
  };
  struct Pair {
    Group first, second;
    double contact;
  };

  double temperature_, reach_;
  std::vector<Pair> pairs_;
};

/// One coordinate per given link, a barrier of its clearance to a plane that must not be crossed (a floor, a table,
/// a wall): h = normal · (p − point) − s(normal) over the link's ellipsoids, which is exact.
class PlaneBarrier final : public Barrier {
 public:
  /// point (3) [m] on the plane and normal (3) pointing to the free side, in the world; `links` to keep off it, each
  /// moved by a joint. Throws std::invalid_argument that names what is wrong.
  PlaneBarrier(const Robot& robot, const Body& body, const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
               const std::vector<std::string>& links, BarrierFunction barrier, double temperature = 0.002, double reach = 0.0);

  void add_to(EmbeddingView out, const KinematicState& state, const Obstacles& obstacles) const noexcept override;
  CoordinateLabel label(int k) const override;

 private:
  Eigen::Vector3d normal_;
  double offset_;
  double temperature_, reach_;
  std::vector<std::vector<BodyEllipsoid>> links_;
  std::vector<std::string> names_;  // of the links
};

}  // namespace sidestep

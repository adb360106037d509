#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "sidestep/clearance/clearance_group.hpp"
#include "sidestep/clearance/link_ellipsoids.hpp"

namespace sidestep {

/// A plane that links must not cross: `normal` points to the free side, in the world.
struct KeptPlane {
  Eigen::Vector3d point;
  Eigen::Vector3d normal;
  std::vector<std::string> links;
};

/// Clearances of links from a plane (a floor, a table, a wall), one each: h = normal · (p − point) − s(normal) over the
/// link's ellipsoids, which is exact.
class PlaneClearances final : public ClearanceGroup {
 public:
  /// Throws std::invalid_argument, which `owner` begins, if point or normal is not finite, the normal is zero, there is no
  /// link, one is not moved by a joint, or the temperature [m] of the mean over ellipsoids is at fault.
  PlaneClearances(const Robot& robot, std::shared_ptr<const BodyLinks> links, const KeptPlane& plane, double temperature,
                  const char* owner);

  int size() const noexcept override { return static_cast<int>(kept_.size()); }
  CoordinateLabel label(int k) const override;
  void evaluate(const KinematicState& state, const Obstacles& obstacles, double reach, const Horizon& horizon,
                ClearanceView out) const noexcept override;

  const Eigen::Vector3d& normal() const noexcept { return normal_; }  ///< Unit normal.
  double offset() const noexcept { return offset_; }                  ///< Offset normal · point [m].
  int link(int k) const noexcept { return kept_[static_cast<std::size_t>(k)]; }

 private:
  double temperature_;
  std::shared_ptr<const BodyLinks> links_;
  Eigen::Vector3d normal_;
  double offset_;
  std::vector<int> kept_;  // Links that are kept off the plane.
};

}  // namespace sidestep

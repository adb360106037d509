#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "sidestep/math/vectors.hpp"

namespace sidestep {

/// How a joint moves its child. A continuous joint is a revolute one whose position limits are infinite.
enum class JointType { revolute, prismatic };

/// One moving joint of the tree. Fixed and locked joints do not appear: they are folded into placements.
///
/// The pose of the child in the parent joint's frame is `X_PJ * motion(axis, multiplier * q[coordinate] + offset)`,
/// where motion is a rotation by [rad] or a translation by [m].
struct Joint {
  std::string name;
  JointType type = JointType::revolute;
  int parent = -1;                                         ///< Index of the parent joint; -1 for the base.
  Eigen::Isometry3d X_PJ = Eigen::Isometry3d::Identity();  ///< Placement at zero motion, in the parent's frame.
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();         ///< Unit axis in the joint frame.
  int coordinate = 0;                                      ///< Entry of q that drives the joint.
  double multiplier = 1.0;                                 ///< Factor of a mimic joint [-].
  double offset = 0.0;                                     ///< Offset of a mimic joint [rad | m].
};

/// A named frame (a URDF link) rigidly attached to the child of a joint, or to the world when `joint` is -1.
struct Frame {
  std::string name;
  int joint = -1;
  Eigen::Isometry3d X_JF = Eigen::Isometry3d::Identity();
};

/// Per-coordinate limits: position [rad | m], velocity [/s], acceleration [/s^2], effort [Nm | N], jerk [/s^3] and the rate
/// of effort [Nm/s | N/s]. Position bounds may be infinite; the others are positive, possibly infinite.
/// Left empty, jerk is `default_jerk` times the acceleration limit, and the rate of effort infinite.
struct JointLimits {
  /// Jerk limit over acceleration limit where none is given [1/s]: the whole acceleration builds up in 10 ms. Descriptions
  /// state no jerk limits, and drives that state theirs allow more.
  static constexpr double default_jerk = 100.0;
  /// Distance outside the position limits at which a configuration still counts as inside [rad | m]: encoders and published
  /// values are rounded. The nearest one inside stands for it.
  static constexpr double rounding = 1e-3;

  Eigen::VectorXd lower, upper, velocity, acceleration, effort;
  Eigen::VectorXd jerk = {}, effort_rate = {};

  /// No limits at all, for `num` coordinates.
  static JointLimits unlimited(int num);

  /// The nearest configuration within the position limits.
  Eigen::VectorXd nearest_within(const Eigen::VectorXd& q) const { return q.cwiseMax(lower).cwiseMin(upper); }
};

/// The immutable kinematic model of an arm: joints in topological order, frames, coordinate names and limits.
class Robot {
 public:
  /// Throws std::invalid_argument that names the joint, frame or limit at fault.
  Robot(std::string name, std::vector<Joint> joints, std::vector<Frame> frames, std::vector<std::string> coordinate_names,
        JointLimits limits);

  const std::string& name() const noexcept { return name_; }
  int num_coordinates() const noexcept { return static_cast<int>(coordinate_names_.size()); }
  int num_joints() const noexcept { return static_cast<int>(joints_.size()); }
  const std::vector<Joint>& joints() const noexcept { return joints_; }
  const std::vector<Frame>& frames() const noexcept { return frames_; }
  const std::vector<std::string>& coordinate_names() const noexcept { return coordinate_names_; }
  const JointLimits& limits() const noexcept { return limits_; }

  /// Whether a coordinate is a length [m], that of a prismatic joint, and not an angle [rad].
  bool is_prismatic(int coordinate) const noexcept;

  /// Whether the other robot has the same joints in the same places, so that their states mean the same.
  bool same_joints(const Robot& other) const noexcept;
  /// The same number for robots with the same joints; another, but for one chance in 2^64, for others. Made once.
  std::uint64_t joints_hash() const noexcept { return joints_hash_; }

  /// Index of a frame; throws std::invalid_argument that lists the known names.
  int frame_index(const std::string& frame) const;

 private:
  std::string name_;
  std::vector<Joint> joints_;
  std::vector<Frame> frames_;
  std::vector<std::string> coordinate_names_;
  JointLimits limits_;
  std::uint64_t joints_hash_ = 0;
};

}  // namespace sidestep

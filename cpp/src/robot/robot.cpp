#include "sidestep/robot/robot.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace sidestep {
namespace {

// Deviation of an axis from unit length: rounding of a normalised double vector, with margin.
constexpr double unit_axis_tolerance = 1e-9;
constexpr double orthonormality_tolerance = 1e-9;  // Deviation of a rotation matrix built from angles: rounding, with margin.

void check_placement(const Eigen::Isometry3d& X, const std::string& owner) {
  const Eigen::Matrix3d R = X.linear();
  if (!X.matrix().allFinite() || !(R.transpose() * R).isApprox(Eigen::Matrix3d::Identity(), orthonormality_tolerance) ||
      R.determinant() < 0.0) {
    throw std::invalid_argument(owner + ": placement is not a rigid transform with finite entries");
  }
}

void check_limit(const Eigen::VectorXd& limit, const char* what, const std::vector<std::string>& names) {
  if (limit.size() != static_cast<Eigen::Index>(names.size())) {
    throw std::invalid_argument(std::string(what) + " limits: got " + std::to_string(limit.size()) +
                                " values, expected one per coordinate (" + std::to_string(names.size()) + ")");
  }
  for (Eigen::Index i = 0; i < limit.size(); ++i) {
    if (!(limit[i] > 0.0)) {
      throw std::invalid_argument(std::string(what) + " limit of '" + names[static_cast<std::size_t>(i)] + "' is " +
                                  std::to_string(limit[i]) + ", must be positive");
    }
  }
}

/// FNV-1a, of what Robot::same_joints compares.
class Hash {
 public:
  void add(const std::string& text) noexcept {
    for (const char c : text) {
      add_byte(static_cast<unsigned char>(c));
    }
    add_byte(0);
  }
  void add(double value) noexcept {
    const auto bits = std::bit_cast<std::uint64_t>(value + 0.0);  // of both zeros the same
    for (int shift = 0; shift < 64; shift += 8) {
      add_byte(static_cast<unsigned char>(bits >> shift));
    }
  }
  std::uint64_t value() const noexcept { return value_; }

 private:
  void add_byte(unsigned char byte) noexcept { value_ = (value_ ^ byte) * 0x100000001b3u; }
  std::uint64_t value_ = 0xcbf29ce484222325u;
};

std::uint64_t hash_of(const std::vector<Joint>& joints, const std::vector<std::string>& coordinate_names) {
  Hash hash;
  for (const std::string& name : coordinate_names) {
    hash.add(name);
  }
  for (const Joint& joint : joints) {
    hash.add(joint.name);
    for (const double number :
         {static_cast<double>(joint.type), static_cast<double>(joint.parent), static_cast<double>(joint.coordinate),
          joint.multiplier, joint.offset, joint.axis[0], joint.axis[1], joint.axis[2]}) {
      hash.add(number);
    }
    for (const double number : joint.X_PJ.matrix().reshaped()) {
      hash.add(number);
    }
  }
  return hash.value();
}

void check_joint(const Joint& joint, int i, int nv) {
  const std::string owner = "joint '" + joint.name + "'";
  if (joint.parent < -1 || joint.parent >= i) {
    throw std::invalid_argument(owner + ": parent index " + std::to_string(joint.parent) +
                                " must be -1 (base) or that of an earlier joint (joint index " + std::to_string(i) + ")");
  }
  if (joint.coordinate < 0 || joint.coordinate >= nv) {
    throw std::invalid_argument(owner + ": coordinate " + std::to_string(joint.coordinate) + " is outside 0.." +
                                std::to_string(nv - 1));
  }
  if (!(std::abs(joint.axis.norm() - 1.0) < unit_axis_tolerance)) {
    throw std::invalid_argument(owner + ": axis must have unit length");
  }
  if (!std::isfinite(joint.multiplier) || !std::isfinite(joint.offset)) {
    throw std::invalid_argument(owner + ": mimic multiplier and offset must be finite");
  }
  check_placement(joint.X_PJ, owner);
}

void check_frame(const Frame& frame, int num_joints) {
  if (frame.joint < -1 || frame.joint >= num_joints) {
    throw std::invalid_argument("frame '" + frame.name + "': joint index " + std::to_string(frame.joint) + " is outside -1.." +
                                std::to_string(num_joints - 1));
  }
  check_placement(frame.X_JF, "frame '" + frame.name + "'");
}

}  // namespace

JointLimits JointLimits::unlimited(int num) {
  const double infinity = std::numeric_limits<double>::infinity();
  const Eigen::VectorXd upper = Eigen::VectorXd::Constant(num, infinity);
  return {-upper, upper, upper, upper, upper, upper, upper};
}

Robot::Robot(std::string name, std::vector<Joint> joints, std::vector<Frame> frames, std::vector<std::string> coordinate_names,
             JointLimits limits)
    : name_(std::move(name)),
      joints_(std::move(joints)),
      frames_(std::move(frames)),
      coordinate_names_(std::move(coordinate_names)),
      limits_(std::move(limits)) {
  const int nv = num_coordinates();
  if (nv == 0) {
    throw std::invalid_argument("robot '" + name_ + "' has no movable joint");
  }
  std::vector<bool> driven(coordinate_names_.size(), false);
  for (int i = 0; i < num_joints(); ++i) {
    const Joint& joint = joints_[static_cast<std::size_t>(i)];
    check_joint(joint, i, nv);
    driven[static_cast<std::size_t>(joint.coordinate)] = true;
  }
  for (std::size_t i = 0; i < driven.size(); ++i) {
    if (!driven[i]) {
      throw std::invalid_argument("coordinate '" + coordinate_names_[i] + "' drives no joint");
    }
  }
  for (const Frame& frame : frames_) {
    check_frame(frame, num_joints());
  }
  check_limit(limits_.velocity, "velocity", coordinate_names_);
  check_limit(limits_.acceleration, "acceleration", coordinate_names_);
  check_limit(limits_.effort, "effort", coordinate_names_);
  if (limits_.jerk.size() == 0) {
    limits_.jerk = JointLimits::default_jerk * limits_.acceleration;
  }
  if (limits_.effort_rate.size() == 0) {
    limits_.effort_rate.setConstant(nv, std::numeric_limits<double>::infinity());
  }
  check_limit(limits_.jerk, "jerk", coordinate_names_);
  check_limit(limits_.effort_rate, "effort rate", coordinate_names_);
  if (limits_.lower.size() != nv || limits_.upper.size() != nv) {
    throw std::invalid_argument("position limits: expected one value per coordinate (" + std::to_string(nv) + ")");
  }
  for (int i = 0; i < nv; ++i) {
    if (!(limits_.lower[i] < limits_.upper[i])) {
      throw std::invalid_argument("position limits of '" + coordinate_names_[static_cast<std::size_t>(i)] + "': lower " +
                                  std::to_string(limits_.lower[i]) + " must be below upper " +
                                  std::to_string(limits_.upper[i]));
    }
  }
  joints_hash_ = hash_of(joints_, coordinate_names_);
}

bool Robot::is_prismatic(int coordinate) const noexcept {
  bool found = false, prismatic = false;
  for (const Joint& joint : joints_) {
    if (joint.coordinate != coordinate) {
      continue;
    }
    if (joint.name == coordinate_names_[static_cast<std::size_t>(coordinate)]) {
      return joint.type == JointType::prismatic;  // the others mimic it
    }
    prismatic = found ? prismatic : joint.type == JointType::prismatic;
    found = true;
  }
  return prismatic;
}

bool Robot::same_joints(const Robot& other) const noexcept {
  return coordinate_names_ == other.coordinate_names_ &&
         std::equal(joints_.begin(), joints_.end(), other.joints_.begin(), other.joints_.end(),
                    [](const Joint& a, const Joint& b) {
                      return a.name == b.name && a.type == b.type && a.parent == b.parent && a.axis == b.axis &&
                             a.coordinate == b.coordinate && a.multiplier == b.multiplier && a.offset == b.offset &&
                             a.X_PJ.matrix() == b.X_PJ.matrix();
                    });
}

int Robot::frame_index(const std::string& frame) const {
  std::string known;
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    if (frames_[i].name == frame) {
      return static_cast<int>(i);
    }
    known += (i == 0 ? "" : ", ") + frames_[i].name;
  }
  throw std::invalid_argument("robot '" + name_ + "' has no link '" + frame + "'; its links are: " + known);
}

}  // namespace sidestep

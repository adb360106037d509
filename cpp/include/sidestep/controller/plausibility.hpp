#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "sidestep/robot/robot.hpp"
#include "sidestep/scene/obstacles.hpp"
#include "sidestep/attractor/goal.hpp"

namespace sidestep {

/// What is hard to believe in what a controller was told last, with value and likely cause; empty: nothing.
struct Questions {
  std::string order;      ///< of the goal, velocity, twist or trajectory
  std::string obstacles;  ///< of the obstacles
  /// All that are not empty, the newest last.
  std::vector<std::string> all() const;
  bool order_is_newer = false;
};

/// Whether an angle [rad] is implausible in radians and plausible in degrees: more than one and a half turns, at most three in
/// degrees, and not a whole number of quarter turns, as limits of wrists are.
bool looks_like_degrees(double angle) noexcept;

/// Judges by size what an arm is told: millimetres for metres, degrees for radians. What limits and reach explain is not questioned.
///
/// Each question names the value, what the arm can do, and the likely unit.
class Plausibility {
 public:
  /// `reach` (nv) bounds how far a joint's turn moves any point of the arm [m per rad], 1 for a sliding joint.
  Plausibility(const Robot& robot, Eigen::VectorXd reach);

  /// A group (see Obstacles::groups) that is wholly farther than 20 times the reach, of which most points are farther than
  /// 100 times, a ball that the whole arm is deep inside of, or one faster than anything thrown.
  std::string question(const Obstacles& obstacles) const;
  /// An angle that looks like degrees, a velocity as below, or a position beyond five times the reach.
  std::string question(const Goal& goal) const;
  /// Faster than three times the limit of a joint.
  std::string question_velocity(const Eigen::VectorXd& v, const char* what = "velocity") const;
  /// Faster than any frame moves where all joints are at their velocity limits.
  std::string question_twist(const Vector6d& twist) const;
  /// An angle that looks like degrees, or a pace that only times in milliseconds explain. q (nv × K), times (K) [s].
  std::string question_trajectory(const Eigen::MatrixXd& q, const Eigen::VectorXd& times) const;

  /// What an error about a configuration outside of the limits adds: "; in degrees? Angles are in radians" where this explains all
  /// that is outside by far; else empty.
  static std::string hint(const Robot& robot, ConstVectorRef q);

  /// What is wrong with a measured state that no arm with these limits can be in.
  struct Impossible {
    int joint = -1;         ///< -1: nothing
    bool velocity = false;  ///< its velocity is, else its position
    double value = 0.0;
    int other = -1;  ///< joint whose position it could be, and the other way round; -1: none
  };
  /// A position beyond its limits by more than 1 rad or m, or a velocity over ten times its limit. No allocation.
  Impossible impossible(ConstVectorRef q, ConstVectorRef v) const noexcept;
  std::string describe(const Impossible& what) const;

 private:
  /// A joint whose position could be that of joint j, and that of j its own; -1: none.
  int exchanged(ConstVectorRef q, Eigen::Index j) const noexcept;
  struct Shoulder {
    Eigen::Vector3d at;
    double reach;
  };
  /// From the surface of a ball to the nearest shoulder [m]; negative inside.
  double distance(const Eigen::Vector3d& centre, double radius) const noexcept;
  const std::string& name(Eigen::Index j) const { return names_[static_cast<std::size_t>(j)]; }
  const char* unit(Eigen::Index j) const { return slides_[static_cast<std::size_t>(j)] ? " m" : " rad"; }

  std::vector<std::string> names_;
  std::vector<bool> slides_;
  JointLimits limits_;
  std::vector<Shoulder> shoulders_;  // of every joint on the base
  double reach_ = 0.0;               // the longest of theirs [m]; infinite: nothing is far
  double fastest_ = 0.0;             // of any point where all joints are at their limits [m/s]
  double fastest_turn_ = 0.0;        // the same of any link [rad/s]
};

}  // namespace sidestep

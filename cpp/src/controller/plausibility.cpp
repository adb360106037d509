// Millimetres for metres, degrees for radians: what sizes say about units.
#include "sidestep/controller/plausibility.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <utility>

#include "../math/settings.hpp"

namespace sidestep {
namespace {

constexpr double degree = std::numbers::pi / 180.0;  // One degree [rad].
constexpr double least_in_degrees =
    3.0 * std::numbers::pi;                 // Angle from which a joint may be given in degrees: few joints turn farther [rad].
constexpr double most_in_degrees = 1080.0;  // Largest angle that may be one in degrees: three turns [degrees].
constexpr double many_turns = 100.0;        // Angle up to which whole quarter turns count as radians [rad].
constexpr double written = 2e-3;            // Rounding of quarter turns that people write [rad].
constexpr double least_reach = 1.0;   // Least reach with which "far" is measured: a wrist alone still stands in a room [m].
constexpr double far_reaches = 20.0;  // Distance in reaches beyond which nothing belongs to the cell; 0.1 m in mm is 100 m [-].
constexpr double very_far_reaches =
    100.0;  // The same for most points of a cloud: some may stand for nothing seen, as zeros [-].
constexpr double fastest_obstacle =
    50.0;  // Largest speed of an obstacle: nothing thrown is faster; a hand at 0.1 m/s is 100 mm/s [m/s].
constexpr double unreachable = 5.0;  // Distance of a goal in reaches that is no near miss [-].
constexpr double overdriven = 3.0;   // Velocity asked for over its limit that a joystick does not exceed [-].
constexpr double slowest =
    1.0 / 2000.0;  // Pace of a trajectory as a share of the velocity limits that is too slow to be meant: glue takes 1/300 [-].
constexpr double beyond = 1.0;             // Distance beyond a position limit that no soft limit explains [rad | m].
constexpr double runaway = 10.0;           // Measured velocity over its limit that no noise explains [-].
constexpr Eigen::Index most_looks = 1000;  // Number of points of a cloud whose distances are counted.

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

/// The unit that brings a distance within twice the reach.
const char* length_unit(double distance, double reach) {
  return distance / 1000.0 <= 2.0 * reach ? "in millimetres?" : "in which unit?";
}

}  // namespace

std::vector<std::string> Questions::all() const {
  std::vector<std::string> found{order, obstacles};
  if (order_is_newer) {
    std::swap(found[0], found[1]);
  }
  std::erase(found, std::string());
  return found;
}

bool looks_like_degrees(double angle) noexcept {
  const double size = std::abs(angle);
  if (!(size > least_in_degrees + written && size <= most_in_degrees)) {
    return false;
  }
  const double quarter = 0.5 * std::numbers::pi;
  return size > many_turns || std::abs(size - quarter * std::round(size / quarter)) > written;
}

Plausibility::Plausibility(const Robot& robot, Eigen::VectorXd reach)
    : names_(robot.coordinate_names()), limits_(robot.limits()) {
  const auto nv = static_cast<std::size_t>(robot.num_coordinates());
  for (std::size_t j = 0; j < nv; ++j) {
    slides_.push_back(robot.is_prismatic(static_cast<int>(j)));
  }
  // Lengths between joints, added, from each joint on the base to the farthest joint or frame.
  std::vector<double> lengths;
  std::vector<std::size_t> roots;
  for (const Joint& joint : robot.joints()) {
    const auto parent = static_cast<std::size_t>(std::max(0, joint.parent));
    double length = joint.parent < 0 ? 0.0 : lengths[parent] + joint.X_PJ.translation().norm();
    if (joint.type == JointType::prismatic) {
      length += std::max(std::abs(joint.multiplier * limits_.lower[joint.coordinate] + joint.offset),
                         std::abs(joint.multiplier * limits_.upper[joint.coordinate] + joint.offset));
    }
    if (joint.parent < 0) {
      shoulders_.push_back({joint.X_PJ.translation(), 0.0});
    }
    roots.push_back(joint.parent < 0 ? shoulders_.size() - 1 : roots[parent]);
    lengths.push_back(length);
    double& longest = shoulders_[roots.back()].reach;
    longest = std::max(longest, length);
  }
  for (const Frame& frame : robot.frames()) {
    if (frame.joint >= 0) {
      const auto j = static_cast<std::size_t>(frame.joint);
      double& longest = shoulders_[roots[j]].reach;
      longest = std::max(longest, lengths[j] + frame.X_JF.translation().norm());
    }
  }
  for (const Shoulder& shoulder : shoulders_) {
    reach_ = std::max(reach_, shoulder.reach);
  }
  fastest_ = reach.dot(limits_.velocity);
  for (std::size_t j = 0; j < nv; ++j) {
    fastest_turn_ += slides_[j] ? 0.0 : limits_.velocity[static_cast<Eigen::Index>(j)];
  }
}

double Plausibility::distance(const Eigen::Vector3d& centre, double radius) const noexcept {
  double least = infinity;
  for (const Shoulder& shoulder : shoulders_) {
    least = std::min(least, (centre - shoulder.at).norm() - radius);
  }
  return least;
}

std::string Plausibility::question(const Obstacles& obstacles) const {
  const double reach = std::max(reach_, least_reach);
  if (!std::isfinite(reach)) {
    return {};
  }
  const std::string than = " from the arm, which reaches " + number(reach_) + " m; ";
  const bool some_large = obstacles.size() > 0 && obstacles.radii().maxCoeff() > far_reaches * reach;
  const bool moves = obstacles.tree().moves();
  Eigen::Index begin = 0;
  for (const auto& [name, count] : obstacles.groups()) {
    const Eigen::Index end = begin + count;
    const std::string who = "obstacles: " + (name.empty() ? std::string("a point") : "'" + name + "'");
    const auto away = [&](Eigen::Index i) { return distance(obstacles.points().col(i), obstacles.radii()[i]); };
    Eigen::Index looked = 0, found = 0;
    for (Eigen::Index i = begin; i < end; i += std::max<Eigen::Index>(1, count / most_looks)) {
      if (!obstacles.points().col(i).isZero(0.0)) {
        ++looked;
        found += away(i) > very_far_reaches * reach;
      }
    }
    if (count > 1 && 2 * found > looked) {
      return "obstacles: most points" + (name.empty() ? std::string() : " of '" + name + "'") + " are more than " +
             number(very_far_reaches * reach) + " m" + than + "in millimetres? Obstacles are in metres";
    }
    double least = infinity;
    for (Eigen::Index i = begin; i < end && (some_large || moves || least > far_reaches * reach); ++i) {
      const double gap = away(i);
      if (obstacles.radii()[i] > far_reaches * reach && gap < -reach) {
        return who + " is a ball of radius " + number(obstacles.radii()[i]) + " m that the whole arm is inside of; " +
               length_unit(obstacles.radii()[i], reach) + " Obstacles are in metres";
      }
      const double speed = moves ? obstacles.velocities().col(i).norm() : 0.0;
      if (speed > fastest_obstacle) {
        return who + " moves at " + number(speed) + " m/s; in mm/s? Velocities are in m/s";
      }
      least = std::min(least, gap);
    }
    if (count > 0 && least > far_reaches * reach) {
      return who + " is " + number(least) + " m" + than + length_unit(least, reach) + " Obstacles are in metres";
    }
    begin = end;
  }
  return {};
}

std::string Plausibility::question(const Goal& goal) const {
  if (const auto* joints = std::get_if<JointGoal>(&goal)) {
    for (Eigen::Index j = 0; j < joints->position.size(); ++j) {
      if (!slides_[static_cast<std::size_t>(j)] && looks_like_degrees(joints->position[j])) {
        return "goal: joint '" + name(j) + "' is " + number(joints->position[j]) + " rad; in degrees? Angles are in radians";
      }
    }
    return question_velocity(joints->velocity, "goal: velocity");
  }
  const auto of_pose = [&](const PoseGoal& pose) -> std::string {
    const double away = (pose.pose.translation() - pose.shoulder()).norm(), reach = std::max(pose.reach(), 0.5 * least_reach);
    if (!(away > unreachable * reach)) {
      return {};
    }
    return "goal: the pose of frame '" + pose.frame().name + "' is " + number(away) +
           " m from the arm's shoulder, and it reaches at most " + number(pose.reach()) + " m; " + length_unit(away, reach) +
           " Positions are in metres";
  };
  const auto& pose = std::get<PoseGoal>(goal);
  std::string found = of_pose(pose);
  for (const PoseGoal& other : pose.others) {
    found = found.empty() ? of_pose(other) : found;
  }
  return found;
}

std::string Plausibility::question_velocity(const Eigen::VectorXd& v, const char* what) const {
  for (Eigen::Index j = 0; j < v.size(); ++j) {
    const double limit = limits_.velocity[j];
    if (!(std::abs(v[j]) > overdriven * limit)) {
      continue;
    }
    const bool slides = slides_[static_cast<std::size_t>(j)];
    const bool fits = std::abs(v[j]) * (slides ? 1e-3 : degree) <= limit;
    const char* const guess = !fits ? "in which unit?" : slides ? "in mm/s?" : "in degrees per second?";
    return std::string(what) + " of joint '" + name(j) + "' is " + number(v[j]) + unit(j) + "/s, its limit is " +
           number(limit) + unit(j) + "/s; " + guess;
  }
  return {};
}

std::string Plausibility::question_twist(const Vector6d& twist) const {
  const double speed = twist.head<3>().norm(), turn = twist.tail<3>().norm();
  if (speed > fastest_) {
    return "twist: its speed is " + number(speed) + " m/s, no point of the arm is faster than " + number(fastest_) + " m/s; " +
           (1e-3 * speed <= fastest_ ? "in mm/s?" : "in which unit?");
  }
  if (turn > fastest_turn_) {
    return "twist: it turns by " + number(turn) + " rad/s, no link of the arm is faster than " + number(fastest_turn_) +
           " rad/s; " + (degree * turn <= fastest_turn_ ? "in degrees per second?" : "in which unit?");
  }
  return {};
}

std::string Plausibility::question_trajectory(const Eigen::MatrixXd& q, const Eigen::VectorXd& times) const {
  double pace = 0.0;  // largest, as a share of the velocity limits
  for (Eigen::Index k = 0; k < q.cols(); ++k) {
    for (Eigen::Index j = 0; j < q.rows(); ++j) {
      if (!slides_[static_cast<std::size_t>(j)] && looks_like_degrees(q(j, k))) {
        return "trajectory: joint '" + name(j) + "' of sample " + std::to_string(k) + " is " + number(q(j, k)) +
               " rad; in degrees? Angles are in radians";
      }
      if (k > 0) {
        pace = std::max(pace, std::abs(q(j, k) - q(j, k - 1)) / ((times[k] - times[k - 1]) * limits_.velocity[j]));
      }
    }
  }
  if (pace > 0.0 && pace < slowest) {
    return "trajectory: it takes " + number(times[times.size() - 1]) + " s and uses at most " + number(pace) +
           " of the velocity limits; times in milliseconds? They are in seconds";
  }
  return {};
}

std::string Plausibility::hint(const Robot& robot, ConstVectorRef q) {
  const JointLimits& limits = robot.limits();
  bool turned = false, slid = false;
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    if (q[j] >= limits.lower[j] - beyond && q[j] <= limits.upper[j] + beyond) {
      continue;
    }
    const bool slides = robot.is_prismatic(static_cast<int>(j));
    const double meant = q[j] * (slides ? 1e-3 : degree);
    if (!(meant >= limits.lower[j] - JointLimits::rounding && meant <= limits.upper[j] + JointLimits::rounding)) {
      return {};
    }
    slid = slid || slides;
    turned = turned || (!slides && looks_like_degrees(q[j]));
  }
  return std::string(turned ? "; in degrees? Angles are in radians" : "") +
         (slid ? "; in millimetres? Lengths are in metres" : "");
}

Plausibility::Impossible Plausibility::impossible(ConstVectorRef q, ConstVectorRef v) const noexcept {
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    if (q[j] < limits_.lower[j] - beyond || q[j] > limits_.upper[j] + beyond) {
      return {static_cast<int>(j), false, q[j], exchanged(q, j)};
    }
  }
  for (Eigen::Index j = 0; j < v.size(); ++j) {
    if (std::abs(v[j]) > runaway * limits_.velocity[j]) {
      return {static_cast<int>(j), true, v[j]};
    }
  }
  return {};
}

int Plausibility::exchanged(ConstVectorRef q, Eigen::Index j) const noexcept {
  const auto fits = [&](double value, Eigen::Index k) { return value >= limits_.lower[k] && value <= limits_.upper[k]; };
  for (Eigen::Index k = 0; k < q.size(); ++k) {
    if (fits(q[j], k) && fits(q[k], j)) {
      return static_cast<int>(k);
    }
  }
  return -1;
}

std::string Plausibility::describe(const Impossible& what) const {
  const Eigen::Index j = what.joint;
  const bool slides = slides_[static_cast<std::size_t>(j)];
  const double meant = what.value * (slides ? 1e-3 : degree);
  const char* const guess = slides ? "; in millimetres?" : "; in degrees?";
  if (what.velocity) {
    return "joint '" + name(j) + "' is measured at " + number(what.value) + unit(j) + "/s, its limit is " +
           number(limits_.velocity[j]) + unit(j) + "/s" + (std::abs(meant) <= limits_.velocity[j] ? guess : "");
  }
  const bool fits = meant >= limits_.lower[j] - JointLimits::rounding && meant <= limits_.upper[j] + JointLimits::rounding;
  return "joint '" + name(j) + "' is measured at " + number(what.value) + unit(j) + ", its limits are " +
         number(limits_.lower[j]) + " and " + number(limits_.upper[j]) + unit(j) +
         (fits              ? guess
          : what.other >= 0 ? "; are the joints in another order? It could be that of '" + name(what.other) + "'"
                            : "");
}

}  // namespace sidestep

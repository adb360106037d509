#include "sidestep/attractor/diagnosis.hpp"

#include <cmath>
#include <cstdio>
#include <numbers>

#include "sidestep/attractor/geometric_system.hpp"

namespace sidestep {
namespace {

constexpr double few = 10.0;  // mm or degrees below which a tenth is worth saying

std::string number(const char* format, double value) {
  char text[48];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string distance(double clearance) {
  return clearance < 0.0 ? number("%.0f mm deep", -1000.0 * clearance) : number("%.0f mm away", 1000.0 * clearance);
}

/// A way of a joint: in mm if it is prismatic, else in rad by this format.
std::string way(double value, const char* radians, bool prismatic) {
  return prismatic ? number("%.1f mm", 1000.0 * value) : number(radians, value);
}

/// For example "link fr3_link5" and "obstacle point 2, 31 mm away".
struct Parties {
  std::string who, what;
};

Parties parties(const Diagnosis& d, const CoordinateLabel& label, const Obstacles& obstacles) {
  const std::string away = std::isfinite(d.clearance) ? ", " + distance(d.clearance) : "";
  switch (label.kind) {
    case CoordinateLabel::Kind::obstacle: return {"link " + label.name, obstacles.words_for(d.point) + away};
    case CoordinateLabel::Kind::self: return {"link " + label.name, "link " + label.other + away};
    case CoordinateLabel::Kind::plane: return {"link " + label.name, "the plane" + away};
    case CoordinateLabel::Kind::joint_limit:
      return {"joint " + label.name,
              "its " + label.other + " limit" +
                  (std::isfinite(d.clearance) ? ", " + way(std::abs(d.clearance), "%.3f rad", label.prismatic) +
                                                    (d.clearance < 0.0 ? " beyond it" : " away")
                                              : "")};
    case CoordinateLabel::Kind::effort: return {"joint " + label.name, "its effort limit (gravity torque)"};
    case CoordinateLabel::Kind::potential: break;
  }
  return {"the arm", "an obstacle or a limit (a density does not tell which)"};
}

}  // namespace

const char* name(MotionState state) noexcept {
  switch (state) {
    case MotionState::free: return "free";
    case MotionState::sliding: return "sliding";
    case MotionState::arriving: return "arriving";
    case MotionState::stuck: return "stuck";
    case MotionState::blocked_at_goal: return "blocked_at_goal";
    case MotionState::inside_barrier: return "inside_barrier";
    case MotionState::fallback: break;
  }
  return "fallback";
}

std::string Diagnosis::way_left() const {
  if (!std::isnan(joint_error)) {
    return way(joint_error, "%.2f rad", prismatic);
  }
  const auto in_digits = [](double value) { return number(value < few ? "%.1f" : "%.0f", value); };
  const std::string position = in_digits(1000.0 * position_error) + " mm";
  return std::isnan(rotation_error) ? position
                                    : position + " and " + in_digits(rotation_error * 180.0 / std::numbers::pi) + "°";
}

bool Diagnosis::is_near() const noexcept {
  const auto within = [](double error, double limit) { return std::isnan(error) || error < limit; };
  return within(joint_error, judgement::arrived_joint) && within(position_error, judgement::arrived_position) &&
         within(rotation_error, judgement::arrived_rotation);
}

std::string Diagnosis::describe(const CoordinateLabel& label, const Obstacles& obstacles) const {
  const Parties p = parties(*this, label, obstacles);
  const bool known = coordinate >= 0;
  switch (state) {
    case MotionState::free: return "on the way, " + way_left() + " from the goal";
    case MotionState::sliding: return p.who + " slides along " + p.what;
    case MotionState::arriving: return "arriving, " + way_left() + " from the goal";
    case MotionState::stuck:
      return "stuck " + way_left() +
             " from the goal: " + (known ? p.who + " against " + p.what : "nothing is in the way, so the pose is out of reach");
    case MotionState::blocked_at_goal:
      return "stopped " + way_left() + " from the goal, which is itself blocked: " + p.who + " against " + p.what;
    case MotionState::inside_barrier: return p.who + " is inside the barrier of " + p.what + ", and moves out";
    case MotionState::fallback: break;
  }
  return "braking to a stop: the input of the step is unusable (see its status)";
}

Diagnosis GeometricSystem::diagnose(const Workspace& w) const noexcept {
  Diagnosis d;
  d.speed = w.state_.v().norm();
  const bool has_goal = w.status_ != StepStatus::invalid_goal && w.status_ != StepStatus::goal_outside_limits;
  if (is_fallback(w.status_) || !has_goal) {
    return d;
  }
  d.joint_error = w.goal.joint_error;
  const int farthest = w.goal.farthest_coordinate();
  d.prismatic = farthest >= 0 && robot_.is_prismatic(farthest);
  d.position_error = w.goal.position_error;
  d.rotation_error = w.goal.rotation_error;

  // b_k·b with b = ∂U − G⁻¹ ∂U and w.attraction = −G⁻¹ ∂U; G_S in place of G if the attraction is one-sided.
  const double desired = w.goal.gradient.norm();
  const double passed = w.attraction.norm();
  const double held_back = (w.goal.gradient + w.attraction).squaredNorm();
  d.blocked = desired > 0.0 ? 1.0 - passed / desired : 0.0;
  double largest = 0.0;
  for (Eigen::Index k = 0; k < w.values.size(); ++k) {
    if (w.values[k] == 0.0) {
      continue;
    }
    const auto J = w.jacobian_transposed.col(k);
    if (settings_.pull_form == PullForm::one_sided && J.dot(w.attraction) <= 0.0) {
      continue;  // it holds nothing back
    }
    const double part = -J.dot(w.attraction) * (J.dot(w.goal.gradient) + J.dot(w.attraction));
    if (part > largest) {
      largest = part;
      d.coordinate = static_cast<int>(k);
    }
  }
  d.share = held_back > 0.0 ? largest / held_back : 0.0;

  if (w.inside >= 0) {
    d.state = MotionState::inside_barrier;
    d.coordinate = w.inside;
    d.share = 0.0;
  } else if (d.is_near()) {
    d.state = MotionState::arriving;
  } else if (d.speed < judgement::slow && (d.blocked > 1.0 - judgement::held || desired < judgement::vanished)) {
    d.state = MotionState::stuck;
  } else {
    d.state = d.blocked > judgement::noticed ? MotionState::sliding : MotionState::free;
  }
  if (d.state == MotionState::free || (d.state != MotionState::inside_barrier && !(d.blocked > judgement::noticed))) {
    d.coordinate = -1;
    d.share = 0.0;
  }
  if (d.coordinate >= 0) {
    d.point = labels_[static_cast<std::size_t>(d.coordinate)].kind == CoordinateLabel::Kind::obstacle
                  ? w.clearances.nearest[d.coordinate]
                  : -1;
    d.clearance = w.clearances.values[d.coordinate];
  }
  return d;
}

Diagnosis GeometricSystem::diagnose(ConstVectorRef q, ConstVectorRef v, const Goal& goal, const Obstacles& obstacles,
                                    Workspace& w) const noexcept {
  static_cast<void>(acceleration(q, v, goal, obstacles, w));
  const Diagnosis here = diagnose(w);
  const auto* joint = std::get_if<JointGoal>(&goal);
  if (joint == nullptr || here.state != MotionState::stuck) {
    return here;
  }
  static_cast<void>(acceleration(joint->position, w.rest_, goal, obstacles, w));
  if (w.inside < 0) {
    return here;
  }
  Diagnosis there = diagnose(w);  // names what blocks the goal, while errors and speed stay those of the arm
  there.state = MotionState::blocked_at_goal;
  there.blocked = here.blocked;
  there.speed = here.speed;
  there.joint_error = here.joint_error;
  there.prismatic = here.prismatic;
  return there;
}

}  // namespace sidestep

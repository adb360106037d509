// What a controller does, in words.
#include <cmath>
#include <cstdio>
#include <numbers>

#include "../settings.hpp"
#include "impl.hpp"

namespace sidestep {
namespace {

std::string millimetres(double metres) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0f mm", 1e3 * std::abs(metres));
  return text;
}

std::string parties(const CoordinateLabel& label, const std::string& obstacle) {
  switch (label.kind) {
    case CoordinateLabel::Kind::obstacle: return "link '" + label.name + "' and " + obstacle;
    case CoordinateLabel::Kind::self: return "links '" + label.name + "' and '" + label.other + "'";
    case CoordinateLabel::Kind::plane: return "link '" + label.name + "' and a plane";
    case CoordinateLabel::Kind::joint_limit: return "joint '" + label.name + "' and its " + label.other + " limit";
    case CoordinateLabel::Kind::potential: break;
  }
  return "a potential";
}

}  // namespace

Eigen::VectorXd Controller::Impl::target() const { return has_target_ ? Eigen::VectorXd(target_ - turns_) : Eigen::VectorXd(); }

std::string Controller::Impl::explain_target() const {
  if (!has_target_ || moves_) {
    return {};
  }
  PlannerSettings exact;
  exact.allowance = exact.pair_allowance = 0.0;
  exact.max_nodes = 2;  // it searches for nothing
  std::shared_ptr<const Obstacles> shown;
  bool touches_itself;
  {
    const std::lock_guard lock(mutex_);
    shown = shown_obstacles_;
    touches_itself = shown_posture_ && shown_posture_->touches_itself;
  }
  Obstacles around = *shown;
  around.advance(obstacle_age_);
  Obstruction obstruction;
  RrtConnect ends(body_, exact);
  if (touches_itself &&
      ends.obstructed(target_, Obstacles::none(), obstruction)) {  // no obstacle that goes away frees the goal
    return "no posture without self-collision was found for the pose: at the last one " + describe(obstruction) +
           "; others are looked for";
  }
  if (!ends.obstructed(target_, around, obstruction)) {
    if (guide_status_ != OnlinePlannerStatus::goal_in_collision) {
      return {};
    }
    obstruction = guide->last_plan().obstruction;
  }
  const bool own = obstruction.label.kind == CoordinateLabel::Kind::self;
  return "at the goal " + describe(obstruction) +
         (!own          ? "; it goes on when that is free"
          : pose_goal() ? "; another posture is looked for"
                        : ", as far as the covering body says; set another goal, or allow the two to touch");
}

std::string Controller::Impl::explain_input() const {
  std::string words = trajectory_order() ? "follows a trajectory" : "moves at the velocity that it is told";
  if (command.bound_by >= 0) {
    const CoordinateLabel& label = system->labels()[static_cast<std::size_t>(command.bound_by)];
    words += ", bent by the clearance of " +
             parties(label, command.bound_by == command.coordinate ? obstacles().words_for(command.point) : "an obstacle");
  }
  return words;
}

std::string Controller::Impl::explain() const {
  std::string text;
  if (command.status == SafetyStatus::stopping) {
    text = command.program == TorqueStatus::fallback_solver
               ? "braking to a stop: the program was not solved"
               : std::string("braking to a stop: the ") +
                     (solution.fault == TorqueFault::none ? "state" : name(solution.fault)) +
                     " of this step is unusable; check its size and that it is finite";
    return text;
  }
  const auto diagnosis = system->diagnose(workspace);
  if (command.status == SafetyStatus::clearance_lost && command.coordinate >= 0) {
    const CoordinateLabel& label = system->labels()[static_cast<std::size_t>(command.coordinate)];
    text = parties(label, obstacles().words_for(command.point)) + " overlap by " + millimetres(command.clearance) +
           ", as far as the covering body says; ";
    if (label.kind == CoordinateLabel::Kind::obstacle) {
      text += "if points lie on the arm itself, filter the arm out of the cloud; ";
    }
  }
  {
    const std::lock_guard lock(mutex_);
    if (shown_fault_[0] != '\0') {
      text += std::string("background work failed: ") + shown_fault_.data() + "; ";
    }
  }
  text += explain_speed();
  const std::string trajectory = explain_trajectory();
  if (!trajectory.empty() && command.activity != Activity::stale) {
    if (command.activity == Activity::waiting) {
      return text + "waiting: " + trajectory;
    }
    text += trajectory + "; ";
  }
  switch (command.activity) {
    case Activity::no_goal: return text + "no goal: it holds still, and evades what comes";
    case Activity::stale:
      return text + "stopped: the obstacles are " + std::to_string(obstacle_age_) +
             " s old, more than obstacle_timeout; set_obstacles must be called more often";
    case Activity::waiting: return text + "waiting for a posture that reaches the pose";
    case Activity::arrived: return text + "arrived";
    case Activity::blocked:
    case Activity::moving: break;
  }
  if (command.system == StepStatus::invalid_goal || command.system == StepStatus::goal_outside_limits) {
    return text + "the goal has left the position limits: it is not followed; set a new goal";
  }
  if (has_target_ && !posture_found_) {
    const std::lock_guard lock(mutex_);
    if (shown_posture_) {
      char angle[32];
      std::snprintf(angle, sizeof angle, "%.0f", shown_posture_->rotation_error * 180.0 / std::numbers::pi);
      text += "the goal is out of reach: nearest posture " + millimetres(shown_posture_->position_error) + " and " + angle +
              "° away; ";
    }
  }
  if (guide_status_ == OnlinePlannerStatus::start_in_collision) {
    return text + "where the arm is, " + describe(guide->last_plan().obstruction) + "; it goes on when that is free";
  }
  const std::string at_target = explain_target();
  if (guide_status_ == OnlinePlannerStatus::goal_in_collision || stops_short()) {
    return text + at_target;
  }
  if (!at_target.empty()) {
    text += at_target + "; ";
  }
  if (guide_status_ == OnlinePlannerStatus::no_path) {
    text += "no path was found yet; it is looked for again; ";
  }
  if (avoiding_) {
    return text + "steps out of the way of what moves";
  }
  if (has_sub_goal()) {
    text += "leaves a local minimum by a sub-goal; ";
  }
  if (has_input()) {
    return text + explain_input();
  }
  if (command.on_path) {
    text += "follows a path; ";
  }
  const CoordinateLabel label =
      diagnosis.coordinate < 0 ? CoordinateLabel{} : system->labels()[static_cast<std::size_t>(diagnosis.coordinate)];
  return text + diagnosis.describe(label, obstacles());
}

}  // namespace sidestep

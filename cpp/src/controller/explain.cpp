// What a controller does, in words.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include "../math/settings.hpp"
#include "impl.hpp"

namespace sidestep {
namespace {

std::string millimetres(double metres) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0f mm", 1e3 * std::abs(metres));
  return text;
}

/// For example "0.62 s old, more than inputs.timeout (0.5 s)".
std::string age(double seconds, const char* setting, double timeout) {
  char old[32], most[32];
  std::snprintf(old, sizeof old, "%.3g", seconds);
  std::snprintf(most, sizeof most, "%g s", timeout);
  return old + std::string(" s old, more than ") + setting + " (" + most + ")";
}

}  // namespace

std::string parties(const CoordinateLabel& label, const std::string& obstacle) {
  switch (label.kind) {
    case CoordinateLabel::Kind::obstacle: return "link '" + label.name + "' and " + obstacle;
    case CoordinateLabel::Kind::self: return "links '" + label.name + "' and '" + label.other + "'";
    case CoordinateLabel::Kind::plane: return "link '" + label.name + "' and a plane";
    case CoordinateLabel::Kind::joint_limit: return "joint '" + label.name + "' and its " + label.other + " limit";
    case CoordinateLabel::Kind::effort: return "joint '" + label.name + "' and its effort limit, by what it holds of the arm";
    case CoordinateLabel::Kind::potential: break;
  }
  return "a potential";
}

Eigen::VectorXd Controller::Impl::target() const { return has_target_ ? Eigen::VectorXd(target_ - turns_) : Eigen::VectorXd(); }

namespace {

/// Says what ellipsoids touch, and searches for nothing.
PlannerSettings of_ends() {
  PlannerSettings exact;
  exact.allowance = exact.pair_allowance = 0.0;
  exact.max_nodes = 2;
  return exact;
}

}  // namespace

std::optional<Obstruction> Controller::Impl::goal_obstruction() const {
  Order order;
  std::shared_ptr<const Obstacles> shown;
  std::optional<Posture> posture;
  {
    const std::lock_guard lock(mutex_);
    order = shown_order_;
    shown = shown_obstacles_;
    posture = shown_posture_;
  }
  const Goal* const goal = std::get_if<Goal>(&order);
  if (goal == nullptr) {
    return std::nullopt;
  }
  const JointGoal* const joints = std::get_if<JointGoal>(goal);
  if (joints == nullptr && !(posture && posture->found())) {
    return std::nullopt;
  }
  Obstruction found;
  const bool touches =
      RrtConnect(body_, of_ends()).obstructed(joints != nullptr ? joints->position : posture->q, *shown, found);
  return touches ? std::optional(found) : std::nullopt;
}

std::string Controller::Impl::explain_target() const {
  if (!has_target_ || moves_) {
    return {};
  }
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
  RrtConnect ends(body_, of_ends());
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
  if (obstruction.label.kind == CoordinateLabel::Kind::effort) {
    return "at the goal " + describe(obstruction) + (pose_goal() ? "; another posture is looked for" : "; set another goal");
  }
  const bool own = obstruction.label.kind == CoordinateLabel::Kind::self;
  const bool finer = finer_covers_may_free(obstruction);
  return "at the goal " + describe(obstruction) +
         (!own          ? std::string("; it goes on when that is free") + (finer ? ", or with a finer cover of the link" : "")
          : pose_goal() ? "; another posture is looked for"
                        : std::string(", as far as the covering body says; set another goal, or allow the two to touch") +
                              (finer ? ", or cover them more finely" : ""));
}

std::string Controller::Impl::way_out(const Obstruction& here) const {
  const Robot& robot = arm.robot();
  if (here.label.kind == CoordinateLabel::Kind::obstacle) {
    const int joint = robot.frames()[static_cast<std::size_t>(robot.frame_index(here.label.name))].joint;
    if (joint < 0 || robot.joints()[static_cast<std::size_t>(joint)].parent < 0) {
      return joint < 0 ? "; no joint moves that link: take the obstacle away, or out of set_obstacles"
                       : "; no joint but '" + robot.joints()[static_cast<std::size_t>(joint)].name +
                             "' moves that link: if it does not get out so, take the obstacle away, or out of set_obstacles";
    }
  }
  return "; it goes on when that is free";
}

bool Controller::Impl::finer_covers_may_free(const Obstruction& obstruction) const {
  double overshoot = 0.0;
  for (const CoverProof& proof : arm.proof()) {
    if (proof.link == obstruction.label.name ||
        (obstruction.label.kind == CoordinateLabel::Kind::self && proof.link == obstruction.label.other)) {
      overshoot += proof.max_overshoot;
    }
  }
  return overshoot > obstruction.depth + settings.safety.margin;
}

std::string Controller::Impl::explain_age() const {
  if (!is_slowed_by_age()) {
    return {};
  }
  char text[96];
  std::snprintf(text, sizeof text, "slowed to %.0f %%: the look-ahead is %.1f s old, ", 100.0 * pace_, command.look_ahead_age);
  return text + std::string("it gets too little processor time, or steps come faster than real time; ");
}

Diagnosis Controller::Impl::diagnosis() const {
  Diagnosis d = system->diagnose(workspace);
  if (!has_goal() || has_input() || d.state == MotionState::fallback) {
    return d;
  }
  d.slides = false;
  d.joint_error = d.position_error = d.rotation_error = std::numeric_limits<double>::quiet_NaN();
  if (const PoseGoal* pose = pose_goal()) {
    const PoseError error = pose_error(*pose, arm_state());
    const bool turns =
        !pose->settings.position_only || std::any_of(pose->others.begin(), pose->others.end(),
                                                     [](const PoseGoal& other) { return !other.settings.position_only; });
    d.position_error = error.position;
    d.rotation_error = turns ? error.rotation : d.rotation_error;
  } else {
    Eigen::Index farthest = 0;
    d.joint_error = (arm_q_ - std::get<JointGoal>(*goal_).position).cwiseAbs().maxCoeff(&farthest);
    d.slides = is_sliding_[static_cast<std::size_t>(farthest)];
  }
  if (d.state == MotionState::free || d.state == MotionState::arriving) {
    d.state = d.is_near() ? MotionState::arriving : MotionState::free;
  }
  return d;
}

std::string Controller::Impl::explain_closing() const {
  if (!closing_.changes()) {
    return {};
  }
  Eigen::Index nearest = -1;  // of what closes, or is in doubt and inside its margin
  for (const Eigen::Index k : metric_coordinates_) {
    if ((closing_.speed(k) > 0.0 || closing_.is_doubted(k)) && workspace.clearances.nearest[k] >= 0 &&
        (nearest < 0 || workspace.clearances.least[k] < workspace.clearances.least[nearest])) {
      nearest = k;
    }
  }
  if (nearest < 0) {
    return {};
  }
  const std::string what = obstacles().words_for(workspace.clearances.nearest[nearest]);
  if (closing_.is_doubted(nearest)) {
    return what + " has just appeared inside the margin: it waits to see whether that lasts; ";
  }
  char speed[32];
  std::snprintf(speed, sizeof speed, "%.2g", closing_.speed(nearest));
  return "gives way to " + what + ", which comes nearer at " + speed + " m/s although no such velocity was told; ";
}

std::string Controller::Impl::explain() const {
  const std::vector<std::string> open = questions().all();
  return explain_motion() + (open.empty() ? "" : "; check the units: " + open.back());
}

std::string Controller::Impl::explain_motion() const {
  std::string text;
  if (tick_ == 0) {
    return "no step was made yet: call step with the measured state, once a period";
  }
  if (command.status == SafetyStatus::stopping && impossible_.joint >= 0) {
    return "braking to a stop: " + plausible_.describe(impossible_);
  }
  if (command.status == SafetyStatus::stopping) {
    text = command.program == TorqueStatus::fallback_solver
               ? "braking to a stop: the program was not solved"
               : std::string("braking to a stop: the ") +
                     (solution.fault == TorqueFault::none ? "state" : name(solution.fault)) +
                     " of this step is unusable; check its size and that it is finite";
    return text;
  }
  if (command.status == SafetyStatus::clearance_lost && command.coordinate >= 0) {
    const CoordinateLabel& label = system->labels()[static_cast<std::size_t>(command.coordinate)];
    text = parties(label, obstacles().words_for(command.point)) + " overlap by " + millimetres(command.clearance) +
           ", as far as the covering body says; ";
    if (label.kind == CoordinateLabel::Kind::obstacle) {
      text += "if points lie on the arm itself, filter the arm out of the cloud; ";
    }
  }
  text += explain_measurement();
  if (!measurement_.agrees) {
    return text;
  }
  {
    const std::lock_guard lock(mutex_);
    if (shown_fault_[0] != '\0') {
      text += std::string("background work failed: ") + shown_fault_.data() + "; ";
    }
  }
  text += explain_closing() + explain_speed() + explain_age();
  const std::string trajectory = explain_trajectory();
  if (!trajectory.empty() && command.activity != Activity::stale) {
    if (command.activity == Activity::waiting) {
      return text + "waiting: " + trajectory;
    }
    text += trajectory + "; ";
  }
  switch (command.activity) {
    case Activity::no_goal:
      if (!has_input()) {
        return text + "no goal: it holds still, and evades what comes";
      }
      return text + "stopped: the velocity is " + age(order_age_, "inputs.timeout", settings.inputs.timeout) +
             "; set_velocity or set_twist must be called more often";
    case Activity::stale:
      if (obstacle_number_ == 0) {
        return text +
               "stopped: obstacle_timeout is set, but obstacles never were; call set_obstacles, with none where nothing is";
      }
      return text + "stopped: the obstacles are " + age(obstacle_age_, "obstacle_timeout", settings.obstacle_timeout) +
             "; set_obstacles must be called more often";
    case Activity::waiting: return text + "waiting for a posture that reaches the pose";
    case Activity::arrived: return text + "arrived";
    case Activity::blocked:
    case Activity::moving: break;
  }
  if (command.system == StepStatus::invalid_goal || command.system == StepStatus::goal_outside_limits) {
    return text + "the goal has left the position limits: it is not followed; set a new goal";
  }
  if (has_goal() && !moves_ && !has_target_) {
    return text + "another posture is looked for";
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
    const Obstruction& here = guide->last_plan().obstruction;
    const bool holds = here.label.kind == CoordinateLabel::Kind::effort;
    return text + "where the arm is, " + describe(here) + (holds ? "" : way_out(here));
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
  const Diagnosis why = diagnosis();
  const bool is_under_way = why.state == MotionState::free || why.state == MotionState::arriving;
  if (is_under_way && has_target_ && !posture_found_ && (arm_q_ - target_).cwiseAbs().maxCoeff() < judgement::arrived_joint) {
    return text + "the arm is there";
  }
  if (command.on_path) {
    text += "follows a path; ";
  }
  const CoordinateLabel label =
      why.coordinate < 0 ? CoordinateLabel{} : system->labels()[static_cast<std::size_t>(why.coordinate)];
  return text + why.describe(label, obstacles());
}

}  // namespace sidestep

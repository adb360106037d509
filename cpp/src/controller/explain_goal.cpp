#include "explain_goal.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <numbers>

#include "words.hpp"

namespace sidestep {
namespace {

/// Says what ellipsoids touch, and searches for nothing.
PlannerSettings of_endpoints() {
  PlannerSettings exact;
  exact.allowance = exact.pair_allowance = 0.0;
  exact.max_nodes = 2;
  return exact;
}

/// Whether what is in the way may be so for the covering body alone: links overshoot by more than they reach into it.
bool finer_covers_may_free(const Arm& arm, double margin, const Obstruction& obstruction) {
  double overshoot = 0.0;
  for (const CoverProof& proof : arm.proof()) {
    if (proof.link == obstruction.label.name ||
        (obstruction.label.kind == CoordinateLabel::Kind::self && proof.link == obstruction.label.other)) {
      overshoot += proof.max_overshoot;
    }
  }
  return overshoot > obstruction.depth + margin;
}

/// What to do where the arm is in something now.
std::string way_out(const Robot& robot, const Obstruction& here) {
  if (here.label.kind == CoordinateLabel::Kind::obstacle) {
    const int joint = robot.frames()[static_cast<std::size_t>(robot.frame_index(here.label.name))].joint;
    if (joint < 0 || robot.joints()[static_cast<std::size_t>(joint)].parent < 0) {
      return joint < 0 ? "; no joint moves that link: remove the obstacle, or leave it out of set_obstacles"
                       : "; only joint '" + robot.joints()[static_cast<std::size_t>(joint)].name +
                             "' moves that link: if that is not enough, remove the obstacle, or leave it out of set_obstacles";
    }
  }
  return "; it goes on when that is free";
}

}  // namespace

std::optional<Obstruction> obstruction_at_goal(const RequestBoard& board, const ClearanceQuery& body) {
  const RequestBoard::Newest newest = board.newest();
  const std::optional<Posture>& posture = newest.posture;
  const Goal* const goal = std::get_if<Goal>(&newest.request);
  if (goal == nullptr) {
    return std::nullopt;
  }
  const JointGoal* const joints = std::get_if<JointGoal>(goal);
  if (joints == nullptr && !(posture && posture->found())) {
    return std::nullopt;
  }
  Obstruction found;
  const bool touches = RrtConnect(body, of_endpoints())
                           .obstructed(joints != nullptr ? joints->position : posture->q, newest.world->obstacles, found);
  return touches ? std::optional(found) : std::nullopt;
}

std::string explain_target(const ControllerModel& model, const RequestBoard& board, const InputsStage& inputs,
                           const Sources& sources) {
  const GoalFollower& goal = inputs.goal();
  if (!goal.is_led_to_target() || inputs.request().moves()) {
    return {};
  }
  const Eigen::VectorXd& target = goal.target_position();
  const bool is_pose = inputs.request().pose_goal() != nullptr;
  const RequestBoard::Newest newest = board.newest();
  Obstacles obstacles = newest.world->obstacles;
  sources.motion().apply(obstacles);
  Obstruction obstruction;
  RrtConnect endpoint_checker(model.body, of_endpoints());
  if (newest.posture && newest.posture->touches_itself &&
      endpoint_checker.obstructed(target, Obstacles::none(), obstruction)) {  // no obstacle that goes away frees the goal
    return "no posture without self-collision was found for the pose: at the last one " + describe(obstruction) +
           "; searching others";
  }
  if (!endpoint_checker.obstructed(target, obstacles, obstruction)) {
    if (goal.planner_status() != OnlinePlannerStatus::goal_in_collision) {
      return {};
    }
    obstruction = goal.planner()->last_plan().obstruction;
  }
  if (obstruction.label.kind == CoordinateLabel::Kind::effort) {
    return "at the goal " + describe(obstruction) + (is_pose ? "; searching another posture" : "; set another goal");
  }
  const bool own = obstruction.label.kind == CoordinateLabel::Kind::self;
  const bool finer = finer_covers_may_free(model.arm, model.settings.safety.margin, obstruction);
  return "at the goal " + describe(obstruction) +
         (!own      ? std::string("; it goes on when that is free") + (finer ? ", or with a finer cover of the link" : "")
          : is_pose ? "; searching another posture"
                    : std::string(", according to the covering body; set another goal, or allow the two to touch") +
                          (finer ? ", or cover them more finely" : ""));
}

std::string explain_start(const Robot& robot, const Obstruction& here) {
  const bool holds = here.label.kind == CoordinateLabel::Kind::effort;
  return "where the arm is, " + describe(here) + (holds ? "" : way_out(robot, here));
}

std::string explain_reach(const RequestBoard& board) {
  const std::optional<Posture> posture = board.newest().posture;
  if (!posture) {
    return {};
  }
  char angle[32];
  std::snprintf(angle, sizeof angle, "%.0f", posture->rotation_error * 180.0 / std::numbers::pi);
  return "the goal is out of reach: nearest posture " + millimetres(posture->position_error) + " and " + angle + "° away; ";
}

Diagnosis diagnosis(const AttractorStage& attractor, const InputsStage& inputs, const MeasuredState& arm,
                    const KinematicState& at_arm, const JointKinds& joints) {
  Diagnosis d = attractor.system().diagnose(attractor.at_reference());
  if (!inputs.request().is_any() || inputs.request().has_input() || d.state == MotionState::fallback) {
    return d;
  }
  d.prismatic = false;
  d.joint_error = d.position_error = d.rotation_error = std::numeric_limits<double>::quiet_NaN();
  if (const PoseGoal* pose = inputs.request().pose_goal()) {
    const PoseError error = pose_error(*pose, at_arm);
    const bool turns =
        !pose->settings.position_only || std::any_of(pose->others.begin(), pose->others.end(),
                                                     [](const PoseGoal& other) { return !other.settings.position_only; });
    d.position_error = error.position;
    d.rotation_error = turns ? error.rotation : d.rotation_error;
  } else {
    Eigen::Index farthest = 0;
    d.joint_error = (arm.position() - std::get<JointGoal>(inputs.destination()).position).cwiseAbs().maxCoeff(&farthest);
    d.prismatic = joints.slides(farthest);
  }
  if (d.state == MotionState::free || d.state == MotionState::arriving) {
    d.state = d.is_near() ? MotionState::arriving : MotionState::free;
  }
  return d;
}

std::string explain_closing(const Sources& sources, const Clearances& clearances, const std::vector<Eigen::Index>& in_metres) {
  const ClosingEstimate& closing = sources.closing();
  if (!closing.changes()) {
    return {};
  }
  Eigen::Index nearest = -1;  // of what closes, or is in doubt and inside its margin
  for (const Eigen::Index k : in_metres) {
    if ((closing.speed(k) > 0.0 || closing.is_doubted(k)) && clearances.nearest[k] >= 0 &&
        (nearest < 0 || clearances.least[k] < clearances.least[nearest])) {
      nearest = k;
    }
  }
  if (nearest < 0) {
    return {};
  }
  const std::string what = sources.obstacles().words_for(clearances.nearest[nearest]);
  if (closing.is_doubted(nearest)) {
    return what + " has just appeared inside the margin: waiting until more sets of obstacles confirm it; ";
  }
  char speed[32];
  std::snprintf(speed, sizeof speed, "%.2g", closing.speed(nearest));
  return "giving way to " + what + ", which approaches at " + speed + " m/s although no such velocity was given; ";
}

std::string explain_age(double pace, double age) {
  char text[96];
  std::snprintf(text, sizeof text, "slowed to %.0f %%: the look-ahead is %.1f s old; ", 100.0 * pace, age);
  return text + std::string("it gets too little processor time, or steps come faster than real time; ");
}

}  // namespace sidestep

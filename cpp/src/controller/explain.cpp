// What a controller does, in words.
#include <string>
#include <vector>

#include "explain_goal.hpp"
#include "explain_input.hpp"
#include "impl.hpp"
#include "words.hpp"

namespace sidestep {
namespace {

std::string explain_stop(ProgramStatus program, const MeasuredState& arm, const Plausibility& plausible, ProgramFault fault) {
  if (arm.what_is_impossible().joint >= 0) {
    return "braking to a stop: " + plausible.describe(arm.what_is_impossible());
  }
  if (program == ProgramStatus::fallback_solver) {
    return "braking to a stop: the quadratic program was not solved";
  }
  return std::string("braking to a stop: the ") + (fault == ProgramFault::none ? "state" : name(fault)) +
         " of this step is unusable; check its size and that it is finite";
}

std::string explain_overlap(const Command& command, const CoordinateLabel& label, const Obstacles& obstacles) {
  return parties(label, obstacles.words_for(command.point)) + " overlap by " + millimetres(command.clearance) +
         ", according to the covering body; " +
         (label.kind == CoordinateLabel::Kind::obstacle ? "if points lie on the arm itself, filter the arm out of the cloud; "
                                                        : "");
}

/// What activities other than to move or be blocked are for; empty for these.
std::string explain_activity(Activity activity, const InputsStage& inputs, const Sources& sources,
                             const ControllerSettings& settings) {
  switch (activity) {
    case Activity::no_goal:
      return !inputs.request().has_input()
                 ? "no goal: holding position and avoiding moving obstacles"
                 : "stopped: the velocity is " +
                       age_in_words(inputs.request().age(), "inputs.timeout", settings.inputs.timeout) +
                       "; set_velocity or set_twist must be called more often";
    case Activity::stale: return "stopped: " + sources.explain();
    case Activity::waiting: return "waiting for a posture that reaches the pose";
    case Activity::arrived: return "arrived";
    case Activity::blocked:
    case Activity::moving: break;
  }
  return {};
}

}  // namespace

std::string Controller::Impl::explain() const {
  const std::vector<std::string> open = board_.questions().all();
  return explain_motion() + (open.empty() ? "" : "; check the units: " + open.back());
}

Eigen::VectorXd Controller::Impl::target() const {
  const GoalFollower& goal = inputs_.goal();
  return goal.is_led_to_target() ? Eigen::VectorXd(goal.target_position() - measured_.all_turns()) : Eigen::VectorXd();
}

std::optional<Obstruction> Controller::Impl::goal_obstruction() const { return obstruction_at_goal(board_, model.body); }

std::string Controller::Impl::explain_motion() const {
  if (state_.steps == 0) {
    return "no step was made yet: call step with the measured state, once a period";
  }
  if (!clock_.tick().goes_on()) {
    return "braking to a stop: " + clock_.explain() + "; it must go on from step to step";
  }
  if (touch_.is_touched() && solution_.fault == ProgramFault::none) {
    return touch_.explain();
  }
  if (command_.status == SafetyStatus::stopping) {
    return explain_stop(state_.program, measured_, model.plausible, solution_.fault);
  }
  std::string text = clock_.explain();
  text += text.empty() ? "" : "; ";
  if (command_.status == SafetyStatus::clearance_lost && command_.coordinate >= 0) {
    text += explain_overlap(command_, model.system->labels()[static_cast<std::size_t>(command_.coordinate)], obstacles());
  }
  text += measured_.explain(reference_.next_q, clock_.tick().time);
  if (!measured_.agrees_with_reference()) {
    return text;
  }
  if (const std::string fault = board_.fault(); !fault.empty()) {
    text += "background work failed: " + fault + "; ";
  }
  text += explain_closing(sources_, attractor_.at_reference().clearances, model.clearances);
  text += speed_.explain(command_, solution_, obstacles());
  if (look_ahead_.slows(command_.activity == Activity::moving)) {
    text += explain_age(look_ahead_.current_pace(), command_.background.look_ahead_age);
  }
  if (inputs_.request().trajectory() != nullptr && command_.activity != Activity::stale) {
    const bool keeps_path = inputs_.request().has_input() && inputs_.request().keeps_path();
    const std::string trajectory = inputs_.trajectory().explain(command_.delay, command_.deviation, keeps_path, obstacles());
    if (!trajectory.empty() && command_.activity == Activity::waiting) {
      return text + "waiting: " + trajectory;
    }
    text += trajectory.empty() ? "" : trajectory + "; ";
  }
  if (state_.paused && !sources_.is_stale()) {
    return text + "paused: the arm rests until `resume`";
  }
  const std::string activity = explain_activity(command_.activity, inputs_, sources_, model.settings);
  return text + (activity.empty() ? explain_way() : activity);
}

std::string Controller::Impl::explain_way() const {
  const GoalFollower& goal = inputs_.goal();
  const OnlinePlannerStatus planner_status = goal.planner_status();
  if (state_.attraction == StepStatus::invalid_goal || state_.attraction == StepStatus::goal_outside_limits) {
    return "the goal has left the position limits: it is not followed; set a new goal";
  }
  if (inputs_.request().is_any() && !inputs_.request().moves() && !goal.is_led_to_target()) {
    return "searching another posture";
  }
  std::string text;
  if (goal.is_led_to_target() && !goal.reaches_goal()) {
    text += explain_reach(board_);
  }
  if (planner_status == OnlinePlannerStatus::start_in_collision) {
    return text + explain_start(model.arm.robot(), goal.planner()->last_plan().obstruction);
  }
  const std::string at_target = explain_target(model, board_, inputs_, sources_);
  if (planner_status == OnlinePlannerStatus::goal_in_collision || goal.stops_short(state_.followed, state_.findings.blocked)) {
    return text + at_target;
  }
  if (!at_target.empty()) {
    text += at_target + "; ";
  }
  if (planner_status == OnlinePlannerStatus::no_path) {
    text += "no path was found yet; searching again; ";
  }
  if (look_ahead_.is_followed()) {
    return text + "avoiding a moving obstacle";
  }
  if (state_.followed != nullptr && state_.followed != goal.led_goal() && state_.followed != &inputs_.destination()) {
    text += "leaving a local minimum by a sub-goal; ";
  }
  if (inputs_.request().has_input()) {
    return text + explain_input(model, inputs_, attractor_, command_, reference_.next_v, obstacles());
  }
  const Diagnosis why = diagnosis(attractor_, inputs_, measured_, arm_state(state_.apart), model.joints);
  const bool is_under_way = why.state == MotionState::free || why.state == MotionState::arriving;
  if (is_under_way && goal.is_led_to_target() && !goal.reaches_goal() &&
      (measured_.position() - goal.target_position()).cwiseAbs().maxCoeff() < judgement::arrived_joint) {
    return text + "the arm is there";
  }
  const CoordinateLabel label =
      why.coordinate < 0 ? CoordinateLabel{} : model.system->labels()[static_cast<std::size_t>(why.coordinate)];
  return text + (command_.on_path ? "follows a path; " : "") + why.describe(label, obstacles());
}

}  // namespace sidestep

#include "activity_judge.hpp"

#include <algorithm>
#include <cmath>

namespace sidestep {
namespace {

constexpr double prismatic_speed = 0.1;  // share of the speed that counts as rest, of prismatic joints [m/rad]
// Time for which the way to a goal stays as it is before the activity says so: several looks of planner and barriers [s].
constexpr double settling = 0.2;
constexpr double unfound = 0.5;         // the same of a search that found nothing: barriers may lead on meanwhile [s]
constexpr double opening = 0.1;         // the same of a way that is open again [s]
constexpr double settling_looks = 3.0;  // the same of each, where looks are farther apart [looks]

}  // namespace

ActivityJudge::ActivityJudge(const ControllerSettings& settings, const JointKinds& joints, double look_period)
    : settings_(settings), joints_(joints), look_period_(look_period) {}

Activity ActivityJudge::without_state(bool stale, bool has_request) noexcept {
  return stale ? Activity::stale : has_request ? Activity::waiting : Activity::no_goal;
}

bool ActivityJudge::is_at_goal(const Evidence& now) const noexcept {
  const ArrivalSettings& near = settings_.arrival;
  if (!now.arm.agrees_with_reference() || now.arm.velocity().cwiseAbs().maxCoeff() > near.speed) {
    return false;
  }
  if (const auto* pose = std::get_if<PoseGoal>(&now.destination)) {
    const PoseError error = pose_error(*pose, now.kinematics);
    return error.position <= near.position && error.rotation <= near.rotation;
  }
  const Eigen::VectorXd &q = now.arm.position(), &goal = std::get<JointGoal>(now.destination).position;
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const double error = std::abs(q[j] - goal[j]);
    if (!(error <= (joints_.slides(j) ? near.sliding : near.joint))) {
      return false;
    }
  }
  return true;
}

ActivityJudge::Verdict ActivityJudge::judge(const Evidence& now) noexcept {
  if (now.stale) {
    return {Activity::stale};
  }
  if (!now.request.is_any()) {
    return {Activity::no_goal};
  }
  if (now.request.has_input() && now.request.trajectory() == nullptr) {
    return {now.fresh ? Activity::moving : Activity::no_goal};
  }
  if (!now.under_way && is_at_goal(now)) {
    return {Activity::arrived};
  }
  if (now.waits) {
    return {Activity::waiting};
  }
  if (now.attraction == StepStatus::invalid_goal || now.attraction == StepStatus::goal_outside_limits) {
    return {Activity::blocked};
  }
  if (now.request.moves()) {
    return {Activity::moving};
  }
  if (!now.goal.is_led_to_target() && now.goal.attempt() == 0) {
    return {Activity::waiting};
  }
  const bool rests = now.goal.is_led_to_target() && is_at_rest(now.arm.velocity());
  memory_.rest_time = rests ? memory_.rest_time + now.tick.moved : 0.0;
  settle(now);
  return {memory_.no_way ? Activity::blocked : Activity::moving, rests};
}

bool ActivityJudge::is_at_rest(const Eigen::VectorXd& v) const noexcept {
  bool rests = true;
  for (Eigen::Index j = 0; j < v.size(); ++j) {
    rests = rests && std::abs(v[j]) < (joints_.slides(j) ? prismatic_speed : 1.0) * settings_.arrival.speed;
  }
  return rests;
}

void ActivityJudge::settle(const Evidence& now) noexcept {
  Memory& m = memory_;
  const Way way = now.goal.way(m.rest_time, now.followed, now.target_blocked);
  if (way != Way::unknown && way != m.way) {
    m.way = way;
    m.since = now.tick.time;
  }
  if (way == Way::open) {
    m.settles = opening;
  } else if (way == Way::none) {
    m.settles = now.goal.planner_status() == OnlinePlannerStatus::no_path && now.goal.reaches_goal() ? unfound : settling;
  }
  if (now.tick.time - m.since >= std::max(m.settles, settling_looks * look_period_)) {
    m.no_way = m.way == Way::none;
  }
}

void ActivityJudge::forget(double time) noexcept {
  memory_.way = Way::unknown;
  memory_.since = time;
  memory_.rest_time = 0.0;
  memory_.no_way = false;
}

}  // namespace sidestep

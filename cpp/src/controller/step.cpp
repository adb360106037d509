// One period: state and orders in, command out.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "../math/settings.hpp"
#include "impl.hpp"

namespace sidestep {
namespace {

// Measured positions beyond a limit by less than this are noise [rad], [m]; from farther outside the arm is led back.
constexpr double position_noise = 0.01, sliding_noise = 0.002;
constexpr double sliding_speed = 0.1;  // of the speed that counts as rest, of joints that slide [m/rad]
// Time for which the way to a goal stays as it is before the activity says so [s]: several looks of planner and barriers, of
// 20 ms each. What changes from one look to the next, as from posture to posture, is no verdict.
constexpr double settling = 0.2;
constexpr double unfound = 0.5;         // the same of a search that found nothing [s]: barriers may lead on meanwhile
constexpr double opening = 0.1;         // the same of a way that is open again [s]
constexpr double settling_looks = 3.0;  // each of them, where looks are farther apart [looks]
// Time of rest from which an arm that is inside something counts as unable to get out [s]: the reactive layer takes less.
constexpr double held_inside = 1.0;

}  // namespace

const Command& Controller::Impl::step(ConstVectorRef q, ConstVectorRef v, const Eigen::Ref<const Eigen::MatrixXd>* mass_matrix,
                                      const Eigen::Ref<const Eigen::VectorXd>* bias) noexcept {
  time_ = static_cast<double>(++tick_) * settings.period;
  const bool known = take_state(q, v);
  take_orders();
  if (!known) {
    if (impossible_.joint >= 0) {
      stop(mass_matrix, bias, unknown_, unknown_);
    } else {
      stop(mass_matrix, bias, q, v);
    }
    report(false);
    if (has_last_torque_) {
      last_torque_ = command.torque;
    }
    return command;
  }
  judge_sample();
  measured_.draft() = arm_q_;
  measured_.submit();
  observe();
  follow_arm();
  const bool looks = time_ >= next_look_ || begins_goal_;
  if (looks) {
    next_look_ = time_ + look_period_ - 0.5 * settings.period;
    if (settings.synchronous && guide) {
      guarded([&] { guide->set_obstacles(obstacles()); });
    }
  }
  choose_reference();
  leave_room(looks);
  avoid();
  judge_age();
  const Goal& goal = avoiding_ ? avoidance_goal_ : pulls_ ? input_pull_ : *followed_;
  workspace.horizon = arm_workspace_.horizon = avoiding_ ? 0.0 : Horizon::of_obstacles;
  const StepStatus status = system->acceleration(q_, v_, goal, obstacles(), workspace);
  command.system = status;
  wanted_ = workspace.acceleration;
  if (avoiding_ && !is_fallback(status)) {
    trajectory_.acceleration(q_, v_, settings.period, wanted_);
  } else if (keeps_path() && !is_fallback(status)) {
    wanted_ = pulled_ + workspace.recovery;
  }
  if (pace_ < 1.0 && !pulls_ && !is_fallback(status) &&
      !(guide && followed_ == &reference_ && guide->following().route_number != 0)) {
    // Paths, trajectories and velocities are slowed themselves. What pulls straight is damped, at no pace like a stop; the way out of
    // a barrier is not.
    wanted_ = pace_ * (wanted_ - workspace.recovery) - (1.0 - pace_) / settings.stop_time * v_ + workspace.recovery;
  }
  if (is_stale() || !measurement_.agrees) {
    wanted_ = -v_ / settings.stop_time;
  } else if (closing_.changes()) {
    wait_in_doubt();
  }
  wanted_ += coupling_;
  solve_reference(mass_matrix, bias);
  keep_failsafe();
  advance_reference();
  track(mass_matrix, bias);
  look_at_sample();
  report(true);
  if (!settings.synchronous && (looks || wakes_worker_)) {
    write_snapshot();
    if (std::exchange(wakes_worker_, false)) {
      wake_.release();
    }
  }
  known_before_ = true;
  last_arm_q_ = arm_q_;
  last_arm_v_ = arm_v_;
  last_torque_ = command.torque;
  last_acceleration_ = command.acceleration;
  has_last_torque_ = torque;
  measurement_.stepped_at = std::chrono::steady_clock::now();  // a pause begins where a step ends, however long it planned
  return command;
}

void Controller::Impl::take_obstacles() noexcept {
  if (obstacle_orders_.is_fresh()) {
    Obstacles& before = obstacle_orders_.current().obstacles;
    before.advance(settings.period);
    closing_.leave(arm_q_, before);
    obstacle_orders_.update();  // one that comes after the question above is taken by the next step
  }
  if (obstacle_orders_.current().number != obstacle_number_) {
    obstacle_number_ = obstacle_orders_.current().number;
    obstacle_age_ = 0.0;
    failsafe_.look_anew();
    closing_.take(obstacle_orders_.current().obstacles, time_);
  } else {
    obstacle_age_ += settings.period;
    obstacle_orders_.current().obstacles.advance(settings.period);
  }
  closing_.advance(time_);
}

void Controller::Impl::take_orders() noexcept {
  take_obstacles();
  goal_orders_.update();
  if (goal_orders_.current().number != goal_number_) {
    GoalOrder& order = goal_orders_.current();
    goal_ = std::get_if<Goal>(&order.order);
    order_age_ = 0.0;
    begins_input_ = goal_ == nullptr && order.order.index() != 0;
    goal_number_ = order.number;
    if (goal_ == nullptr) {
      forget_way();
    }
    has_target_ = posture_found_ = false;
    target_blocked_ = rests_ = false;
    posture_attempt_ = 0;
    moves_ = goal_ != nullptr && is_moving(*goal_);
    guide_status_ = OnlinePlannerStatus::idle;
    num_lowered_ = -1;
    next_posture_ = 0.0;
    begins_goal_ = goal_ != nullptr;  // where the state is known
    if (begins_input_) {
      goal_ = &input_goal_;
      moves_ = true;
    }
  } else {
    order_age_ += settings.period;
    if (goal_ != nullptr && moves_ && !has_input()) {
      advance(*goal_, settings.period);
    }
  }
}

double Controller::Impl::within_limits(double q, Eigen::Index joint) const noexcept {
  const JointLimits& limits = arm.robot().limits();
  const double within = std::clamp(q, limits.lower[joint], limits.upper[joint]);
  const double noise = is_sliding_[static_cast<std::size_t>(joint)] ? sliding_noise : position_noise;
  return std::abs(q - within) < noise ? within : q;
}

void Controller::Impl::wait_in_doubt() noexcept {
  if (avoiding_ || is_fallback(command.system)) {
    return;
  }
  bool doubted = false;
  for (std::size_t k = 0; k < system->labels().size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    if (workspace.clearances.values[at] < system->labels()[k].floor) {
      if (!closing_.is_doubted(at)) {
        return;
      }
      doubted = true;
    }
  }
  if (doubted) {
    wanted_ -= workspace.recovery;
  }
}

void Controller::Impl::report(bool known) noexcept {
  command.torque.setZero();
  if (torque) {
    command.torque = tracked_.torque;
    keep_torque_rate();
  }
  write_gravity(known);
  if (observer_) {
    command.disturbance = observer_->disturbance();
    command.rotors = observer_->rotors();
  }
  command.input_change.setZero();
  command.deviation = command.delay = 0.0;
  if (const TrajectoryOrder* order = trajectory_order(); order != nullptr && known && !begins_input_) {
    if (clock_.time < order->path.first()) {
      command.deviation = (path_q_ - q_).cwiseAbs().maxCoeff(&deviating_);
    } else {
      const JointTrajectory::Deviation off = order->path.deviation(clock_.time, q_);
      command.deviation = off.value;
      deviating_ = off.joint;
    }
    command.delay = clock_.delay;
  }
  command.wanted = wanted_;
  command.acceleration = tracked_.acceleration;
  if (!command.acceleration.allFinite()) {
    command.acceleration.setZero();
  }
  std::copy(solution.active.begin(), solution.active.end(), command.limits.begin());
  command.bound_by = solution.dominant < 0 ? -1 : solution.safety[static_cast<std::size_t>(solution.dominant)].coordinate;
  command.avoiding = avoiding_ && !is_stale();
  command.on_path = known && has_target_ && followed_ == &reference_ && guide && guide->following().route_number != 0;
  command.clearance = known ? infinity : std::numeric_limits<double>::quiet_NaN();
  command.coordinate = command.point = -1;
  if (!known) {
    command.distance = command.speed = command.speed_limit = std::numeric_limits<double>::quiet_NaN();
    command.status = SafetyStatus::stopping;
    command.system = StepStatus::invalid_state;
    command.activity = is_stale() ? Activity::stale : has_goal() ? Activity::waiting : Activity::no_goal;
    if (drives_track_ && known_before_) {
      command.velocity = next_v_;
      command.position = next_q_;
      if (settings.output == ControllerSettings::Output::velocity) {
        add_drift(false);
      }
    } else {
      command.velocity.setZero();
      command.position = last_arm_q_;
    }
    for (Eigen::Index j = 0; j < q_.size(); ++j) {
      command.position[j] = within_limits(command.position[j], j) - turns_[j];
    }
    return;
  }
  command.velocity = next_v_;
  if (settings.output == ControllerSettings::Output::velocity) {
    add_drift(true);
  }
  for (Eigen::Index j = 0; j < q_.size(); ++j) {
    command.position[j] = within_limits(next_q_[j], j) - turns_[j];
  }
  const Clearances* nearest = &workspace.clearances;
  const auto take_nearest = [&](const Clearances& clearances) {
    for (const Eigen::Index k : metric_coordinates_) {
      if (clearances.least[k] < command.clearance) {
        command.clearance = clearances.least[k];
        command.coordinate = static_cast<int>(k);
        nearest = &clearances;
      }
    }
  };
  take_nearest(workspace.clearances);
  if (apart_) {
    take_nearest(arm_workspace_.clearances);
  }
  if (command.coordinate >= 0 &&
      system->labels()[static_cast<std::size_t>(command.coordinate)].kind == CoordinateLabel::Kind::obstacle) {
    command.point = nearest->nearest[command.coordinate];
  }
  switch (command.program) {
    case TorqueStatus::ok: command.status = SafetyStatus::ok; break;
    case TorqueStatus::limited: command.status = SafetyStatus::limited; break;
    case TorqueStatus::relaxed: command.status = SafetyStatus::relaxed; break;
    case TorqueStatus::relaxed_safety: command.status = SafetyStatus::margin_lost; break;
    case TorqueStatus::clearance_lost: command.status = SafetyStatus::clearance_lost; break;
    case TorqueStatus::fallback_invalid_input:
    case TorqueStatus::fallback_solver: command.status = SafetyStatus::stopping; break;
  }
  if (measurement_.is_far) {
    command.status = std::max(command.status, SafetyStatus::tracking_lost);
  }
  if (is_stale()) {
    command.status = std::max(command.status, SafetyStatus::stale);
  }
  if (is_fallback(command.system)) {
    command.status = SafetyStatus::stopping;
  }
  if (command.clearance < 0.0) {
    command.status = SafetyStatus::clearance_lost;
  }
  judge_input();
  command.activity = judge_activity();
  if (is_slowed_by_age()) {
    command.status = std::max(command.status, SafetyStatus::limited);
  }
}

void Controller::Impl::write_gravity(bool known) noexcept {
  if (torque && known && dynamics_) {
    command.torque_without_gravity = command.torque - gravity_;
  } else {
    command.torque_without_gravity.setConstant(torque ? std::numeric_limits<double>::quiet_NaN() : 0.0);
  }
}

bool Controller::Impl::at_goal() noexcept {
  const ArrivalSettings& near = settings.arrival;
  if (!measurement_.agrees || arm_v_.cwiseAbs().maxCoeff() > near.speed) {
    return false;
  }
  if (const PoseGoal* pose = pose_goal()) {
    const PoseError error = pose_error(*pose, apart_ ? arm_workspace_.state() : workspace.state());
    return error.position <= near.position && error.rotation <= near.rotation;
  }
  for (Eigen::Index j = 0; j < q_.size(); ++j) {
    const double error = std::abs(arm_q_[j] - std::get<JointGoal>(*goal_).position[j]);
    if (!(error <= (is_sliding_[static_cast<std::size_t>(j)] ? near.sliding : near.joint))) {
      return false;
    }
  }
  return true;
}

Activity Controller::Impl::judge_activity() noexcept {
  if (is_stale()) {
    return Activity::stale;
  }
  if (!has_goal()) {
    return Activity::no_goal;
  }
  const bool on_trajectory = trajectory_order() != nullptr;
  if (has_input() && !on_trajectory) {
    return is_fresh() ? Activity::moving : Activity::no_goal;
  }
  const bool under_way = has_input() && on_trajectory && (begins_input_ || clock_.time < trajectory_order()->path.duration());
  if (!under_way && at_goal()) {
    return Activity::arrived;
  }
  if (waits_) {
    return Activity::waiting;
  }
  if (command.system == StepStatus::invalid_goal || command.system == StepStatus::goal_outside_limits) {
    return Activity::blocked;
  }
  if (moves_) {
    return Activity::moving;
  }
  if (!has_target_ && posture_attempt_ == 0) {
    return Activity::waiting;
  }
  rests_ = has_target_;
  for (Eigen::Index j = 0; j < arm_v_.size(); ++j) {  // a joint may slide no faster than that
    const double share = is_sliding_[static_cast<std::size_t>(j)] ? sliding_speed : 1.0;
    rests_ = rests_ && std::abs(arm_v_[j]) < share * settings.arrival.speed;
  }
  rest_time_ = rests_ ? rest_time_ + settings.period : 0.0;
  settle_way();
  return no_way_ ? Activity::blocked : Activity::moving;
}

StepState::Way Controller::Impl::way_to_goal() noexcept {
  if (!has_target_) {
    return Way::unknown;  // another posture is looked for
  }
  if (!posture_found_ || guide_status_ == OnlinePlannerStatus::no_path ||
      guide_status_ == OnlinePlannerStatus::goal_in_collision || stops_short()) {
    return Way::none;
  }
  if (!guide) {
    return Way::open;
  }
  if (guide_status_ == OnlinePlannerStatus::start_in_collision) {
    return rest_time_ < held_inside ? Way::unknown : Way::none;
  }
  return guide->following().route_number == 0 ? Way::unknown : Way::open;
}

void Controller::Impl::settle_way() noexcept {
  const Way now = way_to_goal();
  if (now != Way::unknown && now != way_) {
    way_ = now;
    way_since_ = time_;
  }
  if (now == Way::open) {
    way_settles_ = opening;
  } else if (now == Way::none) {
    way_settles_ = guide_status_ == OnlinePlannerStatus::no_path && posture_found_ ? unfound : settling;
  }
  if (time_ - way_since_ >= std::max(way_settles_, settling_looks * look_period_)) {
    no_way_ = way_ == Way::none;
  }
}

void Controller::Impl::forget_way() noexcept {
  way_ = Way::unknown;
  way_since_ = time_;
  rest_time_ = 0.0;
  no_way_ = false;
}

void Controller::Impl::write_snapshot() noexcept {
  Snapshot& s = snapshots_.draft();
  s.time = time_;
  s.q = q_;
  s.v = v_;
  s.goal_number = goal_number_;
  s.posture_attempt = posture_attempt_;
  s.obstacle_number = obstacle_orders_.current().number;
  s.obstacle_age = obstacle_age_;
  s.by_pose = followed_ == goal_;
  s.on_trajectory = pulls_ && trajectory_order();
  if (s.on_trajectory) {
    s.begin_q = begin_q_;
    s.begin_v = begin_v_;
    s.clock = clock_.time;
    s.rate = clock_.rate;
  }
  s.order_age = order_age_;
  if (const auto* joint = std::get_if<JointGoal>(followed_)) {
    s.followed = *joint;
  }
  s.following = guide && has_target_ && followed_ == &reference_ ? guide->following() : OnlinePlanner::Following{};
  write_places(s.places, s.num_places);
  if (disturbed_) {
    s.num_places = 0;
  }
  s.avoiding = avoiding_;
  s.trajectory = trajectory_;
  s.written = std::chrono::steady_clock::now();
  snapshots_.submit();
}

}  // namespace sidestep

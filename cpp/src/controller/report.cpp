// What a step reports: the command from what its stages ended with.
#include <algorithm>
#include <cmath>
#include <limits>

#include "../math/settings.hpp"
#include "impl.hpp"

namespace sidestep {
namespace {

// Distance of a measured position beyond a limit that is noise; from farther outside the arm is led back [rad], [m].
constexpr double position_noise = 0.01, prismatic_noise = 0.002;

/// The position that is commanded of a joint: at its limit, where the reference is beyond it by no more than noise.
double within_limits(double q, double lower, double upper, bool slides) noexcept {
  const double within = std::clamp(q, lower, upper);
  return std::abs(q - within) < (slides ? prismatic_noise : position_noise) ? within : q;
}

SafetyStatus safety_of(ProgramStatus program) noexcept {
  switch (program) {
    case ProgramStatus::ok: return SafetyStatus::ok;
    case ProgramStatus::limited: return SafetyStatus::limited;
    case ProgramStatus::relaxed: return SafetyStatus::relaxed;
    case ProgramStatus::relaxed_safety: return SafetyStatus::margin_lost;
    case ProgramStatus::clearance_lost: return SafetyStatus::clearance_lost;
    case ProgramStatus::fallback_invalid_input:
    case ProgramStatus::fallback_solver: break;
  }
  return SafetyStatus::stopping;
}

}  // namespace

void Controller::Impl::report_timing(const Tick& tick) noexcept { command_.timing = {tick.period, tick.late, tick.missed}; }

void Controller::Impl::report_motion(const Goal& followed, bool apart, const Tick& tick) noexcept {
  report_timing(tick);
  report_torque(apart, tick);
  write_gravity(true);
  command_.deviation = inputs_.judge_deviation(reference_);
  command_.delay = inputs_.trajectory_delay();
  report_program();
  command_.avoiding = look_ahead_.is_followed() && !must_rest();
  command_.on_path = inputs_.goal().is_led_to_target() && inputs_.goal().is_on_path(&followed);
  command_.velocity = reference_.next_v;
  if (model.settings.output == ControllerSettings::Output::velocity) {
    tracker_.write_velocity(reference_, measured_.position(), true, tick, command_.velocity);
  }
  report_position(reference_.next_q);
  report_clearance(apart);
  report_status(followed, apart, tick);
}

void Controller::Impl::report_stop(const Tick& tick) noexcept {
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  report_timing(tick);
  report_torque(state_.apart, tick);
  write_gravity(false);
  command_.deviation = command_.delay = 0.0;
  report_program();
  command_.input_change.setZero();
  command_.avoiding = look_ahead_.is_followed() && !must_rest();
  command_.on_path = false;
  command_.coordinate = command_.point = -1;
  command_.clearance = command_.distance = command_.speed = command_.speed_limit = unknown;
  command_.status = SafetyStatus::stopping;
  state_.attraction = StepStatus::invalid_state;
  command_.activity = ActivityJudge::without_state(sources_.is_stale(), inputs_.request().is_any());
  if (tracker_.drives_track() && measured_.was_known()) {
    command_.velocity = reference_.next_v;
    if (model.settings.output == ControllerSettings::Output::velocity) {
      tracker_.write_velocity(reference_, measured_.position(), false, tick, command_.velocity);
    }
    report_position(reference_.next_q);
  } else {
    command_.velocity.setZero();
    report_position(measured_.last_position());
  }
}

void Controller::Impl::report_torque(bool apart, const Tick& tick) noexcept {
  command_.torque.setZero();
  if (!model.torque) {
    return;
  }
  command_.torque = tracker_.solution().torque;
  if (tracker_.keep_torque_rate(last_, dynamics_, tick, command_.torque) && !apart) {
    reference_.torque = command_.torque;
  }
  if (dynamics_.observer()) {
    command_.observed.disturbance = dynamics_.observer()->disturbance();
    command_.observed.rotors = dynamics_.observer()->rotors();
  }
}

void Controller::Impl::write_gravity(bool known) noexcept {
  if (known && dynamics_.has_model()) {
    command_.torque_without_gravity = command_.torque - dynamics_.gravity();
  } else {
    command_.torque_without_gravity.setConstant(model.torque ? std::numeric_limits<double>::quiet_NaN() : 0.0);
  }
}

void Controller::Impl::report_program() noexcept {
  command_.wanted = state_.wanted;
  command_.acceleration = tracker_.solution().acceleration;
  if (!command_.acceleration.allFinite()) {
    command_.acceleration.setZero();
  }
  std::copy(solution_.active.begin(), solution_.active.end(), command_.limits.begin());
  command_.bound_by = solution_.dominant < 0 ? -1 : solution_.safety[static_cast<std::size_t>(solution_.dominant)].coordinate;
}

void Controller::Impl::report_position(const Eigen::VectorXd& q) noexcept {
  const JointLimits& limits = model.arm.robot().limits();
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    command_.position[j] = within_limits(q[j], limits.lower[j], limits.upper[j], model.joints.slides(j)) - measured_.turn(j);
  }
}

void Controller::Impl::report_clearance(bool apart) noexcept {
  command_.clearance = infinity;
  command_.coordinate = command_.point = -1;
  const auto take_nearest = [&](const Clearances& clearances) {
    for (const Eigen::Index k : model.clearances) {
      if (clearances.least[k] < command_.clearance) {
        const CoordinateLabel& label = model.system->labels()[static_cast<std::size_t>(k)];
        command_.clearance = clearances.least[k];
        command_.coordinate = static_cast<int>(k);
        command_.point = label.kind == CoordinateLabel::Kind::obstacle ? clearances.nearest[k] : -1;
      }
    }
  };
  take_nearest(attractor_.at_reference().clearances);
  if (apart) {
    take_nearest(attractor_.at_arm().clearances);
  }
}

void Controller::Impl::report_status(const Goal& followed, bool apart, const Tick& tick) noexcept {
  SafetyStatus status = safety_of(state_.program);
  if (measured_.is_far_from_command()) {
    status = std::max(status, SafetyStatus::tracking_lost);
  }
  const bool stale = sources_.is_stale();
  if (stale) {
    status = std::max(status, SafetyStatus::stale);
  }
  if (is_fallback(state_.attraction) || touch_.is_touched()) {
    status = SafetyStatus::stopping;
  }
  if (command_.clearance < 0.0) {
    status = SafetyStatus::clearance_lost;
  }
  command_.input_change.setZero();
  const NearReference near = near_reference();
  const bool reduced = inputs_.judge(moment(near, tick), state_.wanted, command_.deviation, command_.input_change);
  if (reduced && status == SafetyStatus::ok) {
    status = SafetyStatus::limited;
  }
  const ActivityJudge::Verdict verdict = activity_.judge(
      {inputs_.request(), inputs_.destination(), inputs_.goal(), &followed, measured_, arm_state(apart), state_.attraction,
       tick, must_rest(), inputs_.is_fresh(), inputs_.is_under_way(), inputs_.input().waits(), state_.findings.blocked});
  command_.activity = must_rest() && !stale ? Activity::waiting : verdict.activity;
  state_.findings.rests = verdict.rests.value_or(state_.findings.rests);
  if (look_ahead_.slows(command_.activity == Activity::moving)) {
    status = std::max(status, SafetyStatus::limited);
  }
  command_.status = status;
}

}  // namespace sidestep

// One period: the measured state in, the command out. The stages stand in the order in which they work.
#include <algorithm>
#include <utility>

#include "../math/settings.hpp"
#include "impl.hpp"
#include "path_hold.hpp"

namespace sidestep {

const Command& Controller::Impl::step(ConstVectorRef q, ConstVectorRef v, const ToldDynamics& told, double told_time) noexcept {
  const ControllerSettings& settings = model.settings;
  // Tick = clock(t)
  const Tick& tick = clock_.begin_step(told_time);
  const double time = tick.time;
  ++state_.steps;
  const bool known = measured_.take(q, v);
  take_over(tick);
  if (!known || !tick.goes_on()) {
    state_.told.is = false;
    return stop(q, v, told, tick);
  }
  // Measurement = observe(q, v, Tick)
  reference_.hold(settings.output, tick);
  if (state_.told.is) {
    reference_.continue_from(state_.told.position, state_.told.velocity, state_.told.acceleration);
    tracker_.begin_anew();
  }
  measured_.judge(reference_.next_q, last_.acceleration, tick);
  board_.show_measured(measured_.position());
  judge_touch(tick);
  dynamics_.observe(measured_.begins() || touch_.is_touched(), measured_.velocity(), last_, tick);
  bool& apart = state_.apart = follow_arm(tick);

  // Target = inputs.target(World)
  const Obstacles& obstacles = sources_.obstacles();
  const bool looks = begin_look(obstacles, time);
  const NearReference near = near_reference();
  const InputsStage::Target target = inputs_.target(moment(near, tick));
  const Goal& followed = *(state_.followed = target.followed);
  state_.findings = target.findings;
  taken_.goal = inputs_.goal().taken();
  if (target.is_another_way) {
    activity_.forget(time);
  }
  update_activation_distances(looks, obstacles);
  look_ahead(followed, tick, obstacles);

  // Desired = attractor(Target, World)
  state_.attraction = attractor_.attract(lead(followed, must_rest(), tick), distances_.values(), reference_, obstacles,
                                         sources_.closing(), tick, state_.wanted);
  state_.wanted += state_.coupling;

  // Program = constraints, solved; Manoeuvre = guard.admit(...)
  state_.program = guard(solve(state_.wanted, apart, followed, told, tick), tick);
  reference_.advance(solution_.acceleration,
                     state_.program == ProgramStatus::relaxed_safety || state_.program == ProgramStatus::clearance_lost,
                     model.arm.robot().limits().jerk, tick.period);

  // Command = tracker(...)
  state_.program = track(state_.program, apart, command_.tracking_error, told, tick);
  if (measured_.bridges_sample()) {  // what is reported is of the arm, as far as it is measured
    apart = attractor_.look_at_arm(measured_.sample_q(), measured_.sample_v(), obstacles, sources_.closing()) || apart;
    command_.tracking_error = (reference_.q - measured_.sample_q()).cwiseAbs().maxCoeff();
  }
  measured_.compare(reference_.next_q);
  report_motion(followed, apart, tick);
  if (!settings.synchronous && (looks || inputs_.goal().asks())) {
    tell_worker(followed, time, inputs_.goal().take_question());
  }
  last_.take(command_.acceleration, command_.torque, model.torque);
  state_.told.is = false;
  measured_.end_step();
  clock_.end_step();
  return command_;
}

bool Controller::Impl::begin_look(const Obstacles& obstacles, double time) noexcept {
  const bool looks = time >= state_.next_look || inputs_.goal().begins_goal();
  if (looks) {
    state_.next_look = time + model.look_period - 0.5 * model.settings.period;
    if (OnlinePlanner* const planner = inputs_.goal().planner(); planner != nullptr && model.settings.synchronous) {
      board_.guarded([&] { planner->set_obstacles(obstacles); });
    }
  }
  return looks;
}

void Controller::Impl::take_over(const Tick& tick) noexcept {
  if (sources_.update(measured_.position(), tick)) {
    guard_.invalidate();
  }
  if (inputs_.update(tick)) {
    distances_.forget();
    state_.findings = {};
    if (inputs_.request().goal() == nullptr) {
      activity_.forget(tick.time);
    }
  }
}

bool Controller::Impl::follow_arm(const Tick& tick) noexcept {
  const bool begins = measured_.begins();
  if (begins) {
    begin_motion();
  }
  const Eigen::VectorXd &q = measured_.position(), &v = measured_.velocity();
  const double lead = tracker_.drives_track() ? 0.0 : tick.lead();
  command_.tracking_error = begins ? 0.0 : (reference_.next_q - lead * reference_.next_v - q).cwiseAbs().maxCoeff();
  reference_.go_on();
  const bool yields = touch_.is_touched() && tracker_.yield(q, dynamics_.mass(), touch_.resistance(), tick, reference_);
  if (yields) {
    guard_.reset();
  }
  if (begins || yields) {
    reference_.keep_viable(model.arm.robot().limits(), model.settings, tick.period);
  }
  tracker_.write_coupling(reference_, q, tick, state_.coupling);
  const bool apart = reference_.q != q || reference_.v != v;
  if (apart && !begins) {
    measured_.filter_velocity(last_.acceleration, tick);
  }
  return apart;
}

void Controller::Impl::judge_touch(const Tick& tick) noexcept {
  const bool touches = touch_.judge({measured_.position(), measured_.velocity(), tick.moved, measured_.begins() || tick.gap,
                                     measured_.bridges_sample(), !tick.is_as_expected()},
                                    {last_.torque, dynamics_.mass(), dynamics_.model_bias()});
  if (touches) {
    measured_.restart();
    dynamics_.hold(touch_.explained_load());
  }
}

void Controller::Impl::begin_motion() noexcept {
  const Eigen::VectorXd &q = measured_.position(), &v = measured_.velocity();
  const bool anew = measured_.was_known();
  measured_.begun();
  reference_.begin(q, v, anew && tracker_.drives_track());
  guard_.reset();
  if (model.torque && last_.has_torque) {
    reference_.torque = last_.torque;
  } else if (dynamics_.has_model()) {  // what has held the arm until now, nobody knows: what would hold it
    dynamics_.write_bias(q, v, reference_.torque);
    const double left = 1.0 - model.settings.effort_margin;  // more than there is has held it no more than all there is
    const Eigen::VectorXd& effort = model.arm.robot().limits().effort;
    reference_.torque = reference_.torque.cwiseMax(-left * effort).cwiseMin(left * effort);
    last_.torque = reference_.torque;
    last_.has_torque = true;
  }
  if (anew) {
    last_.acceleration.setZero();
    dynamics_.begin_at(v);
    inputs_.begin_anew();
    look_ahead_.begin_anew();
    distances_.forget();
    state_.findings = {};
    tracker_.begin_anew();
    state_.next_look = 0.0;
  }
}

InputsStage::Moment Controller::Impl::moment(const NearReference& near, const Tick& tick) const noexcept {
  return {
      reference_,  measured_.position(),      sources_.obstacles(), near, tick, pace(tick), measured_.agrees_with_reference(),
      must_rest(), look_ahead_.is_followed(), state_.findings};
}

void Controller::Impl::update_activation_distances(bool looks, const Obstacles& obstacles) noexcept {
  const GoalFollower& goal = inputs_.goal();
  if (looks) {
    sources_.look_for_movers(reference_.q);
    if (obstacles.tree().moves()) {
      guard_.invalidate();
    }
  }
  if (!model.settings.local_activation) {
    return;
  }
  if (sources_.has_movers() || !goal.is_led_to_target()) {
    if (looks) {
      distances_.take(model.system->activations());
    }
  } else if (model.settings.synchronous) {
    if (looks) {
      goal.write_places(state_.places);
      distances_.update(state_.places, obstacles, state_.findings.blocked);
    }
  } else {
    taken_.activations = worker_.activations().update() ? &worker_.activations().current() : nullptr;
    if (taken_.activations != nullptr || looks) {
      const FoundActivations& found = worker_.activations().current();
      const bool ours = found.request_number == inputs_.request().number() && found.posture_attempt == goal.attempt();
      distances_.take(ours ? found.values : model.system->activations());
      state_.findings.blocked = ours && found.target_blocked;
    }
  }
}

void Controller::Impl::look_ahead(const Goal& followed, const Tick& tick, const Obstacles& obstacles) noexcept {
  const ControllerSettings& settings = model.settings;
  GoalFollower& goal = inputs_.goal();
  const TrajectoryRequest* const trajectory = inputs_.request().trajectory();
  if (settings.synchronous) {
    board_.guarded([&] {
      look_ahead_.pursue(followed, reference_, obstacles, tick, [&] {
        if (inputs_.input().is_followed() && trajectory != nullptr) {
          return leader_along(settings, trajectory->path, inputs_.trajectory().time(), inputs_.trajectory().rate());
        }
        return goal.has_planner() && goal.is_led_to_target() && &followed == goal.led_goal()
                   ? leader_along(settings, *goal.planner(), goal.planner()->following())
                   : LookAhead::Leader();
      });
    });
    if (!settings.speed_limits) {
      goal.limit_pace(pace(tick));
    }
    return;
  }
  if (look_ahead_.is_on()) {
    taken_.trajectory = look_ahead_.follow(tick);
  }
  look_ahead_.judge_age(tick.time, sources_.has_movers());
  command_.background.planner_age = goal.planner_age(tick.time);
  command_.background.look_ahead_age = look_ahead_.age();
  command_.background.pace = look_ahead_.current_pace();
  if (!settings.speed_limits) {
    goal.limit_pace(pace(tick));
  }
}

double Controller::Impl::pace(const Tick& tick) const noexcept {
  const bool has_rate = model.torque && model.arm.robot().limits().effort_rate.minCoeff() < infinity;
  return std::min(look_ahead_.current_pace(), has_rate ? tick.speed_share() : 1.0);
}

Lead Controller::Impl::lead(const Goal& followed, bool stale, const Tick& tick) const noexcept {
  const InputTarget& input = inputs_.input();
  const bool avoids = look_ahead_.is_followed();
  // Paths, trajectories and velocities are slowed themselves; what leads straight is damped.
  const bool slows_itself = input.is_followed() || inputs_.goal().is_on_path(&followed);
  return {avoids                ? look_ahead_.target()
          : input.is_followed() ? input.attraction()
                                : followed,
          avoids ? &look_ahead_.followed() : nullptr, inputs_.keeps_path() ? &input.desired_acceleration() : nullptr,
          slows_itself ? 1.0 : pace(tick), stale || !measured_.agrees_with_reference()};
}

ProgramStatus Controller::Impl::solve(const Eigen::VectorXd& wanted, bool apart, const Goal& followed, const ToldDynamics& told,
                                      const Tick& tick) noexcept {
  SecondState second;
  if (apart && attractor_.look_at_arm(measured_.position(), measured_.velocity(), sources_.obstacles(), sources_.closing())) {
    second = {&attractor_.arm_clearances(), &measured_.velocity()};
  }
  const KinematicState &at_reference = attractor_.at_reference().state(), &at_arm = arm_state(apart);
  if (dynamics_.has_model()) {
    dynamics_.update_gravity(at_arm, !measured_.was_known());
  }
  const std::optional<double> path_speed =
      speed_.update(at_reference, at_arm, measured_.position(), sources_.obstacles(), measured_.was_known(), tick, command_);
  if (path_speed && &followed == inputs_.goal().led_goal()) {
    inputs_.goal().limit_speed(*path_speed, pace(tick), speed_.frames());
  }
  LastCommand last{&reference_.smooth_a};
  if (model.torque) {
    last = near_last(reference_.smooth_a, last_.has_torque ? &reference_.torque : nullptr, dynamics_, 1.0, true);
    last.early = !look_ahead_.is_followed();
    // The arm's own mass matrix is that where it is: the reference's is the model's, where there is one.
    dynamics_.update(at_reference, !apart || !dynamics_.has_model() ? told : ToldDynamics{});
  }
  const ProgramStatus status = program_.solve(reference_.q, reference_.v, wanted, dynamics_, &attractor_.clearances(), second,
                                              last, tick, solution_, speed_.at_reference());
  if (model.torque) {
    reference_.torque = solution_.torque;
  }
  return status;
}

ProgramStatus Controller::Impl::guard(ProgramStatus solved, const Tick& tick) noexcept {
  // Beside what moves a stop would only wait for it; and the way out of what is lost comes before the jerk.
  if (sources_.has_movers() || look_ahead_.is_followed() || solution_.least_clearance < 0.0 ||
      !solution_.acceleration.allFinite()) {
    guard_.reset();
    return solved;
  }
  const StopTorque torque{dynamics_.mass(), dynamics_.bias(), program_.jerk_share(tick)};
  const GuardedMotion now{reference_.q, reference_.v, reference_.smooth_a, tick.period,
                          tick.is_as_expected() && !state_.told.is};
  if (!guard_.keep(now, sources_.obstacles(), model.torque ? &torque : nullptr, solution_.acceleration)) {
    return solved;
  }
  solution_.slack.setZero();
  std::fill(solution_.active.begin(), solution_.active.end(), Limit::none);
  if (model.torque) {
    torque.of(solution_.acceleration, solution_.torque);
    reference_.torque = solution_.torque;
  }
  return ProgramStatus::limited;
}

ProgramStatus Controller::Impl::track(ProgramStatus solved, bool apart, double tracking_error, const ToldDynamics& told,
                                      const Tick& tick) noexcept {
  if (!apart || tracker_.drives_track()) {
    tracker_.follow(solution_);
    return solved;
  }
  if (model.torque) {
    dynamics_.update(attractor_.at_arm().state(), told);
  }
  return tracker_.track(
      reference_, {measured_.position(), measured_.velocity(), attractor_.arm_clearances(), dynamics_, last_, speed_.at_arm()},
      tracking_error, solved, tick);
}

const Command& Controller::Impl::stop(ConstVectorRef q, ConstVectorRef v, const ToldDynamics& told, const Tick& tick) noexcept {
  const bool reference_goes_on = tracker_.drives_track() && measured_.was_known();
  if (reference_goes_on) {  // drives follow the reference, wherever the arm is: it comes to rest
    const bool q_known = q.size() == reference_.q.size() && q.allFinite() && measured_.what_is_impossible().joint < 0;
    reference_.hold(model.settings.output, tick);
    reference_.go_on();
    state_.wanted = -reference_.v / model.settings.stop_time;
    static_cast<void>(program_.solve(reference_.q, reference_.v, state_.wanted, dynamics_, nullptr, {},
                                     LastCommand{&reference_.smooth_a}, tick, tracker_.solution()));
    solution_.acceleration = tracker_.solution().acceleration;
    solution_.fault = q_known ? ProgramFault::velocity : ProgramFault::position;
    state_.program = ProgramStatus::fallback_invalid_input;
    guard_.reset();
    reference_.advance(solution_.acceleration, false, model.arm.robot().limits().jerk, tick.period);
  } else {
    const Eigen::VectorXd none;
    const bool is_impossible = measured_.what_is_impossible().joint >= 0;  // no number of it is used
    state_.wanted.setZero();
    if (!tick.goes_on() && q.size() == v.size() && v.size() == state_.wanted.size() && v.allFinite()) {
      state_.wanted = -v / model.settings.stop_time;
    }
    state_.program = program_.stop(is_impossible ? ConstVectorRef(none) : q, is_impossible ? ConstVectorRef(none) : v,
                                   state_.wanted, told, dynamics_, last_.has_torque ? &last_.torque : nullptr, tick, solution_);
    state_.program = std::max(state_.program, ProgramStatus::fallback_invalid_input);
    tracker_.follow(solution_);
  }
  report_stop(tick);
  measured_.end_without_state(!reference_goes_on);
  if (last_.has_torque) {
    last_.torque = command_.torque;
  }
  clock_.end_step();
  return command_;
}

void Controller::Impl::tell_worker(const Goal& followed, double time, bool wakes) noexcept {
  const CurrentRequest& request = inputs_.request();
  const GoalFollower& goal = inputs_.goal();
  Snapshot& s = worker_.draft();
  s.time = time;
  s.q = reference_.q;
  s.v = reference_.v;
  s.request_number = request.number();
  s.posture_attempt = goal.attempt();
  s.world_number = sources_.handed_over();
  s.motion = sources_.motion();
  s.by_pose = &followed == &inputs_.destination();
  s.trajectory.is = inputs_.input().is_followed() && request.trajectory() != nullptr;
  if (s.trajectory.is) {
    s.trajectory.q = inputs_.trajectory().begin_position();
    s.trajectory.v = inputs_.trajectory().begin_velocity();
    s.trajectory.clock = inputs_.trajectory().time();
    s.trajectory.rate = inputs_.trajectory().rate();
  }
  s.request_age = request.age();
  if (const auto* joint = std::get_if<JointGoal>(&followed)) {
    s.followed = *joint;
  }
  s.following = goal.following(&followed);
  goal.write_places(s.places);
  if (sources_.has_movers()) {
    s.places.num = 0;
  }
  s.avoiding = look_ahead_.is_followed();
  s.flight = look_ahead_.followed();
  s.written = std::chrono::steady_clock::now();
  worker_.tell(wakes);
}

}  // namespace sidestep

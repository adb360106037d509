#include "inputs_stage.hpp"

namespace sidestep {

InputsStage::InputsStage(RequestBoard& board, const ClearanceQuery& body, const Robot& robot, const JointKinds& joints,
                         const ControllerSettings& settings, const UsableLimits& usable,
                         const std::vector<Eigen::Index>& clearances, const std::optional<RigidBodyDynamics>& dynamics,
                         bool works)
    : settings_(settings),
      request_(board.requests()),
      input_(robot.limits(), settings),
      velocity_(robot, joints, settings, usable, clearances),
      trajectory_(body, robot.limits(), joints, settings, usable),
      goal_(body, settings, joints, dynamics, board, works) {}

bool InputsStage::update(const Tick& tick) noexcept {
  goal_.begin_step();
  const bool is_another = request_.update(tick.elapsed);
  if (is_another) {
    goal_.leave(request_.goal() != nullptr);
  }
  return is_another;
}

InputsStage::Target InputsStage::target(const Moment& now) noexcept {
  const Eigen::VectorXd& q = now.reference.q;
  if (!now.agrees) {  // what was told begins once the arm is known to be there
    input_.clear();
    return {&goal_.rest_at(q), false, now.findings};
  }
  if (request_.begins_input()) {
    begin_input(now);
  }
  input_.clear();
  if (request_.has_input() && !now.stale) {
    follow_input(now);
  }
  const GoalFollower::Moment moment{now.reference, now.arm_q, now.obstacles, now.tick, request_.number()};
  const bool is_another_way = goal_.begins_goal() && goal_.begin(own_destination(), request_.moves(), moment);
  TargetFindings findings = is_another_way ? TargetFindings{} : now.findings;
  if (!request_.is_any() || now.stale) {
    return {&goal_.rest_at(q), is_another_way, findings};
  }
  if (request_.moves()) {
    return {&destination(), is_another_way, findings};
  }
  const Goal& led = goal_.lead(request_.pose_goal(), moment, now.avoids, findings);
  return {&led, is_another_way, findings};
}

void InputsStage::begin_input(const Moment& now) noexcept {
  request_.begun();
  if (auto* trajectory = std::get_if<TrajectoryRequest>(&request_.request())) {
    velocity_.end();
    trajectory_.begin(*trajectory, now.reference);
  } else {
    velocity_.begin(request_.request(), now.near);
  }
}

void InputsStage::follow_input(const Moment& now) noexcept {
  const TrajectoryRequest* const trajectory = request_.trajectory();
  if (trajectory == nullptr) {
    velocity_.follow(request_.request(), is_fresh(), now.pace, now.reference, now.near, now.tick, input_);
  } else if (!trajectory_.follow(*trajectory, request_.age(), now.pace, now.reference, now.obstacles, now.tick, input_)) {
    request_.stand();  // from now on a goal like others
    goal_.begin_next();
  }
}

bool InputsStage::is_under_way() const noexcept {
  return request_.has_input() && request_.trajectory() != nullptr &&
         (request_.begins_input() || !trajectory_.has_ended(*request_.trajectory()));
}

double InputsStage::judge_deviation(const Reference& reference) noexcept {
  const TrajectoryRequest* const trajectory = request_.trajectory();
  return trajectory == nullptr || request_.begins_input() ? 0.0 : trajectory_.judge_deviation(*trajectory, reference.q);
}

bool InputsStage::judge(const Moment& now, const Eigen::VectorXd& wanted, double deviation, Eigen::VectorXd& change) noexcept {
  const TrajectoryRequest* const trajectory = request_.trajectory();
  if (!request_.has_input() || request_.begins_input() || (trajectory == nullptr && !is_fresh())) {
    velocity_.rest();
    return false;
  }
  const bool is_led_off = now.stale || (now.avoids);
  if (trajectory != nullptr) {
    change = now.reference.next_v;
    if (!trajectory_.has_ended(*trajectory)) {
      change -= trajectory_.path_velocity();
    }
    return is_led_off || trajectory_.is_slowed() || trajectory_.is_off(deviation);
  }
  if (const TwistRequest* const twist = request_.twist(); twist != nullptr && now.stale) {  // it was not solved
    velocity_.solve_again(*twist, now.reference, now.near);
  }
  velocity_.write_change(request_.request(), now.reference.next_v, change);
  const bool less = velocity_.judge(request_.request(), now.reference, wanted, now.tick);
  return is_led_off || less;
}

void InputsStage::begin_anew() noexcept {
  velocity_.begin_anew();
  trajectory_.begin_anew();
  goal_.begin_anew(request_.is_any() && !request_.has_input());
}

void InputsStage::go_on_from(InputsStage& before) noexcept {
  request_.go_on_from(before.request_);
  input_.go_on_from(before.input_);
  velocity_.go_on_from(before.velocity_);
  trajectory_.go_on_from(before.trajectory_);
  goal_.go_on_from(before.goal_, request_.is_any() && !request_.moves());
}

}  // namespace sidestep

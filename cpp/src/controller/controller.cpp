#include "sidestep/controller/controller.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>

#include "../settings.hpp"
#include "impl.hpp"
#include "sidestep/embedding/clearance_barrier.hpp"
#include "sidestep/embedding/clearance_table_barrier.hpp"
#include "sidestep/embedding/joint_limit_barrier.hpp"
#include "sidestep/embedding/self_collision_barrier.hpp"

namespace sidestep {
namespace {

constexpr double default_look_period = 0.02;  // [s] of looks at places where there is no planner
constexpr double near_moving = 0.1;           // [m] of the arm: an obstacle that moves takes room at places away
constexpr double foresight = 1.0;             // [s] in which it could be as near
// The pose itself draws within 1 mm and 5 mrad, until it is 2 cm or 0.1 rad away; else the posture does.
constexpr double enter_position = 1e-3, enter_rotation = 5e-3, leave_position = 2e-2, leave_rotation = 1e-1;
constexpr double pose_position_share = 2.0, pose_rotation_share = 0.5;  // of the stiffness, per m² and per rad²
constexpr std::uint64_t most_posture_attempts = 12;
constexpr int periods_late = 1000;            // a trajectory is moved on by at most so many at once
constexpr double limit_rounding = 1e-9;       // [rad | m] of a goal at a limit

std::shared_ptr<const GeometricSystem> make_system(const Arm& arm, const BarrierSettings& b) {
  const Robot& robot = arm.robot();
  const int nv = robot.num_coordinates();
  std::vector<std::shared_ptr<const Embedding>> parts;
  parts.push_back(std::make_shared<ClearanceBarrier>(
      robot, arm.body(), BarrierFunction{b.activation, b.strength, b.power, b.floor}, b.temperature));
  if (robot.limits().lower.array().isFinite().any() || robot.limits().upper.array().isFinite().any()) {
    parts.push_back(std::make_shared<JointLimitBarrier>(
        robot, BarrierFunction{b.limit_activation, b.limit_strength, b.power, std::min(b.floor, 0.5 * b.limit_activation)}));
  }
  const BarrierFunction self{b.self_activation, b.self_strength, b.power, b.floor};
  if (!arm.tables().empty()) {
    parts.push_back(std::make_shared<ClearanceTableBarrier>(robot, arm.tables(), self));
  }
  if (!arm.pairs().empty()) {
    parts.push_back(std::make_shared<SelfCollisionBarrier>(robot, arm.body(), arm.pairs(), self, b.temperature));
  }
  GeometricSystemSettings settings;
  settings.stiffness = b.stiffness * Eigen::MatrixXd::Identity(nv, nv);
  settings.damping = b.damping * Eigen::MatrixXd::Identity(nv, nv);
  settings.pull_form = PullForm::one_sided;
  return std::make_shared<GeometricSystem>(robot, std::move(parts), std::move(settings));
}

std::unique_ptr<Guide> make_guide(const BodyClearance& body, const ControllerSettings& settings) {
  if (!settings.planner) {
    return nullptr;
  }
  GuideSettings guide;
  guide.planner = settings.planner->search;
  guide.route = settings.planner->route;
  guide.period = settings.planner->period;
  guide.patience = settings.planner->patience;
  guide.retry = settings.planner->retry;
  guide.seed = settings.seed;
  guide.synchronous = settings.synchronous;
  return std::make_unique<Guide>(body, guide);
}

bool use_torque(const Arm& arm, ControllerSettings::Output output) {
  const bool possible = arm.has_dynamics() && arm.robot().limits().effort.allFinite();
  if (output == ControllerSettings::Output::torque && !arm.robot().limits().effort.allFinite()) {
    throw std::invalid_argument("controller: output is torque, but arm '" + arm.name() +
                                "' has joints without an effort limit; give effort limits, or ask for acceleration");
  }
  return output == ControllerSettings::Output::torque || (output == ControllerSettings::Output::automatic && possible);
}

EscapeSettings seeded(EscapeSettings settings, std::uint64_t seed) {
  settings.seed = seed;
  return settings;
}

Flight at_rest(const Arm& arm) {
  const Eigen::VectorXd q = Eigen::VectorXd::Zero(arm.num_coordinates());
  return Flight(arm.robot().limits(), q, q, q);
}

}  // namespace

Controller::Impl::Snapshot::Snapshot(const Arm& arm, const Flight& flight)
    : q(Eigen::VectorXd::Zero(arm.num_coordinates())),
      v(q),
      followed(q),
      places(Eigen::MatrixXd::Zero(q.size(), RouteFollower::most_places + 1)),
      trajectory(flight) {}

Controller::Impl::Impl(Arm a, ControllerSettings s)
    : arm(std::move(a)),
      settings((s.validate(), std::move(s))),
      system(make_system(arm, settings.barriers)),
      workspace(*system),
      solution(arm.num_coordinates(), settings.safety.max_rows),
      command(arm.num_coordinates()),
      torque(use_torque(arm, settings.output)),
      goal_orders_(GoalOrder{}),
      obstacle_orders_(ObstacleOrder{}),
      snapshots_(Snapshot(arm, at_rest(arm))),
      activations_(Activations{0, system->activations()}),
      postures_(FoundPosture{0, 0, {Eigen::VectorXd::Zero(arm.num_coordinates()), 0.0, 0.0}}),
      trajectories_(FoundTrajectory{0.0, 0, false, at_rest(arm)}),
      shown_obstacles_(std::make_shared<const Obstacles>(Obstacles::none())),
      body_(arm.robot(), arm.body(), arm.pairs(), {}, arm.tables()),
      here_(body_),
      q_(Eigen::VectorXd::Zero(arm.num_coordinates())),
      v_(q_),
      last_q_(q_),
      wanted_(q_),
      turns_(q_),
      mass_(Eigen::MatrixXd::Identity(q_.size(), q_.size())),
      bias_(q_),
      is_sliding_(static_cast<std::size_t>(q_.size()), false),
      is_unlimited_(static_cast<std::size_t>(q_.size()), false),
      target_(q_),
      attractor_(q_.size()),
      reference_(JointGoal(q_)),
      refuge_(JointGoal(q_)),
      trajectory_(at_rest(arm)),
      places_(Eigen::MatrixXd::Zero(q_.size(), RouteFollower::most_places + 1)),
      lowered_places_(places_),
      room_(*system),
      worker_workspace_(*system),
      look_period_(settings.planner ? settings.planner->period : default_look_period) {
  guide = make_guide(body_, settings);
  if (torque) {
    TorqueControllerSettings program;
    program.period = settings.period;
    program.safety = settings.safety;
    program.position_margin = settings.position_margin;
    program.stop_time = settings.stop_time;
    program.stop_damping = settings.stop_damping;
    program.torque_weight.setConstant(settings.torque_weight);
    program.slack_weight = settings.slack_weight;
    program.safety_weight = settings.safety_weight;
    torque_program_.emplace(arm.robot(), program);
    if (arm.has_dynamics()) {
      dynamics_.emplace(arm.dynamics());
      dynamics_workspace_.emplace(*dynamics_);
    }
  } else {
    filter_.emplace(arm.robot(), AccelerationFilterSettings{settings.period, settings.position_margin, settings.stop_time,
                                                            settings.safety});
  }
  if (settings.local_minimum) {
    escape_.emplace(arm.robot(), seeded(*settings.local_minimum, settings.seed));
  }
  if (settings.look_ahead) {
    EvasionSettings look = *settings.look_ahead;
    look.seed = settings.seed;
    evasion_ = std::make_unique<Evasion>(system, look);
  }
  ends_.emplace(body_, settings.planner ? settings.planner->search : PlannerSettings{});
  std::vector<bool> turns(static_cast<std::size_t>(q_.size()), true);
  for (const Joint& joint : arm.robot().joints()) {
    const auto j = static_cast<std::size_t>(joint.coordinate);
    is_sliding_[j] = is_sliding_[j] || joint.type == JointType::prismatic;
    turns[j] = turns[j] && joint.type == JointType::revolute && std::abs(joint.multiplier) == 1.0;
  }
  for (Eigen::Index j = 0; j < q_.size(); ++j) {
    is_unlimited_[static_cast<std::size_t>(j)] = turns[static_cast<std::size_t>(j)] &&
                                                 arm.robot().limits().lower[j] == -infinity &&
                                                 arm.robot().limits().upper[j] == infinity;
  }
  for (std::size_t k = 0; k < system->labels().size(); ++k) {
    if (system->labels()[k].kind != CoordinateLabel::Kind::joint_limit) {
      metric_coordinates_.push_back(static_cast<Eigen::Index>(k));
    }
  }
  if (!settings.synchronous) {
    thread_ = std::thread([this] { run(); });
  }
}

Controller::Impl::~Impl() {
  stopping_.store(true);
  wake_.release();
  if (thread_.joinable()) {
    thread_.join();
  }
}

void Controller::Impl::set_goal(std::optional<Goal> goal) {
  if (goal) {
    const Robot& robot = arm.robot();
    const GoalFault fault = check(*goal, robot);
    if (fault == GoalFault::invalid) {
      throw std::invalid_argument("controller: the goal must be finite, of " + std::to_string(robot.num_coordinates()) +
                                  " coordinates, and made for arm '" + robot.name() + "'");
    }
    if (fault == GoalFault::outside_limits) {
      const Eigen::VectorXd& position = std::get<JointGoal>(*goal).position;
      for (Eigen::Index j = 0; j < position.size(); ++j) {
        const double lower = robot.limits().lower[j], upper = robot.limits().upper[j];
        if (position[j] < lower - limit_rounding || position[j] > upper + limit_rounding) {
          throw std::invalid_argument("controller: goal: joint '" + robot.coordinate_names()[static_cast<std::size_t>(j)] +
                                      "' is " + std::to_string(position[j]) + ", allowed: " + std::to_string(lower) + " to " +
                                      std::to_string(upper));
        }
      }
    }
    if (auto* joint = std::get_if<JointGoal>(&*goal)) {
      joint->position = joint->position.cwiseMax(robot.limits().lower).cwiseMin(robot.limits().upper);
    } else {
      PoseGoal& pose = std::get<PoseGoal>(*goal);
      pose.settings.position_stiffness = pose_position_share * settings.barriers.stiffness;
      pose.settings.orientation_stiffness = pose_rotation_share * settings.barriers.stiffness;
    }
  }
  const std::lock_guard lock(mutex_);
  shown_goal_ = goal;
  shown_posture_.reset();
  goal_orders_.put({++goal_count_, std::move(goal)});
}

void Controller::Impl::set_obstacles(Obstacles obstacles) {
  auto copy = std::make_shared<const Obstacles>(obstacles);
  if (guide && !settings.synchronous) {
    guide->set_obstacles(*copy);
  }
  const std::lock_guard lock(mutex_);
  shown_obstacles_ = std::move(copy);
  obstacle_orders_.put({++obstacle_count_, std::move(obstacles)});
}

const Command& Controller::Impl::step(ConstVectorRef q, ConstVectorRef v, const Eigen::Ref<const Eigen::MatrixXd>* mass_matrix,
                                      const Eigen::Ref<const Eigen::VectorXd>* bias) noexcept {
  time_ = static_cast<double>(++tick_) * settings.period;
  const bool known = take_state(q, v);
  take_orders();
  if (!known) {
    wanted_.setZero();
    solve(mass_matrix, bias, false, q, v);
    report(false);
    return command;
  }
  const bool looks = time_ >= next_look_;
  if (looks) {
    next_look_ = time_ + look_period_ - 0.5 * settings.period;
    if (settings.synchronous && guide) {
      guide->set_obstacles(obstacles());
    }
  }
  choose_reference();
  leave_room(looks);
  avoid();
  const Goal& goal = avoiding_ ? refuge_ : *followed_;
  const StepStatus status = system->acceleration(q_, v_, goal, obstacles(), workspace);
  command.system = status;
  wanted_ = workspace.acceleration;
  if (avoiding_ && !is_fallback(status)) {
    trajectory_.acceleration(q_, v_, settings.period, wanted_);
  }
  if (command.activity == Activity::stale) {
    wanted_ = -v_ / settings.stop_time;
  }
  solve(mass_matrix, bias, true, q_, v_);
  report(true);
  if (looks && !settings.synchronous) {
    write_snapshot();
  }
  known_before_ = true;
  last_q_ = q_;
  return command;
}

bool Controller::Impl::take_state(ConstVectorRef q, ConstVectorRef v) noexcept {
  if (q.size() != q_.size() || v.size() != q_.size() || !q.allFinite() || !v.allFinite()) {
    return false;
  }
  q_ = q;
  v_ = v;
  for (Eigen::Index j = 0; j < q_.size(); ++j) {
    if (!is_unlimited_[static_cast<std::size_t>(j)]) {
      continue;
    }
    // An encoder that wraps at a turn: no velocity explains a jump of more than half of one.
    q_[j] += turns_[j];
    if (known_before_) {
      const double turn = 2.0 * std::numbers::pi * std::round((last_q_[j] - q_[j]) / (2.0 * std::numbers::pi));
      turns_[j] += turn;
      q_[j] += turn;
    }
  }
  return true;
}

void Controller::Impl::take_orders() noexcept {
  if (obstacle_orders_.update()) {
    obstacle_age_ = 0.0;
  } else {
    obstacle_age_ += settings.period;
    obstacle_orders_.current().obstacles.advance(settings.period);
  }
  if (goal_orders_.update()) {
    GoalOrder& order = goal_orders_.current();
    goal_ = order.goal ? &*order.goal : nullptr;
    goal_number_ = order.number;
    has_target_ = posture_found_ = by_pose_ = false;
    target_blocked_ = false;
    posture_attempt_ = 0;
    moves_ = goal_ != nullptr && is_moving(*goal_);
    guide_status_ = GuideStatus::idle;
    num_lowered_ = -1;
    if (goal_ != nullptr && !moves_) {
      begin_goal();
    }
  } else if (goal_ != nullptr && moves_) {
    advance(*goal_, settings.period);
  }
}

void Controller::Impl::begin_goal() noexcept {
  if (auto* joint = std::get_if<JointGoal>(goal_)) {
    for (Eigen::Index j = 0; j < q_.size(); ++j) {
      if (is_unlimited_[static_cast<std::size_t>(j)]) {  // the nearest turn
        joint->position[j] += 2.0 * std::numbers::pi * std::round((q_[j] - joint->position[j]) / (2.0 * std::numbers::pi));
      }
    }
    target_ = joint->position;
    has_target_ = posture_found_ = true;
    if (guide) {
      guide->set_goal(target_);
    }
  } else if (settings.synchronous) {
    take_posture(search_posture(std::get<PoseGoal>(*goal_), q_, obstacles(), posture_attempt_));
  } else {
    wake_.release();
  }
}

void Controller::Impl::take_posture(const Posture& posture) noexcept {
  target_ = posture.q;
  has_target_ = true;
  posture_found_ = posture.found();
  if (guide) {
    guide->set_goal(target_);
  }
}

void Controller::Impl::choose_reference() noexcept {
  JointGoal& reference = std::get<JointGoal>(reference_);
  followed_ = &reference_;
  const auto rest_at = [&](const Eigen::VectorXd& q) {
    reference.position = q;
    reference.velocity.setZero();
    reference.acceleration.setZero();
  };
  const bool stale = obstacle_age_ > settings.obstacle_timeout;
  command.activity = stale ? Activity::stale : Activity::moving;
  if (!has_goal() || stale) {
    rest_at(q_);
    return;
  }
  if (moves_) {
    followed_ = goal_;
    return;
  }
  const PoseGoal* pose = pose_goal();
  if (pose != nullptr) {
    if (!settings.synchronous && postures_.update()) {
      const FoundPosture& found = postures_.current();
      if (found.goal_number == goal_number_ && found.attempt == posture_attempt_) {
        take_posture(found.posture);
      }
    }
    // A posture that no way leads to: another one.
    const bool fails = guide_status_ == GuideStatus::no_path || guide_status_ == GuideStatus::goal_in_collision;
    if (has_target_ && fails && posture_attempt_ < most_posture_attempts) {
      ++posture_attempt_;
      guide_status_ = GuideStatus::idle;
      if (settings.synchronous) {
        take_posture(search_posture(*pose, q_, obstacles(), posture_attempt_));
      } else {
        has_target_ = false;
      }
    }
    if (!has_target_) {
      rest_at(q_);
      return;
    }
  }
  if (guide) {
    guide_status_ = guide->step(q_, time_, attractor_);
    reference.position = attractor_.position;
    reference.velocity = attractor_.velocity;
    reference.acceleration = attractor_.acceleration;
  } else {
    rest_at(target_);
  }
  if (pose != nullptr && posture_found_ && known_before_) {
    const PoseError error = pose_error(*pose, workspace.state());
    by_pose_ = by_pose_ ? error.position < leave_position && error.rotation < leave_rotation
                        : error.position < enter_position && error.rotation < enter_rotation;
    if (by_pose_) {
      followed_ = goal_;
      return;
    }
  }
  const bool led = guide && guide_status_ != GuideStatus::no_path;
  if (escape_ && !led && !target_blocked_ && !avoiding_) {
    followed_ = &escape_->pursue(reference_, q_, std::numeric_limits<double>::quiet_NaN(), settings.period);
  }
}

void Controller::Impl::write_places(Eigen::MatrixXd& places, Eigen::Index& num) const noexcept {
  num = 0;
  if (!has_target_) {
    return;
  }
  if (guide) {
    places.leftCols(attractor_.num_places) = attractor_.places.leftCols(attractor_.num_places);
    num = attractor_.num_places;
    if (!attractor_.arrives) {
      return;
    }
  }
  places.col(num++) = target_;
}

void Controller::Impl::leave_room(bool looks) noexcept {
  if (!settings.local_activation) {
    return;
  }
  if (looks) {
    disturbed_ = body_.nearest_moving(q_, obstacles(), foresight, here_) < near_moving;
  }
  if (disturbed_ || !has_target_) {
    if (looks) {
      workspace.activations = system->activations();
      num_lowered_ = -1;
    }
    return;
  }
  if (settings.synchronous) {
    if (looks) {
      keep_room();
    }
  } else if (activations_.update() || looks) {
    const Activations& found = activations_.current();
    const bool ours = found.goal_number == goal_number_;
    workspace.activations = ours ? found.values : system->activations();
    target_blocked_ = ours && found.target_blocked;
  }
}

void Controller::Impl::keep_room() noexcept {
  write_places(places_, num_places_);
  const std::uint64_t version = obstacles().version();
  if (num_places_ == num_lowered_ && version == lowered_version_ &&
      places_.leftCols(num_places_) == lowered_places_.leftCols(num_places_)) {
    return;
  }
  target_blocked_ = lower_at(places_, num_places_, obstacles(), room_, workspace.activations);
  lowered_places_ = places_;
  num_lowered_ = num_places_;
  lowered_version_ = version;
}

bool Controller::Impl::lower_at(const Eigen::MatrixXd& places, Eigen::Index num, const Obstacles& around,
                                GeometricSystem::Workspace& w, Eigen::VectorXd& activations) const noexcept {
  activations = system->activations();
  bool inside = false;
  for (Eigen::Index k = 0; k < num; ++k) {
    static_cast<void>(system->lower_activations(places.col(k), around, w, activations));
    inside = false;
    for (const Eigen::Index i : metric_coordinates_) {
      inside = inside || w.clearances.values[i] < 0.0;
    }
  }
  return inside;
}

void Controller::Impl::avoid() noexcept {
  if (!evasion_) {
    return;
  }
  if (settings.synchronous) {
    const Evasion::Leader leader = evasion_->is_due(settings.period) && guide && followed_ == &reference_
                                       ? leader_of(guide->following())
                                       : Evasion::Leader{};
    const Flight* found = evasion_->pursue(*followed_, q_, v_, obstacles(), settings.period, leader);
    avoiding_ = found != nullptr;
    if (avoiding_) {
      trajectory_ = *found;
    }
  } else {
    if (avoiding_) {
      trajectory_.advance(settings.period);
    }
    pending_ = trajectories_.update() || pending_;
    const FoundTrajectory& found = trajectories_.current();
    const double late = time_ - (found.time + settings.look_ahead->delay);
    if (pending_ && late > -0.5 * settings.period) {
      pending_ = false;
      avoiding_ = found.avoid;
      if (avoiding_) {
        trajectory_ = found.trajectory;
        const int periods = std::min(periods_late, static_cast<int>(std::lround(late / settings.period)));
        for (int k = 0; k < periods; ++k) {
          trajectory_.advance(settings.period);
        }
      }
    }
  }
  if (avoiding_) {
    std::get<JointGoal>(refuge_).position = trajectory_.refuge();
  }
}

void Controller::Impl::solve(const Eigen::Ref<const Eigen::MatrixXd>* mass_matrix, const Eigen::Ref<const Eigen::VectorXd>* bias, bool known,
                             ConstVectorRef q, ConstVectorRef v) noexcept {
  const Clearances* clearances = known ? &workspace.clearances : nullptr;
  if (!torque) {
    command.program = filter_->apply(q, v, wanted_, clearances, solution);
    return;
  }
  if (mass_matrix != nullptr) {
    command.program = torque_program_->solve(q, v, wanted_, *mass_matrix, *bias, clearances, solution);
    return;
  }
  if (known && dynamics_) {
    dynamics_->mass_matrix(workspace.state(), *dynamics_workspace_, mass_);
    dynamics_->bias(workspace.state(), *dynamics_workspace_, bias_);
  }
  command.program = torque_program_->solve(q, v, wanted_, mass_, bias_, clearances, solution);
}

void Controller::Impl::report(bool known) noexcept {
  command.torque.setZero();
  if (torque) {
    command.torque = solution.torque;
  }
  command.wanted = wanted_;
  command.acceleration = solution.acceleration;
  if (!command.acceleration.allFinite()) {
    command.acceleration.setZero();
  }
  std::copy(solution.active.begin(), solution.active.end(), command.limits.begin());
  command.bound_by = solution.dominant < 0 ? -1 : solution.safety[static_cast<std::size_t>(solution.dominant)].coordinate;
  command.avoiding = avoiding_;
  command.on_path = guide && guide->following().route_number != 0 && has_target_;
  command.clearance = known ? infinity : std::numeric_limits<double>::quiet_NaN();
  command.coordinate = command.point = -1;
  if (!known) {
    command.status = SafetyStatus::stopping;
    command.system = StepStatus::invalid_state;
    command.velocity.setZero();
    command.position = last_q_ - turns_;
    return;
  }
  command.velocity = v_ + settings.period * command.acceleration;
  command.position = q_ - turns_ + settings.period * command.velocity;
  for (const Eigen::Index k : metric_coordinates_) {
    if (workspace.clearances.values[k] < command.clearance) {
      command.clearance = workspace.clearances.values[k];
      command.coordinate = static_cast<int>(k);
    }
  }
  if (command.coordinate >= 0 && system->labels()[static_cast<std::size_t>(command.coordinate)].kind ==
                                     CoordinateLabel::Kind::obstacle) {
    command.point = workspace.clearances.nearest[command.coordinate];
  }
  switch (command.program) {
    case TorqueStatus::ok: command.status = SafetyStatus::ok; break;
    case TorqueStatus::limited: command.status = SafetyStatus::limited; break;
    case TorqueStatus::relaxed: command.status = SafetyStatus::relaxed; break;
    case TorqueStatus::relaxed_safety: command.status = SafetyStatus::margin_lost; break;
    case TorqueStatus::fallback_invalid_input:
    case TorqueStatus::fallback_solver: command.status = SafetyStatus::stopping; break;
  }
  if (is_fallback(command.system)) {
    command.status = SafetyStatus::stopping;
  }
  if (command.clearance < 0.0) {
    command.status = SafetyStatus::clearance_lost;
  }
  command.activity = judge_activity();
}

bool Controller::Impl::at_goal() noexcept {
  const ArrivalSettings& near = settings.arrival;
  if (v_.cwiseAbs().maxCoeff() > near.speed) {
    return false;
  }
  if (const PoseGoal* pose = pose_goal()) {
    const PoseError error = pose_error(*pose, workspace.state());
    return error.position <= near.position && error.rotation <= near.rotation;
  }
  for (Eigen::Index j = 0; j < q_.size(); ++j) {
    const double error = std::abs(q_[j] - std::get<JointGoal>(*goal_).position[j]);
    if (!(error <= (is_sliding_[static_cast<std::size_t>(j)] ? near.sliding : near.joint))) {
      return false;
    }
  }
  return true;
}

Activity Controller::Impl::judge_activity() noexcept {
  if (command.activity == Activity::stale) {
    return Activity::stale;
  }
  if (!has_goal()) {
    return Activity::no_goal;
  }
  if (at_goal()) {
    return Activity::arrived;
  }
  if (command.system == StepStatus::invalid_goal || command.system == StepStatus::goal_outside_limits) {
    return Activity::blocked;
  }
  if (moves_) {
    return Activity::moving;
  }
  if (!has_target_) {
    return Activity::waiting;
  }
  const bool at_rest = v_.cwiseAbs().maxCoeff() < settings.arrival.speed;
  const bool out_of_reach = !posture_found_;
  const bool no_way = guide_status_ == GuideStatus::no_path || guide_status_ == GuideStatus::goal_in_collision ||
                      (!guide && target_blocked_);
  return at_rest && (no_way || out_of_reach) ? Activity::blocked : Activity::moving;
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
  if (const auto* joint = std::get_if<JointGoal>(followed_)) {
    s.followed = *joint;
  }
  s.following = guide && has_target_ && followed_ == &reference_ ? guide->following() : Guide::Following{};
  write_places(s.places, s.num_places);
  if (disturbed_) {
    s.num_places = 0;
  }
  s.avoiding = avoiding_;
  s.trajectory = trajectory_;
  snapshots_.submit();
}

Controller::Controller(Arm arm, ControllerSettings settings)
    : impl_(std::make_unique<Impl>(std::move(arm), std::move(settings))) {}
Controller::~Controller() = default;

Controller::Use::Use(Controller& controller) : controller_(&controller) {
  if (controller.in_use_.exchange(true, std::memory_order_acquire)) {
    throw std::runtime_error("the controller is in use: a RealTimeRun or another thread steps it; stop it first, or wait for its end");
  }
}

void Controller::set_goal(const Eigen::VectorXd& position) { impl_->set_goal(Goal(JointGoal(position))); }
void Controller::set_goal(Goal goal) { impl_->set_goal(std::move(goal)); }
void Controller::clear_goal() { impl_->set_goal(std::nullopt); }
void Controller::set_obstacles(Obstacles obstacles) { impl_->set_obstacles(std::move(obstacles)); }

const Command& Controller::step(ConstVectorRef q, ConstVectorRef v) noexcept { return impl_->step(q, v, nullptr, nullptr); }

const Command& Controller::step(ConstVectorRef q, ConstVectorRef v, Eigen::Ref<const Eigen::MatrixXd> mass_matrix,
                                ConstVectorRef bias) noexcept {
  return impl_->step(q, v, &mass_matrix, &bias);
}

const Command& Controller::command() const noexcept { return impl_->command; }
std::string Controller::explain() const { return impl_->explain(); }
const Arm& Controller::arm() const noexcept { return impl_->arm; }
const ControllerSettings& Controller::settings() const noexcept { return impl_->settings; }
const std::vector<CoordinateLabel>& Controller::labels() const noexcept { return impl_->system->labels(); }
const GeometricSystem& Controller::system() const noexcept { return *impl_->system; }
const GeometricSystem::Workspace& Controller::workspace() const noexcept { return impl_->workspace; }
const TorqueSolution& Controller::solution() const noexcept { return impl_->solution; }
Eigen::VectorXd Controller::target() const { return impl_->target(); }
Plan Controller::last_plan() const { return impl_->guide ? impl_->guide->last_plan() : Plan{}; }
Guide::Counts Controller::planner_counts() const { return impl_->guide ? impl_->guide->counts() : Guide::Counts{}; }
bool Controller::has_torque() const noexcept { return impl_->torque; }

}  // namespace sidestep

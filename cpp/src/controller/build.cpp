// A controller from an arm and settings: its parts, and the threads' beginning and end.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "../math/settings.hpp"
#include "impl.hpp"
#include "sidestep/attractor/clearance_barrier.hpp"
#include "sidestep/attractor/clearance_table_barrier.hpp"
#include "sidestep/clearance/holding_torque.hpp"
#include "sidestep/attractor/joint_limit_barrier.hpp"
#include "sidestep/attractor/self_collision_barrier.hpp"

namespace sidestep {
namespace {

constexpr double usable_acceleration = 0.9;  // of the limits, for velocities, twists and trajectories: the rest is for feedback
constexpr Eigen::Index most_held = 6;        // bounds that a twist is held by
constexpr double most_per_period = 0.2;      // of the feedback's frequency: a slow rate holds its torques for long
constexpr double default_look_period = 0.02;  // [s] of looks at places where there is no planner

/// Of joints whose torque may not hold the arm, as far as effort margins leave it; nothing without torque control.
std::optional<HoldingTorque> make_holding(const Arm& arm, const ControllerSettings& settings, bool torque) {
  if (!torque || !arm.has_dynamics()) {
    return std::nullopt;
  }
  const Eigen::VectorXd effort = (1.0 - settings.effort_margin) * arm.robot().limits().effort;
  HoldingTorque holding(arm.dynamics(), effort, settings.barriers.self_activation);
  return holding.loads().empty() ? std::nullopt : std::optional(std::move(holding));
}

std::shared_ptr<const GeometricSystem> make_system(const Arm& arm, const BarrierSettings& b,
                                                   const std::optional<HoldingTorque>& holding) {
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
  if (holding) {
    parts.push_back(std::make_shared<HoldingTorqueBarrier>(*holding, self));
  }
  GeometricSystemSettings settings;
  settings.stiffness = b.stiffness * Eigen::MatrixXd::Identity(nv, nv);
  settings.damping = b.damping * Eigen::MatrixXd::Identity(nv, nv);
  settings.pull_form = PullForm::one_sided;
  return std::make_shared<GeometricSystem>(robot, std::move(parts), std::move(settings));
}

std::unique_ptr<OnlinePlanner> make_guide(const Arm& arm, const BodyClearance& body, const ControllerSettings& settings,
                                          bool torque, bool works) {
  if (!settings.planner) {
    return nullptr;
  }
  OnlinePlannerConfig guide;
  guide.planner = settings.planner->search;
  guide.route = settings.planner->route;
  guide.route.speed = settings.speed;
  guide.safety = settings.safety;
  guide.period = settings.planner->period;
  guide.patience = settings.planner->patience;
  guide.retry = settings.planner->retry;
  guide.seed = settings.seed;
  if (torque && arm.has_dynamics()) {
    guide.dynamics.emplace(arm.dynamics());
  }
  guide.synchronous = settings.synchronous;
  guide.works = works;
  return std::make_unique<OnlinePlanner>(body, guide);
}

bool use_torque(const Arm& arm, ControllerSettings::Output output) {
  const bool possible = arm.has_dynamics() && arm.robot().limits().effort.allFinite();
  std::string without;
  for (int j = 0; j < arm.num_coordinates(); ++j) {
    if (!std::isfinite(arm.robot().limits().effort[j])) {
      without += (without.empty() ? "'" : ", '") + arm.robot().coordinate_names()[static_cast<std::size_t>(j)] + "'";
    }
  }
  if (output == ControllerSettings::Output::torque && !without.empty()) {
    throw std::invalid_argument("controller: output is torque, but arm '" + arm.name() + "' has no effort limit of " + without +
                                "; give them when it is loaded (effort_limits), or ask for acceleration");
  }
  return output == ControllerSettings::Output::torque || (output == ControllerSettings::Output::automatic && possible);
}

/// Less than the limits by what is left for noise, delay, rounding and what the model lacks; velocities of `speed` times theirs.
Robot within_margins(const Robot& robot, const ControllerSettings& settings, double speed) {
  JointLimits limits = robot.limits();
  const double left = 1.0 - settings.limit_margin;
  limits.velocity *= left * speed;
  limits.acceleration *= left;
  limits.jerk *= left;
  limits.effort_rate *= left;
  limits.effort *= 1.0 - settings.effort_margin;
  return Robot(robot.name(), robot.joints(), robot.frames(), robot.coordinate_names(), std::move(limits));
}

LocalMinimumSettings seeded(LocalMinimumSettings settings, std::uint64_t seed) {
  settings.seed = seed;
  return settings;
}

AvoidanceTrajectory at_rest(const Robot& robot) {
  const Eigen::VectorXd q = Eigen::VectorXd::Zero(robot.num_coordinates());
  return AvoidanceTrajectory(robot.limits(), q, q, q);
}

}  // namespace

std::vector<bool> unlimited_joints(const Robot& robot) {
  const JointLimits& limits = robot.limits();
  std::vector<bool> unlimited(static_cast<std::size_t>(robot.num_coordinates()));
  for (Eigen::Index j = 0; j < limits.lower.size(); ++j) {
    unlimited[static_cast<std::size_t>(j)] = limits.lower[j] == -infinity && limits.upper[j] == infinity;
  }
  for (const Joint& joint : robot.joints()) {
    if (joint.type != JointType::revolute || std::abs(joint.multiplier) != 1.0) {
      unlimited[static_cast<std::size_t>(joint.coordinate)] = false;
    }
  }
  return unlimited;
}

Controller::Impl::Snapshot::Snapshot(const Arm& arm, const AvoidanceTrajectory& flight)
    : q(Eigen::VectorXd::Zero(arm.num_coordinates())),
      v(q),
      followed(q),
      begin_q(q),
      begin_v(q),
      places(Eigen::MatrixXd::Zero(q.size(), TimedPathFollower::most_places + 1)),
      trajectory(flight) {}

StepState::StepState(const Robot& robot)
    : q_(Eigen::VectorXd::Zero(robot.num_coordinates())),
      v_(q_),
      a_(q_),
      wanted_(q_),
      smooth_a_(q_),
      next_q_(q_),
      next_v_(q_),
      arm_q_(q_),
      arm_v_(q_),
      last_arm_q_(Eigen::VectorXd::Constant(q_.size(), std::numeric_limits<double>::quiet_NaN())),
      last_arm_v_(q_),
      turns_(q_),
      measurement_{q_, q_, q_, q_, q_, q_, q_},
      drift_(q_),
      reference_torque_(q_),
      last_torque_(q_),
      last_acceleration_(q_),
      expected_v_(q_),
      last_measured_v_(q_),
      coupling_(q_),
      feedback_(q_),
      gravity_(q_),
      gravity_change_(q_),
      model_mass_(Eigen::MatrixXd::Zero(q_.size(), q_.size())),
      model_bias_(q_),
      mass_(Eigen::MatrixXd::Constant(q_.size(), q_.size(), std::numeric_limits<double>::quiet_NaN())),
      mass_cholesky_(Eigen::MatrixXd::Zero(q_.size(), q_.size())),
      bias_(q_),
      target_(q_),
      reference_(JointGoal(q_)),
      avoidance_goal_(JointGoal(q_)),
      input_goal_(JointGoal(q_)),
      input_pull_(JointGoal(q_)),
      wanted_v_(q_),
      last_wanted_v_(q_),
      pulled_(q_),
      ideal_v_(q_),
      begin_q_(q_),
      begin_v_(q_),
      path_q_(q_),
      path_v_(q_),
      path_a_(q_),
      trajectory_(at_rest(robot)) {}

Controller::Impl::Impl(Arm a, ControllerSettings s, Command& c, bool workers)
    : StepState(a.robot()),
      arm(std::move(a)),
      settings((s.validate(), std::move(s))),
      torque(use_torque(arm, settings.output)),
      holding_(make_holding(arm, settings, torque)),
      system(make_system(arm, settings.barriers, holding_)),
      workspace(*system),
      solution(arm.num_coordinates(), settings.safety.max_rows),
      command(c),
      goal_orders_(GoalOrder{}),
      obstacle_orders_(ObstacleOrder{}),
      snapshots_(Snapshot(arm, trajectory_)),
      activations_(Activations{0, 0, system->activations()}),
      postures_(FoundPosture{0, 0, {Eigen::VectorXd::Zero(arm.num_coordinates()), 0.0, 0.0}}),
      trajectories_(FoundTrajectory{0.0, 0, false, trajectory_}),
      measured_(last_arm_q_),
      shown_obstacles_(std::make_shared<const Obstacles>(Obstacles::none())),
      body_(arm.robot(), arm.body(), arm.pairs(), {}, arm.tables(), holding_),
      here_(body_),
      plausible_(arm.robot(), body_.reach()),
      unknown_(Eigen::VectorXd::Constant(q_.size(), std::numeric_limits<double>::quiet_NaN())),
      failsafe_(body_, within_margins(arm.robot(), settings, settings.speed).limits(), settings.safety.margin, settings.period),
      closing_(arm.robot(), arm.body(), settings.barriers.temperature, settings.safety.margin),
      corrected_(static_cast<int>(q_.size()), system->num_embedding_coordinates()),
      arm_corrected_(corrected_),
      drives_track_(settings.output == ControllerSettings::Output::position ||
                    settings.output == ControllerSettings::Output::velocity),
      speed_rows_(arm.robot()),
      arm_speed_rows_(speed_rows_),
      leader_(arm.robot()),
      arm_workspace_(*system),
      tracked_(arm.num_coordinates(), settings.safety.max_rows),
      is_sliding_(static_cast<std::size_t>(q_.size()), false),
      is_unlimited_(unlimited_joints(arm.robot())),
      path_reference_(q_.size()),
      held_v_(q_),
      held_(Eigen::MatrixXd::Zero(q_.size(), std::min<Eigen::Index>(q_.size(), most_held))),
      best_v_(q_),
      ahead_q_(q_),
      off_(q_),
      twist_state_(arm.robot()),
      ahead_(arm.robot()),
      jacobian_transposed_(Eigen::MatrixXd::Zero(q_.size(), 6)),
      projected_(jacobian_transposed_),
      jacobian_ahead_(jacobian_transposed_),
      most_v_(settings.speed * (1.0 - settings.limit_margin) * arm.robot().limits().velocity),
      most_a_(settings.speed * usable_acceleration * arm.robot().limits().acceleration),
      seen_q_(q_),
      seen_v_(q_),
      seen_a_(q_),
      path_step_(q_),
      places_(Eigen::MatrixXd::Zero(q_.size(), TimedPathFollower::most_places + 1)),
      lowered_places_(places_),
      room_(*system),
      posture_room_(body_),
      worker_workspace_(*system),
      look_period_(settings.planner ? settings.planner->period : default_look_period) {
  if (settings.tracking.stiffness > 0.0 && !torque) {
    throw std::invalid_argument("controller: tracking.stiffness is " + std::to_string(settings.tracking.stiffness) +
                                ", but arm '" + arm.name() + "' is not moved by torque, allowed: 0");
  }
  if (is_impedance() && q_.size() > most_of_impedance) {
    throw std::invalid_argument("controller: tracking.stiffness is " + std::to_string(settings.tracking.stiffness) +
                                " for an arm of " + std::to_string(q_.size()) + " joints, allowed: 0, or at most " +
                                std::to_string(most_of_impedance) + " joints");
  }
  frequency_ = std::min(settings.tracking.frequency, most_per_period / settings.period);
  guide = make_guide(arm, body_, settings, torque, workers);
  const Robot of_reference = within_margins(arm.robot(), settings, settings.speed);
  const Robot of_arm = within_margins(arm.robot(), settings, 1.0);
  const int speed_rows = settings.speed_limits ? speed_rows_.max_size() : 0;
  if (torque) {
    TorqueControllerSettings program;
    program.period = settings.period;
    program.safety = settings.safety;
    program.max_speed_rows = speed_rows;
    program.position_margin = settings.position_margin;
    program.stop_time = settings.stop_time;
    program.stop_damping = settings.stop_damping;
    program.torque_weight.setConstant(settings.torque_weight);
    program.slack_weight = settings.slack_weight;
    program.velocity_overrun = settings.velocity_overrun;
    program.acceleration_overrun = settings.acceleration_overrun;
    tracking_program_.emplace(of_arm, program);
    torque_program_.emplace(of_reference, program);
    if (settings.tracking.observer_time < infinity) {
      observer_.emplace(arm.robot().limits(), settings.period, settings.tracking.observer_time,
                        settings.tracking.observer_share);
    }
    if (arm.has_dynamics()) {
      dynamics_.emplace(arm.dynamics());
      dynamics_workspace_.emplace(*dynamics_);
    }
  } else {
    const AccelerationFilterSettings program{settings.period, settings.position_margin, settings.stop_time, settings.safety,
                                             speed_rows};
    tracking_filter_.emplace(of_arm, program);
    filter_.emplace(of_reference, program);
  }
  if (settings.local_minimum) {
    escape_.emplace(arm.robot(), seeded(*settings.local_minimum, settings.seed));
  }
  if (settings.look_ahead) {
    LookAheadSettings look = *settings.look_ahead;
    look.seed = settings.seed;
    evasion_ = std::make_unique<LookAhead>(system, look, dynamics_);
  }
  ends_.emplace(body_, settings.planner ? settings.planner->search : PlannerSettings{});
  for (const Joint& joint : arm.robot().joints()) {
    const auto j = static_cast<std::size_t>(joint.coordinate);
    is_sliding_[j] = is_sliding_[j] || joint.type == JointType::prismatic;
  }
  for (std::size_t k = 0; k < system->labels().size(); ++k) {
    const CoordinateLabel::Kind kind = system->labels()[k].kind;
    if (kind != CoordinateLabel::Kind::joint_limit && kind != CoordinateLabel::Kind::effort) {
      metric_coordinates_.push_back(static_cast<Eigen::Index>(k));
    }
  }
  if (workers && !settings.synchronous) {
    thread_ = std::thread([this] { run(); });
  }
}

void Controller::Impl::let_rest(const std::vector<RestingObject>& objects) {
  for (const RestingObject& one : objects) {
    std::size_t i = 0;
    for (std::size_t k = 0; k < system->labels().size(); ++k) {
      const CoordinateLabel& label = system->labels()[k];
      if (label.kind == CoordinateLabel::Kind::obstacle && label.name == one.object.name) {
        resting_.push_back(
            {static_cast<Eigen::Index>(k), one.given[i++] + std::max(lifted_room, settings.safety.margin + attached_room)});
      }
    }
  }
}

Controller::Impl::~Impl() {
  delete lifted.load();
  stopping_.store(true);
  wake_.release();
  if (thread_.joinable()) {
    thread_.join();
  }
}

}  // namespace sidestep

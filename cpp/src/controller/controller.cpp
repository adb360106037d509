// The public face, and what is set from any thread.
#include "sidestep/controller/controller.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "impl.hpp"
#include "recorder.hpp"

namespace sidestep {
namespace {

constexpr double pose_position_share = 2.0, pose_rotation_share = 0.5;  // of the stiffness, per m² and per rad²

/// Throws what is wrong with the sizes and numbers of a goal, or the robot that it was made for.
[[noreturn]] void refuse_goal(const JointGoal& goal, const Robot& robot) {
  const std::vector<std::string>& joints = robot.coordinate_names();
  using Part = std::pair<const char*, const Eigen::VectorXd*>;
  for (const auto& [name, part] :
       {Part("position", &goal.position), Part("velocity", &goal.velocity), Part("acceleration", &goal.acceleration)}) {
    const std::string what = std::string("controller: goal: ") + name;
    if (static_cast<std::size_t>(part->size()) != joints.size()) {
      throw std::invalid_argument(what + " has " + std::to_string(part->size()) +
                                  " entries, allowed: " + std::to_string(joints.size()) + ", one for each joint");
    }
    for (Eigen::Index j = 0; j < part->size(); ++j) {
      if (!std::isfinite((*part)[j])) {
        throw std::invalid_argument(what + " of joint '" + joints[static_cast<std::size_t>(j)] + "' is " +
                                    std::to_string((*part)[j]) + ", allowed: finite numbers");
      }
    }
  }
  throw std::invalid_argument("controller: goal: it is not one for arm '" + robot.name() + "'");
}

void refuse_goal(const PoseGoal& goal, const Robot& robot) {
  const std::string what = "controller: goal: the pose goal of frame '" + goal.frame().name + "' ";
  if (!goal.is_for(robot)) {
    throw std::invalid_argument(what + "is made for another robot than '" + robot.name() + "', allowed: one made for it");
  }
  using Part = std::pair<const char*, bool>;
  for (const auto& [name, finite] : {Part("pose", goal.pose.matrix().allFinite()), Part("twist", goal.twist.allFinite()),
                                     Part("rest", goal.settings.rest.allFinite())}) {
    if (!finite) {
      throw std::invalid_argument(what + "has a " + name + " that is not finite, allowed: finite numbers");
    }
  }
  for (const PoseGoal& other : goal.others) {
    refuse_goal(other, robot);
  }
}

}  // namespace

void Controller::Impl::set_goal(std::optional<Goal> goal) {
  if (goal) {
    const Robot& robot = arm.robot();
    const JointLimits& limits = robot.limits();
    if (auto* joint = std::get_if<JointGoal>(&*goal);
        joint != nullptr && joint->position.size() == robot.num_coordinates() && joint->position.allFinite()) {
      const Eigen::VectorXd within = limits.nearest_within(joint->position);
      if ((joint->position - within).cwiseAbs().maxCoeff() <= JointLimits::rounding) {
        joint->position = within;
      }
    }
    const GoalFault fault = check(*goal, robot);
    if (fault == GoalFault::invalid) {
      std::visit([&](const auto& one) { refuse_goal(one, robot); }, *goal);
    }
    if (fault == GoalFault::outside_limits) {
      const Eigen::VectorXd& position = std::get<JointGoal>(*goal).position;
      for (Eigen::Index j = 0; j < position.size(); ++j) {
        const double lower = limits.lower[j], upper = limits.upper[j];
        if (position[j] < lower - JointLimits::rounding || position[j] > upper + JointLimits::rounding) {
          throw std::invalid_argument("controller: goal: joint '" + robot.coordinate_names()[static_cast<std::size_t>(j)] +
                                      "' is " + std::to_string(position[j]) + ", allowed: " + std::to_string(lower) + " to " +
                                      std::to_string(upper) + (robot.slides(static_cast<int>(j)) ? " m" : " rad") +
                                      Plausibility::hint(robot, position));
        }
      }
    }
    if (auto* pose = std::get_if<PoseGoal>(&*goal)) {
      const auto set_stiffness = [&](PoseGoal& one) {
        one.settings.position_stiffness = pose_position_share * settings.barriers.stiffness;
        one.settings.orientation_stiffness = pose_rotation_share * settings.barriers.stiffness;
      };
      set_stiffness(*pose);
      std::for_each(pose->others.begin(), pose->others.end(), set_stiffness);
    }
  }
  put(goal ? Order(std::move(*goal)) : Order());
}

std::string Controller::Impl::question_of(const Order& order) const {
  if (const auto* goal = std::get_if<Goal>(&order)) {
    return plausible_.question(*goal);
  }
  if (const auto* velocity = std::get_if<VelocityOrder>(&order)) {
    return plausible_.question_velocity(velocity->velocity);
  }
  if (const auto* twist = std::get_if<TwistOrder>(&order)) {
    Vector6d asked = twist->twist;
    if (twist->free == TwistFreedom::rotation) {
      asked.tail<3>().setZero();
    }
    return plausible_.question_twist(asked);
  }
  return {};
}

void Controller::Impl::put(Order order, std::string question) {
  if (question.empty()) {
    question = question_of(order);
  }
  const std::lock_guard lock(mutex_);
  questions_.order_is_newer = !question.empty();
  questions_.order = std::move(question);
  shown_order_ = order;
  shown_posture_.reset();
  goal_orders_.put({++goal_count_, std::move(order)});
}

void Controller::Impl::set_obstacles(Obstacles obstacles) {
  auto copy = std::make_shared<const Obstacles>(obstacles);
  std::string question = plausible_.question(obstacles);
  const std::lock_guard lock(mutex_);  // also of the planner's obstacles: the worker must not bring back older ones
  if (guide && !settings.synchronous) {
    guide->set_obstacles(*copy);
  }
  shown_obstacles_ = std::move(copy);
  questions_.order_is_newer = questions_.order_is_newer && question.empty();
  questions_.obstacles = std::move(question);
  obstacle_orders_.put({++obstacle_count_, std::move(obstacles)});
}

Controller::Controller(Arm arm, ControllerSettings settings) : Controller(std::move(arm), std::move(settings), true) {
  if (const std::filesystem::path path = next_of_folder(whole_.name()); !path.empty()) {
    record(path);
    recorder_->forget_if_empty();
  }
}

Controller::Controller(Arm arm, ControllerSettings settings, bool workers)
    : settings_(std::move(settings)),
      command_(arm.num_coordinates()),
      refused_(arm.num_coordinates()),
      impl_(std::make_unique<Impl>(arm, settings_, command_, workers)),
      newest_(impl_.get()),
      whole_(std::move(arm)),
      has_torque_(impl_->torque) {}

Controller::~Controller() {
  delete next_.load();
  destroy(retired_.load());
}

Controller::Use::Use(Controller& controller) : controller_(&controller) {
  if (controller.in_use_.exchange(true, std::memory_order_acquire)) {
    throw std::runtime_error(
        "the controller is in use: a RealTimeRun or another thread steps it; stop it first, or wait for its end");
  }
}

void Controller::set_goal(const Eigen::VectorXd& position) {
  tell([&](Impl& impl) { impl.set_goal(std::optional<Goal>(std::in_place, JointGoal(position))); });
}
void Controller::set_goal(Goal goal) {
  tell([&](Impl& impl) { impl.set_goal(goal); });
}
void Controller::set_velocity(const Eigen::VectorXd& v) {
  tell([&](Impl& impl) { impl.set_velocity(v); });
}
void Controller::set_twist(const std::string& frame, const Vector6d& twist, bool local, TwistFreedom free) {
  tell([&](Impl& impl) { impl.set_twist(frame, twist, local, free); });
}
void Controller::set_trajectory(const Eigen::MatrixXd& q, const Eigen::VectorXd& times, TrajectoryBehaviour behaviour) {
  tell([&](Impl& impl) { impl.set_trajectory(q, times, behaviour); });
}
void Controller::clear_goal() {
  tell([](Impl& impl) { impl.set_goal(std::nullopt); });
}
void Controller::set_obstacles(Obstacles obstacles) {
  tell([&](Impl& impl) { impl.set_obstacles(obstacles); });
}

const Command& Controller::step(ConstVectorRef q, ConstVectorRef v) noexcept { return step_with(q, v, nullptr, nullptr); }

const Command& Controller::step(ConstVectorRef q, ConstVectorRef v, Eigen::Ref<const Eigen::MatrixXd> mass_matrix,
                                ConstVectorRef bias) noexcept {
  return step_with(q, v, &mass_matrix, &bias);
}

const Command& Controller::step_with(ConstVectorRef q, ConstVectorRef v, const Eigen::Ref<const Eigen::MatrixXd>* mass_matrix,
                                     const Eigen::Ref<const Eigen::VectorXd>* bias) noexcept {
  if (!stepper_.enter()) {
    return refused_;
  }
  Recorder* const recorder = records_.load(std::memory_order_acquire);
  if (recorder != nullptr) {
    recorder->begin_step(q, v, mass_matrix, bias);
  }
  take_over();
  const Command& command = impl_->step(q, v, mass_matrix, bias);
  if (recorder != nullptr) {
    recorder->end_step(*impl_);
  }
  stepper_.leave();
  return command;
}

void Controller::record(const std::filesystem::path& path) {
  const std::lock_guard lock(setters_);
  if (recorder_) {
    throw std::runtime_error("controller: it has been recorded already; make another controller for another recording");
  }
  recorder_ = std::make_unique<Recorder>(path, *impl_, setters_);
  recorder_->note(newest());
  if (newest_ != impl_.get()) {
    recorder_->add_arm(*newest_, held_);
  }
  records_.store(recorder_.get(), std::memory_order_release);
}

RecordingSummary Controller::stop_recording() {
  {
    const std::lock_guard lock(setters_);
    if (records_.exchange(nullptr) == nullptr) {
      throw std::runtime_error("controller: nothing is recorded; begin with `record`");
    }
    recorder_->close();
  }
  return recorder_->finish();
}

void Controller::note_requests() {
  if (recorder_) {
    recorder_->note(newest());
  }
}

const Obstacles& Controller::obstacles() const noexcept { return impl_->obstacles(); }
std::string Controller::explain() const {
  return (stepper_.in_turn() ? "several threads step this controller in turn: give each loop a controller of its own; " : "") +
         impl_->explain();
}
Arm Controller::arm() const {
  const std::lock_guard lock(setters_);
  return newest().arm;
}
const ControllerSettings& Controller::settings() const noexcept { return settings_; }
const std::vector<CoordinateLabel>& Controller::labels() const noexcept { return impl_->system->labels(); }
const GeometricSystem& Controller::system() const noexcept { return *impl_->system; }
const GeometricSystem::Workspace& Controller::workspace() const noexcept { return impl_->workspace; }
const TorqueSolution& Controller::solution() const noexcept { return impl_->solution; }
Eigen::VectorXd Controller::target() const { return impl_->target(); }
Plan Controller::last_plan() const {
  const std::lock_guard lock(setters_);
  return newest().guide ? newest().guide->last_plan() : Plan{};
}
std::optional<Obstruction> Controller::goal_obstruction() const {
  const std::lock_guard lock(setters_);
  return newest().goal_obstruction();
}
OnlinePlanner::Counts Controller::planner_counts() const {
  const std::lock_guard lock(setters_);
  return newest().guide ? newest().guide->counts() : OnlinePlanner::Counts{};
}
Questions Controller::questions() const {
  const std::lock_guard lock(setters_);
  return newest().questions();
}
bool Controller::has_torque() const noexcept { return has_torque_; }

}  // namespace sidestep

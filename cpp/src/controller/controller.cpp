// The public face, and what is set from any thread.
#include "sidestep/controller/controller.hpp"

#include <utility>

#include "impl.hpp"
#include "recorder.hpp"
#include "source_registry.hpp"

namespace sidestep {

void Controller::Impl::put(std::shared_ptr<const World> world, std::string question) {
  board_.put(std::move(world), std::move(question), [this](const Obstacles& shared) { share_with_planner(shared); });
}

void Controller::Impl::share_with_planner(const Obstacles& obstacles) {
  if (planner() != nullptr && !model.settings.synchronous) {
    planner()->set_obstacles(obstacles);
  }
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
      told_{false, command_.position, command_.position, command_.position},
      registry_(std::make_unique<SourceRegistry>(settings_)),
      impl_(std::make_unique<Impl>(arm, settings_, command_, workers)),
      newest_(impl_.get()),
      whole_(std::move(arm)),
      has_torque_(impl_->model.torque),
      history_(whole_.num_coordinates()) {}

Controller::~Controller() {
  delete next_.load();
  destroy(retired_.load());
}

Controller::ClaimedController::ClaimedController(Controller& controller) : controller_(&controller) {
  if (controller.in_use_.exchange(true, std::memory_order_acquire)) {
    throw std::runtime_error("the controller is in use: a Loop or another thread steps it; stop it first, or wait for its end");
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

double Controller::now() const noexcept { return time_.load(std::memory_order_relaxed); }
template <class Change>
void Controller::change_sources(const Obstacles& said, Change&& change) {
  const std::lock_guard lock(setters_);
  change(*registry_);
  const std::string question = newest().model.plausible.question(said);
  const auto world = std::make_shared<const World>(registry_->world());
  tell_locked([&](Impl& impl) { impl.put(world, question); });
}
void Controller::set_obstacles(Obstacles obstacles, const SourceOptions& options) {
  change_sources(obstacles, [&](SourceRegistry& sources) { sources.set(obstacles, options, now()); });
}
void Controller::expect_obstacles(const std::vector<std::string>& sources) {
  change_sources(Obstacles::none(), [&](SourceRegistry& registry) { registry.expect(sources); });
}
void Controller::remove_obstacles(const std::string& source) {
  change_sources(Obstacles::none(), [&](SourceRegistry& sources) { sources.remove(source); });
}
void Controller::add_obstacle(const Obstacles& obstacle, const std::string& source) {
  change_sources(obstacle, [&](SourceRegistry& sources) { sources.add(obstacle, source); });
}
void Controller::move_obstacle(const std::string& name, const Eigen::Isometry3d& pose, const SourceOptions& options) {
  change_sources(Obstacles::none(), [&](SourceRegistry& sources) { sources.move(name, pose, options, now()); });
}
void Controller::remove_obstacle(const std::string& name, const std::string& source) {
  change_sources(Obstacles::none(), [&](SourceRegistry& sources) { sources.remove(name, source); });
}
std::vector<SourceContent> Controller::said() const {
  const std::lock_guard lock(setters_);
  return registry_->said();
}
std::vector<SourceState> Controller::sources() const { return impl_->sources().states(); }

const Command& Controller::step(ConstVectorRef q, ConstVectorRef v, double time) noexcept {
  return step_with(q, v, nullptr, nullptr, time);
}

const Command& Controller::step(ConstVectorRef q, ConstVectorRef v, Eigen::Ref<const Eigen::MatrixXd> mass_matrix,
                                ConstVectorRef bias, double time) noexcept {
  return step_with(q, v, &mass_matrix, &bias, time);
}

const Command& Controller::step_with(ConstVectorRef q, ConstVectorRef v, const Eigen::Ref<const Eigen::MatrixXd>* mass_matrix,
                                     const Eigen::Ref<const Eigen::VectorXd>* bias, double time) noexcept {
  if (!stepper_.enter()) {
    return refused_;
  }
  Recorder* const recorder = records_.load();
  Recorder* const box = boxes_.load();
  if (recorder != nullptr) {
    recorder->begin_step(q, v, mass_matrix, bias, time);
  }
  if (box != nullptr) {
    box->begin_step(q, v, mass_matrix, bias, time);
  }
  take_over();
  const Command& command = impl_->step(q, v, {mass_matrix, bias}, time);
  time_.store(impl_->tick().time, std::memory_order_relaxed);
  offset_.store(impl_->tick().offset, std::memory_order_relaxed);
  if (impl_->measured().was_known()) {
    history_.put(this->time(), impl_->measured().position());
  }
  if (box != nullptr) {
    box->end_step(*impl_);
  }
  if (recorder != nullptr) {
    recorder->end_step(*impl_);
  }
  stepper_.leave();
  return command;
}

const Obstacles& Controller::obstacles() const noexcept { return impl_->obstacles(); }
std::string Controller::explain() const {
  return (stepper_.in_turn() ? "several threads step this controller in turn: give each loop a controller of its own; " : "") +
         impl_->explain();
}
Arm Controller::arm() const {
  const std::lock_guard lock(setters_);
  return newest().model.arm;
}
const ControllerSettings& Controller::settings() const noexcept { return settings_; }
const std::vector<CoordinateLabel>& Controller::labels() const noexcept { return impl_->model.system->labels(); }
const GeometricSystem& Controller::system() const noexcept { return *impl_->model.system; }
const GeometricSystem::Workspace& Controller::workspace() const noexcept { return impl_->workspace(); }
detail::PartResults Controller::part_results() const noexcept { return impl_->part_results(); }
Eigen::VectorXd Controller::target() const { return impl_->target(); }
Plan Controller::last_plan() const {
  const std::lock_guard lock(setters_);
  return newest().planner() != nullptr ? newest().planner()->last_plan() : Plan{};
}
std::optional<Obstruction> Controller::goal_obstruction() const {
  const std::lock_guard lock(setters_);
  return newest().goal_obstruction();
}
OnlinePlanner::Counts Controller::planner_counts() const {
  const std::lock_guard lock(setters_);
  return newest().planner() != nullptr ? newest().planner()->counts() : OnlinePlanner::Counts{};
}
Questions Controller::questions() const {
  const std::lock_guard lock(setters_);
  return newest().board().questions();
}
bool Controller::has_torque() const noexcept { return has_torque_; }

}  // namespace sidestep

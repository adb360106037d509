// Another body while steps run: a finer cover, an object that is grasped or let go.
#include <stdexcept>
#include <utility>

#include "impl.hpp"

namespace sidestep {

void Controller::Impl::take_orders_of(Impl& before) {
  Order order;
  std::shared_ptr<const Obstacles> obstacles;
  {
    const std::lock_guard lock(before.mutex_);
    order = before.shown_order_;
    goal_count_ = before.goal_count_;
    obstacle_count_ = before.obstacle_count_;
    obstacles = before.shown_obstacles_;
  }
  if (const Eigen::VectorXd q = before.last_q(); q.size() != 0) {
    measured_.put(q);
  }
  const std::lock_guard lock(mutex_);
  if (guide && !settings.synchronous) {
    guide->set_obstacles(*obstacles);
  }
  shown_order_ = order;
  shown_obstacles_ = obstacles;
  goal_orders_.put({goal_count_, std::move(order)});
  obstacle_orders_.put({obstacle_count_, *obstacles});
}

void Controller::Impl::go_on_from(Impl& before) noexcept {
  static_cast<StepState&>(*this) = before;
  command = before.command;
  solution = before.solution;
  tracked_ = before.tracked_;
  obstacle_orders_.update();
  if (obstacle_orders_.current().number == obstacle_number_) {  // as they have moved on until now
    std::swap(obstacle_orders_.current().obstacles, before.obstacle_orders_.current().obstacles);
  }
  goal_orders_.update();
  GoalOrder& order = goal_orders_.current();
  if (order.number == goal_number_) {
    std::swap(order.order, before.goal_orders_.current().order);
    goal_ = before.goal_ == nullptr ? nullptr : before.goal_ == &before.input_goal_ ? &input_goal_ : std::get_if<Goal>(&order.order);
  }
  // What was found for the body before does not hold for this one.
  has_target_ = posture_found_ = target_blocked_ = wakes_worker_ = false;
  posture_attempt_ = 0;
  next_posture_ = next_look_ = 0.0;
  begins_goal_ = goal_ != nullptr && !has_input();
  clock_.seen = -1.0;
  clock_.free = clock_.time;
  clock_.blocked = false;
  clock_.blocker = {};
}

void Controller::take_over() noexcept {
  if (next_.load(std::memory_order_relaxed) == nullptr) {
    return;
  }
  if (Impl* const next = next_.exchange(nullptr, std::memory_order_acquire)) {
    next->go_on_from(*impl_);
    retired_.store(impl_.release(), std::memory_order_release);
    impl_.reset(next);
  }
}

void Controller::change(const Arm& whole, std::vector<Held> held) {
  Arm arm = whole;
  for (const Held& one : held) {
    arm = sidestep::attach(arm, one.object, one.q);
  }
  auto fresh = std::make_unique<Impl>(std::move(arm), settings_);
  std::unique_ptr<Impl> passed_over, retired;  // end after the lock
  const std::lock_guard lock(setters_);
  fresh->take_orders_of(*newest_);
  passed_over.reset(next_.exchange(nullptr));
  retired.reset(retired_.exchange(nullptr, std::memory_order_acquire));
  newest_ = fresh.get();
  next_.store(fresh.release(), std::memory_order_release);
  whole_ = whole;
  held_ = std::move(held);
}

void Controller::set_arm(Arm arm) {
  const std::lock_guard lock(changes_);
  const Robot &now = whole_.robot(), &then = arm.robot();
  if (!now.same_joints(then) || now.coordinate_names() != then.coordinate_names()) {
    throw std::invalid_argument("controller: arm '" + arm.name() + "' has other joints than '" + whole_.name() + "'; make a controller for it");
  }
  const JointLimits &a = now.limits(), &b = then.limits();
  if (a.lower != b.lower || a.upper != b.upper || a.velocity != b.velocity || a.acceleration != b.acceleration || a.effort != b.effort ||
      a.jerk != b.jerk || a.effort_rate != b.effort_rate || whole_.has_dynamics() != arm.has_dynamics()) {
    throw std::invalid_argument("controller: arm '" + arm.name() + "' has other limits than '" + whole_.name() +
                                "', or inertias where that has none; make a controller for it");
  }
  change(arm, held_);
}

void Controller::attach(const Attachment& object) {
  const std::lock_guard lock(changes_);
  std::vector<Held> held = held_;
  held.push_back({object, {}});
  tell([&](Impl& impl) { held.back().q = impl.last_q(); });
  change(whole_, std::move(held));
}

void Controller::detach(const std::string& name) {
  const std::lock_guard lock(changes_);
  std::vector<Held> held = held_;
  if (std::erase_if(held, [&](const Held& one) { return one.object.name == name; }) == 0) {
    std::string names;
    for (const Held& one : held) {
      names += (names.empty() ? "'" : ", '") + one.object.name + "'";
    }
    throw std::invalid_argument("controller: no object '" + name + "' is attached; attached: " + (names.empty() ? "none" : names));
  }
  change(whole_, std::move(held));
}

std::vector<std::string> Controller::attached() const {
  const std::lock_guard lock(changes_);
  std::vector<std::string> names;
  for (const Held& one : held_) {
    names.push_back(one.object.name);
  }
  return names;
}

}  // namespace sidestep

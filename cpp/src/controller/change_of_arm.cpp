// Another body while steps run: a finer cover, an object that is grasped or let go.
#include <stdexcept>
#include <utility>

#include "impl.hpp"
#include "recorder.hpp"

namespace sidestep {

void Controller::Impl::take_orders_of(Impl& before) {
  Order order;
  std::shared_ptr<const Obstacles> obstacles;
  Questions questions;
  {
    const std::lock_guard lock(before.mutex_);
    order = before.shown_order_;
    goal_count_ = before.goal_count_;
    obstacle_count_ = before.obstacle_count_;
    obstacles = before.shown_obstacles_;
    questions = before.questions_;
  }
  if (const Eigen::VectorXd q = before.last_q(); q.size() != 0) {
    measured_.put(q);
  }
  const std::lock_guard lock(mutex_);
  if (guide && !settings.synchronous) {
    guide->set_obstacles(*obstacles);
  }
  questions_ = std::move(questions);
  shown_order_ = order;
  shown_obstacles_ = obstacles;
  goal_orders_.put({goal_count_, std::move(order)});
  obstacle_orders_.put({obstacle_count_, *obstacles});
}

void Controller::Impl::go_on_from(Impl& before) noexcept {
  static_cast<StepState&>(*this) = before;
  solution = before.solution;
  tracked_ = before.tracked_;
  closing_.go_on_from(before.closing_);
  obstacle_orders_.update();
  if (obstacle_orders_.current().number == obstacle_number_) {  // as they have moved on until now
    std::swap(obstacle_orders_.current().obstacles, before.obstacle_orders_.current().obstacles);
  }
  goal_orders_.update();
  GoalOrder& order = goal_orders_.current();
  taken_.goal = order.number;
  taken_.obstacles = obstacle_orders_.current().number;
  if (order.number == goal_number_) {
    std::swap(order.order, before.goal_orders_.current().order);
    goal_ = before.goal_ == nullptr               ? nullptr
            : before.goal_ == &before.input_goal_ ? &input_goal_
                                                  : std::get_if<Goal>(&order.order);
  }
  // The target stays; a way to it is looked for anew.
  target_blocked_ = false;
  next_posture_ = next_look_ = 0.0;
  if (guide && has_target_) {
    guide->set_goal(target_);
  }
  wakes_worker_ = true;
  begins_goal_ = begins_goal_ || (goal_ != nullptr && !moves_ && !has_target_);
  if (avoiding_ && evasion_ && settings.synchronous) {
    guarded([&] { evasion_->resume(trajectory_); });
  }
  // What the arm weighs more by the new model, the observer has seen before.
  if (dynamics_ && known_before_) {
    twist_state_.update(arm.robot(), arm_q_, arm_v_);
    dynamics_->gravity(twist_state_, *dynamics_workspace_, gravity_change_);
    feedback_ = gravity_change_ - gravity_;
    gravity_ = gravity_change_;
    if (observer_) {
      observer_->change_model(feedback_);
    }
  }
  // Bounds of this step are those of the clearances of the last.
  twist_state_.update(arm.robot(), q_, v_);
  has_last_wanted_v_ = false;
  static_cast<void>(system->acceleration(q_, v_, input_pull_, obstacles(), workspace));
  clock_.seen = -1.0;
  clock_.free = clock_.time;
  clock_.blocked = false;
  clock_.blocker = {};
}

bool Controller::Impl::is_lifted() const noexcept {
  const auto is_free = [this](const Resting& one) {
    return workspace.clearances.least[one.coordinate] >= one.clearance &&
           (!apart_ || arm_workspace_.clearances.least[one.coordinate] >= one.clearance);
  };
  return known_before_ && std::all_of(resting_.begin(), resting_.end(), is_free);
}

void Controller::take_over() noexcept {
  Impl* next = next_.load(std::memory_order_relaxed) == nullptr ? nullptr : next_.exchange(nullptr, std::memory_order_acquire);
  if (next == nullptr && impl_->lifted.load(std::memory_order_relaxed) != nullptr && impl_->is_lifted()) {
    next = impl_->lifted.exchange(nullptr, std::memory_order_acq_rel);
  }
  if (next != nullptr) {
    next->go_on_from(*impl_);
    Impl* const last = impl_.release();
    impl_.reset(next);
    last->retire();
    last->before = retired_.load(std::memory_order_relaxed);
    while (!retired_.compare_exchange_weak(last->before, last, std::memory_order_release, std::memory_order_relaxed)) {
    }
  }
  if (restarts_.load(std::memory_order_relaxed) && restarts_.exchange(false, std::memory_order_acquire)) {
    impl_->restart();
  }
}

void Controller::change(const Arm& whole, std::vector<Held> held) {
  Arm arm = whole, lifted_arm = whole;
  std::vector<RestingObject> at_rest;
  for (const Held& one : held) {
    arm = sidestep::attach(arm, one.resting ? one.resting->object : one.object, one.q);
    lifted_arm = sidestep::attach(lifted_arm, one.object, one.q);
    if (one.resting) {
      at_rest.push_back(*one.resting);
    }
  }
  auto fresh = std::make_unique<Impl>(std::move(arm), settings_, command_);
  if (!at_rest.empty()) {
    fresh->let_rest(at_rest);
    fresh->lifted = new Impl(std::move(lifted_arm), settings_, command_);
  }
  install(std::move(fresh), whole, std::move(held));
}

void Controller::install(std::unique_ptr<Impl> fresh, const Arm& whole, std::vector<Held> held) {
  std::unique_ptr<Impl> passed_over;  // ends after the lock
  Impl* old = nullptr;
  {
    const std::lock_guard lock(setters_);
    Impl& last = newest();
    Impl* const lifted = fresh->lifted;
    fresh->arm_number = ++arm_count_;
    if (lifted != nullptr) {
      lifted->arm_number = ++arm_count_;
    }
    if (recorder_) {
      recorder_->add_arm(*fresh, held);
    }
    fresh->take_orders_of(last);
    if (lifted != nullptr) {
      lifted->take_orders_of(last);
    }
    passed_over.reset(next_.exchange(nullptr));
    old = retired_.exchange(nullptr, std::memory_order_acquire);  // before `fresh` can be among them
    lifted_ = lifted;
    newest_ = fresh.get();
    whole_ = whole;
    held_ = std::move(held);
    next_.store(fresh.release(), std::memory_order_release);
  }
  destroy(old);
}

Controller::Impl& Controller::newest() const noexcept {
  return lifted_ != nullptr && newest_->lifted.load() == nullptr ? *lifted_ : *newest_;
}

void Controller::forget_lifted() noexcept {
  if (lifted_ != nullptr && newest_->lifted.load() == nullptr) {
    std::for_each(held_.begin(), held_.end(), [](Held& one) { one.resting.reset(); });
  }
}

void Controller::destroy(Impl* newest) noexcept {
  while (newest != nullptr) {
    delete std::exchange(newest, newest->before);
  }
}

void Controller::set_arm(Arm arm) {
  const std::lock_guard lock(changes_);
  forget_lifted();
  const Robot &now = whole_.robot(), &then = arm.robot();
  if (!now.same_joints(then) || now.coordinate_names() != then.coordinate_names()) {
    throw std::invalid_argument("controller: arm '" + arm.name() + "' has other joints than '" + whole_.name() +
                                "'; make a controller for it");
  }
  const JointLimits &a = now.limits(), &b = then.limits();
  if (a.lower != b.lower || a.upper != b.upper || a.velocity != b.velocity || a.acceleration != b.acceleration ||
      a.effort != b.effort || a.jerk != b.jerk || a.effort_rate != b.effort_rate ||
      whole_.has_dynamics() != arm.has_dynamics()) {
    throw std::invalid_argument("controller: arm '" + arm.name() + "' has other limits than '" + whole_.name() +
                                "', or inertias where that has none; make a controller for it");
  }
  change(arm, held_);
}

std::string Controller::attach(const Attachment& object) {
  const std::lock_guard lock(changes_);
  forget_lifted();
  std::vector<Held> held = held_;
  Held& last = held.emplace_back(Held{object, {}, {}});
  std::optional<Obstacles> around;
  {
    const std::lock_guard orders(setters_);
    last.q = newest().last_q();
    around = newest().newest_obstacles();
  }
  if (!object.rests_on.empty()) {
    if (last.q.size() == 0) {
      throw std::invalid_argument("attach '" + object.name +
                                  "': it rests on obstacles, but where the arm is nobody has said; step once before");
    }
    Arm holding = whole_;
    for (const Held& one : held_) {
      holding = sidestep::attach(holding, one.object, one.q);
    }
    sidestep::attach(holding, object);  // for what is wrong with it
    last.resting = resting(holding.robot(), object, last.q, *around, settings_.safety.margin + attached_room);
  }
  const Eigen::VectorXd q = last.q;
  change(whole_, std::move(held));
  return doubt(arm(), object, q);
}

void Controller::detach(const std::string& name) {
  const std::lock_guard lock(changes_);
  forget_lifted();
  std::vector<Held> held = held_;
  if (std::erase_if(held, [&](const Held& one) { return one.object.name == name; }) == 0) {
    std::string names;
    for (const Held& one : held) {
      names += (names.empty() ? "'" : ", '") + one.object.name + "'";
    }
    throw std::invalid_argument("controller: no object '" + name +
                                "' is attached; attached: " + (names.empty() ? "none" : names));
  }
  for (Held& one : held) {
    std::erase(one.object.may_touch, name);
    if (one.object.link == name) {
      throw std::invalid_argument("controller: '" + one.object.name + "' is attached to '" + name + "'; detach it first");
    }
  }
  change(whole_, std::move(held));
}

std::vector<std::string> Controller::attached() const {
  const std::lock_guard lock(setters_);
  std::vector<std::string> names;
  for (const Held& one : held_) {
    names.push_back(one.object.name);
  }
  return names;
}

}  // namespace sidestep

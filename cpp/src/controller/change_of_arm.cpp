// Another body while steps run: a finer cover, an object that is grasped or let go.
#include <stdexcept>
#include <utility>

#include "impl.hpp"
#include "recorder.hpp"

namespace sidestep {

void Controller::Impl::take_requests_of(Impl& before) {
  if (const Eigen::VectorXd q = before.board_.last_measured(); q.size() != 0) {
    board_.show_measured(q);
  }
  board_.take_over(before.board_, [this](const Obstacles& shared) { share_with_planner(shared); });
}

void Controller::Impl::go_on_from(Impl& before) noexcept {
  // First what does not depend on the body, then what it changes.
  clock_ = before.clock_;
  state_ = before.state_;
  state_.followed = nullptr;
  state_.next_look = 0.0;
  state_.findings.blocked = false;
  reference_ = before.reference_;
  last_ = before.last_;
  solution_ = before.solution_;
  measured_.go_on_from(before.measured_);
  activity_.go_on_from(before.activity_);
  tracker_.go_on_from(before.tracker_);
  sources_.go_on_from(before.sources_);
  inputs_.go_on_from(before.inputs_);
  taken_.request = inputs_.request().handed_over();
  taken_.obstacles = sources_.handed_over();
  board_.guarded([&] { look_ahead_.go_on_from(before.look_ahead_); });
  state_.paused = before.state_.paused;
  dynamics_.go_on_from(before.dynamics_);
  touch_.go_on_from(before.touch_);
  if (dynamics_.has_model() && measured_.was_known()) {
    dynamics_.change_weight(measured_.position(), measured_.velocity());
  }
  // Bounds of this step are those of the clearances of the last.
  attractor_.look_at_reference(reference_, inputs_.input().attraction(), obstacles());
}

bool Controller::Impl::is_lifted() const noexcept {
  return measured_.was_known() &&
         resting_.is_lifted(attractor_.at_reference().clearances, state_.apart ? &attractor_.at_arm().clearances : nullptr);
}

void Controller::Impl::restart() noexcept {
  taken_.restarts = true;
  measured_.restart();
  touch_.release();
}

void Controller::Impl::pause(bool paused) noexcept {
  taken_.pauses = paused != state_.paused;
  state_.paused = paused;
}

void Controller::Impl::continue_from(ConstVectorRef q, ConstVectorRef v, ConstVectorRef a) noexcept {
  taken_.is_told = state_.told.is = true;
  state_.told.position = q;
  state_.told.velocity = v;
  state_.told.acceleration = a;
}

void Controller::continue_from(ConstVectorRef position, ConstVectorRef velocity, ConstVectorRef acceleration) noexcept {
  const Eigen::Index nv = told_.position.size();
  if (position.size() == nv && velocity.size() == nv && acceleration.size() == nv && position.allFinite() &&
      velocity.allFinite() && acceleration.allFinite() && settings_.output == ControllerSettings::Output::position) {
    told_.is = true;
    told_.position = position;
    told_.velocity = velocity;
    told_.acceleration = acceleration;
  }
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
  impl_->pause(paused_.load(std::memory_order_acquire));
  if (told_.is) {
    told_.is = false;
    impl_->continue_from(told_.position, told_.velocity, told_.acceleration);
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
    for (Recorder* const recorder : {recorder_.get(), box_.get()}) {
      if (recorder != nullptr) {
        recorder->add_arm(*fresh, held);
      }
    }
    fresh->take_requests_of(last);
    if (lifted != nullptr) {
      lifted->take_requests_of(last);
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
    last.q = newest().board().last_measured();
    around = newest().board().newest_world()->obstacles;
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
    last.resting = resting(holding.robot(), object, last.q, *around, settings_.safety.margin + attached_distance);
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

#include "velocity_follower.hpp"

#include <algorithm>
#include <cmath>
#include <variant>

namespace sidestep {
namespace {

constexpr double response_settling = 4.0;  // time constants of the response after which a motion is there, to 2 % [-]
constexpr double bent_share = 0.5;         // share of the tolerance that barriers take away and are named for [-]

}  // namespace

VelocityMemory::VelocityMemory(Eigen::Index nv)
    : wanted(Eigen::VectorXd::Zero(nv)), last_wanted(wanted), response(wanted), ideal(wanted) {}

VelocityFollower::VelocityFollower(const Robot& robot, const JointKinds& joints, const ControllerSettings& settings,
                                   const UsableLimits& usable, const std::vector<Eigen::Index>& clearances)
    : VelocityMemory(robot.num_coordinates()),
      joints_(joints),
      limits_(robot.limits()),
      settings_(settings),
      usable_(usable),
      bounds_(robot, joints, settings, clearances),
      twist_(robot, settings, usable),
      asked_(wanted),
      off_(wanted) {}

void VelocityFollower::begin(const Request& request, const NearReference& near) noexcept {
  if (const auto* twist = std::get_if<TwistRequest>(&request); twist != nullptr && has_last_wanted) {
    twist_.solve(*twist, near, bounds_, wanted, reduction);  // where the arm was before
    last_wanted = wanted;
  } else {
    has_last_wanted = false;
  }
}

void VelocityFollower::follow(const Request& request, bool fresh, double pace, const Reference& reference,
                              const NearReference& near, const Tick& tick, InputTarget& target) noexcept {
  const auto* const twist = std::get_if<TwistRequest>(&request);
  twist_.update(reference.q, reference.v);
  bounds_.begin();
  reduction = Reduction{};
  if (twist != nullptr && fresh) {
    twist_.solve(*twist, near, bounds_, wanted, reduction);
  } else {
    asked_.setZero();
    if (fresh) {
      asked_ = std::get<VelocityRequest>(request).velocity;
      usable_.scale(asked_, reduction);
    }
    bounds_.keep(asked_, reference.q, near, wanted, twist_.projected());
    usable_.scale(wanted, reduction);
    has_last_wanted = false;
  }
  wanted *= pace;
  JointGoal& motion = target.joint_motion();
  motion.position = reference.q.cwiseMax(limits_.lower).cwiseMin(limits_.upper);
  motion.velocity = wanted;
  motion.acceleration.setZero();
  if (!has_ideal) {
    ideal = reference.v;
    has_ideal = true;
  }
  respond(ideal, tick);
  ideal += tick.period * response;
  respond(reference.v, tick);
  target.respond(reference, response);
  last_wanted = wanted;
  has_last_wanted = twist != nullptr && fresh;
}

// Limits scale it as a whole: joints that reach their velocities one after the other would move the arm across what is asked.
void VelocityFollower::respond(const Eigen::VectorXd& v, const Tick& tick) noexcept {
  response = settings_.inputs.response * (wanted - v);
  if (has_last_wanted) {  // its own change, while the request is the same
    response += ((wanted - last_wanted) / tick.moved).cwiseMax(-usable_.acceleration).cwiseMin(usable_.acceleration);
  }
  double share = 1.0;
  for (Eigen::Index j = 0; j < v.size(); ++j) {
    if (std::abs(response[j]) > usable_.acceleration[j]) {
      share = std::min(share, usable_.acceleration[j] / std::abs(response[j]));
    }
  }
  response *= share;
}

bool VelocityFollower::follows(const Request& request, const Eigen::VectorXd& v) const noexcept {
  if (const auto* velocity = std::get_if<VelocityRequest>(&request)) {
    for (Eigen::Index j = 0; j < v.size(); ++j) {
      if (std::abs(v[j] - velocity->velocity[j]) > joint_tolerance(velocity->velocity, j, joints_.slides(j))) {
        return false;
      }
    }
    return true;
  }
  return InputTolerance::of(twist_.asked()).holds(twist_.frame_motion(v) - twist_.asked());
}

bool VelocityFollower::differs(const Request& request, const Eigen::VectorXd& change, double share) const noexcept {
  if (const auto* velocity = std::get_if<VelocityRequest>(&request)) {
    for (Eigen::Index j = 0; j < change.size(); ++j) {
      if (std::abs(change[j]) > share * joint_tolerance(velocity->velocity, j, joints_.slides(j))) {
        return true;
      }
    }
    return false;
  }
  return !InputTolerance::of(twist_.asked()).holds(twist_.frame_motion(change) / share);
}

void VelocityFollower::solve_again(const TwistRequest& twist, const Reference& reference, const NearReference& near) noexcept {
  twist_.update(reference.q, reference.v);
  twist_.solve(twist, near, bounds_, wanted, reduction);
}

void VelocityFollower::write_change(const Request& request, const Eigen::VectorXd& next_v,
                                    Eigen::VectorXd& change) const noexcept {
  if (const auto* velocity = std::get_if<VelocityRequest>(&request)) {
    change = next_v - velocity->velocity;
  } else {
    twist_.write_change(next_v, change);
  }
}

bool VelocityFollower::judge(const Request& request, const Reference& reference, const Eigen::VectorXd& wanted_acceleration,
                             const Tick& tick) noexcept {
  // Off what the response alone would make of it: where that is there already, or by itself beyond the tolerance.
  off_ = reference.next_v - ideal;
  const bool is_off = !follows(request, reference.next_v) && (follows(request, ideal) || differs(request, off_, 1.0));
  off_ = (wanted_acceleration - response) / settings_.inputs.response;
  is_bent = is_off && differs(request, off_, bent_share);
  missed_for = is_off ? missed_for + tick.moved : 0.0;
  return is_bent || !follows(request, wanted) || misses_for_long();
}

bool VelocityFollower::misses_for_long() const noexcept { return missed_for * settings_.inputs.response > response_settling; }

void VelocityFollower::go_on_from(const VelocityFollower& before) noexcept {
  static_cast<VelocityMemory&>(*this) = before;
  has_last_wanted = false;
  twist_.go_on_from(before.twist_);
}

}  // namespace sidestep

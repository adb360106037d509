// What of a velocity, twist or trajectory the command is: its change as numbers, status and words.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "impl.hpp"

namespace sidestep {
namespace {

constexpr double response_settling = 4.0;  // time constants of the response after which a motion is there, to 2 % [-]
constexpr double joint_rest = 5e-4;        // [rad/s] of a joint that counts as rest
constexpr double sliding_rest = 0.1;       // the same of joints that slide [m/rad]
constexpr double cross_share = 0.01;       // share of the fastest joint that others may be off
constexpr double sliding_deviation = 0.2;  // the same of joints that slide, as a share of that [m/rad]
constexpr double least_deviation = 0.01;   // [rad] from a trajectory: what counts as arrived
constexpr double bent_share = 0.5;         // of the tolerance that barriers take away and are named for
constexpr double outwards = 0.5;           // cosine to the line from the shoulder from which an arm is stretched

/// A number with some digits, and no sign where they are all zero.
std::string in_digits(double value, int digits) {
  const double scale = std::pow(10.0, digits);
  char text[48];
  std::snprintf(text, sizeof text, "%.*f", digits, std::round(value * scale) / scale + 0.0);
  return text;
}

/// For example "0.12 of 0.30 rad/s".
std::string rates(double got, double asked, const char* unit) {
  const int digits = std::abs(asked) < 0.1 && asked != 0.0 ? 4 : unit[0] == 'r' ? 2 : 3;
  return in_digits(got, digits) + " of " + in_digits(asked, digits) + " " + unit;
}

const char* words_of(Limit set) {
  const auto one_of = [&](Limit lower, Limit upper) { return contains(set, lower) || contains(set, upper); };
  return one_of(Limit::position_lower, Limit::position_upper)           ? "position limit"
         : one_of(Limit::velocity_lower, Limit::velocity_upper)         ? "velocity limit"
         : one_of(Limit::acceleration_lower, Limit::acceleration_upper) ? "acceleration limit"
         : one_of(Limit::torque_lower, Limit::torque_upper)             ? "effort limit"
         : one_of(Limit::jerk_lower, Limit::jerk_upper)                 ? "jerk limit"
                                                                        : "torque rate limit";
}

}  // namespace

double Controller::Impl::joint_tolerance(const Eigen::VectorXd& asked, Eigen::Index j) const noexcept {
  return InputTolerance::share * std::abs(asked[j]) + cross_share * asked.cwiseAbs().maxCoeff() +
         joint_rest * (is_sliding_[static_cast<std::size_t>(j)] ? sliding_rest : 1.0);
}

bool Controller::Impl::follows(const Eigen::VectorXd& v) const noexcept {
  const Order& order = goal_orders_.current().order;
  if (const auto* velocity = std::get_if<VelocityOrder>(&order)) {
    for (Eigen::Index j = 0; j < v.size(); ++j) {
      if (std::abs(v[j] - velocity->velocity[j]) > joint_tolerance(velocity->velocity, j)) {
        return false;
      }
    }
    return true;
  }
  const Vector6d got = jacobian_transposed_.transpose().lazyProduct(v);
  return InputTolerance::of(twist_).holds(got - twist_);
}

bool Controller::Impl::differs(const Eigen::VectorXd& change, double share) const noexcept {
  if (const auto* velocity = std::get_if<VelocityOrder>(&goal_orders_.current().order)) {
    for (Eigen::Index j = 0; j < change.size(); ++j) {
      if (std::abs(change[j]) > share * joint_tolerance(velocity->velocity, j)) {
        return true;
      }
    }
    return false;
  }
  const Vector6d moved = jacobian_transposed_.transpose().lazyProduct(change);
  return !InputTolerance::of(twist_).holds(moved / share);
}

void Controller::Impl::judge_input() noexcept {
  if (!has_input() || begins_input_ || (trajectory_order() == nullptr && !is_fresh())) {
    has_ideal_v_ = is_bent_ = false;
    missed_for_ = 0.0;
    return;
  }
  const Order& order = goal_orders_.current().order;
  bool reduced = is_stale() || command.avoiding;
  if (const auto* trajectory = std::get_if<TrajectoryOrder>(&order)) {
    command.input_change = next_v_;
    if (clock_.time < trajectory->path.duration()) {
      command.input_change -= path_v_;
    }
    reduced =
        reduced || slows_trajectory() ||
        command.deviation > (is_sliding_[static_cast<std::size_t>(deviating_)] ? sliding_deviation : 1.0) * least_deviation;
  } else {
    if (const auto* velocity = std::get_if<VelocityOrder>(&order)) {
      command.input_change = next_v_ - velocity->velocity;
    } else {
      const auto& twist = std::get<TwistOrder>(order);
      if (is_stale()) {  // it was not solved
        twist_state_.update(arm.robot(), q_, v_);
        solve_twist(twist);
      }
      const double least = settings.inputs.singular * settings.inputs.singular;
      const Vector6d error = jacobian_transposed_.transpose().lazyProduct(next_v_) - twist_;
      const Vector6d along = (principal_.transpose() * error).cwiseQuotient(squares_.cwiseMax(least));
      command.input_change = jacobian_transposed_.lazyProduct(principal_ * along);
    }
    // Off what the response alone would make of it: where that is there already, or by itself beyond the tolerance.
    off_ = next_v_ - ideal_v_;
    const bool misses = !follows(next_v_) && (follows(ideal_v_) || differs(off_, 1.0));
    off_ = (wanted_ - path_a_) / settings.inputs.response;
    is_bent_ = misses && differs(off_, bent_share);
    missed_for_ = misses ? missed_for_ + settings.period : 0.0;
    reduced = reduced || is_bent_ || !follows(wanted_v_) || missed_for_ * settings.inputs.response > response_settling;
  }
  if (reduced && command.status == SafetyStatus::ok) {
    command.status = SafetyStatus::limited;
  }
}

bool Controller::Impl::slows_trajectory() const noexcept {
  for (Eigen::Index j = 0; j < path_v_.size(); ++j) {
    if (std::abs(path_v_[j]) * (1.0 - clock_.allowed) > joint_tolerance(path_v_, j)) {
      return true;
    }
  }
  return false;
}

std::string Controller::Impl::explain_input() const {
  const bool on_trajectory = trajectory_order() != nullptr, is_reduced = !on_trajectory && !follows(wanted_v_);
  Eigen::Index clearance = command.bound_by;
  std::string by;
  if (clearance < 0 && is_reduced) {
    clearance = held_clearance_;
  }
  if (clearance < 0 && is_reduced && held_joint_ >= 0) {
    by = "joint '" + arm.robot().coordinate_names()[static_cast<std::size_t>(held_joint_)] + "' and its " +
         (held_upper_ ? "upper" : "lower") + " limit";
  } else if (clearance < 0 && !on_trajectory && (is_bent_ || missed_for_ * settings.inputs.response > response_settling)) {
    clearance = system->diagnose(workspace).coordinate;
  }
  if (clearance >= 0) {
    by = parties(system->labels()[static_cast<std::size_t>(clearance)],
                 obstacles().words_for(workspace.clearances.nearest[clearance]));
  }
  if (on_trajectory) {
    std::string words = "follows a trajectory";
    if (slows_trajectory()) {
      words += " at " + in_digits(100.0 * clock_.rate, 0) + " % of its speed";
    }
    return by.empty() ? words : words + ", bent by the clearance of " + by;
  }
  const std::string lag = explain_lag();
  if (lag.empty()) {
    return "following the commanded velocity" + (by.empty() ? by : ", at the clearance of " + by);
  }
  const std::string why =
      (by.empty() ? "" : ", bent by the clearance of " + by) + (is_reduced || by.empty() ? explain_reduction() : "");
  if (why.empty() && is_bent_) {
    return lag + ", bent by barriers";
  }
  if (why.empty() && missed_for_ * settings.inputs.response <= response_settling) {
    const std::size_t numbers = lag.find(": ");
    return "on the way to the commanded velocity: " + (numbers == std::string::npos ? lag : lag.substr(numbers + 2));
  }
  return lag + why;
}

std::string Controller::Impl::explain_lag() const {
  if (follows(next_v_)) {
    return {};
  }
  const Order& order = goal_orders_.current().order;
  if (const auto* velocity = std::get_if<VelocityOrder>(&order)) {
    const Eigen::VectorXd& asked = velocity->velocity;
    Eigen::Index most = 0;  // the joint that is off by the largest part of its tolerance
    double worst = 0.0;
    for (Eigen::Index j = 0; j < asked.size(); ++j) {
      const double off = std::abs(next_v_[j] - asked[j]) / most_v_[j];
      if (off >= worst && std::abs(next_v_[j] - asked[j]) > joint_tolerance(asked, j)) {
        worst = off;
        most = j;
      }
    }
    const double side = asked[most] < 0.0 ? -1.0 : 1.0, got = side * next_v_[most];
    const bool slides = is_sliding_[static_cast<std::size_t>(most)], slower = got < std::abs(asked[most]) && asked[most] != 0.0;
    return (slower ? "slower than asked: " : "other than asked: ") +
           rates(got, std::abs(asked[most]), slides ? "m/s" : "rad/s") + " of joint '" +
           arm.robot().coordinate_names()[static_cast<std::size_t>(most)] + "'";
  }
  const auto* twist = std::get_if<TwistOrder>(&order);
  if (twist == nullptr) {
    return {};
  }
  const Vector6d got = jacobian_transposed_.transpose().lazyProduct(next_v_);
  const InputTolerance tolerance = InputTolerance::of(twist_);
  std::string words;
  // The part that lacks more of what was asked for, then what is across.
  struct Part {
    double asked, along, across, most;
    const char* unit;
  };
  const auto part = [&](int first, double most, const char* unit) {
    const Eigen::Vector3d asked = twist_.segment<3>(first), is = got.segment<3>(first);
    const double size = asked.norm(), along = size > 0.0 ? asked.dot(is) / size : 0.0;
    return Part{size, along, (is - (size > 0.0 ? Eigen::Vector3d(along / size * asked) : Eigen::Vector3d::Zero())).norm(), most,
                unit};
  };
  const Part linear = part(0, tolerance.linear + InputTolerance::least_linear, "m/s");
  const Part angular = part(3, tolerance.angular + InputTolerance::least_angular, "rad/s");
  const auto lack = [](const Part& p) { return p.asked > 0.0 ? (p.asked - p.along) / p.asked : 0.0; };
  const Part& worse = lack(linear) >= lack(angular) ? linear : angular;
  const std::string of_frame = " of frame '" + twist->frame.name + "'";
  if (lack(worse) > InputTolerance::share) {
    words = "slower than asked: " + rates(worse.along, worse.asked, worse.unit) + of_frame;
  } else if (lack(linear) < -InputTolerance::share || lack(angular) < -InputTolerance::share) {
    const Part& faster = lack(linear) < lack(angular) ? linear : angular;
    words = "faster than asked: " + rates(faster.along, faster.asked, faster.unit) + of_frame;
  }
  std::string beside;
  for (const Part& p : {linear, angular}) {
    if (p.across > p.most) {
      beside += (beside.empty() ? "" : " and ") + in_digits(p.across, 3) + " " + p.unit;
    }
  }
  if (!beside.empty()) {
    words = words.empty() ? "other than asked: " + beside + of_frame + " across it" : words + ", " + beside + " across it";
  }
  return words.empty() ? "other than asked" + of_frame : words;
}

std::string Controller::Impl::explain_reduction() const {
  const std::vector<std::string>& names = arm.robot().coordinate_names();
  const auto joint = [&](Eigen::Index j) { return ", as joint '" + names[static_cast<std::size_t>(j)] + "' "; };
  switch (follows(wanted_v_) ? Reduction::By::nothing : reduction_.by) {
    case Reduction::By::speed: {
      const bool slides = is_sliding_[static_cast<std::size_t>(reduction_.joint)];
      return joint(reduction_.joint) + "is at its velocity limit (" + in_digits(most_v_[reduction_.joint], slides ? 3 : 2) +
             (slides ? " m/s)" : " rad/s)");
    }
    case Reduction::By::joint:
      return joint(reduction_.joint) + "is at its " + (reduction_.upper ? "upper" : "lower") + " limit";
    case Reduction::By::singular: return ", " + explain_singular();
    case Reduction::By::nothing: break;
  }
  if (missed_for_ > 0.0 || command.status != SafetyStatus::ok) {
    for (std::size_t j = 0; j < command.limits.size(); ++j) {
      if (command.limits[j] != Limit::none) {
        return joint(static_cast<Eigen::Index>(j)) + "is at its " + words_of(command.limits[j]);
      }
    }
  }
  return {};
}

std::string Controller::Impl::explain_singular() const {
  const auto& twist = std::get<TwistOrder>(goal_orders_.current().order);
  const KinematicState::Link& link = twist_state_.link(twist.frame.joint);
  const Eigen::Vector3d p = link.p_WL + link.R_WL * twist.frame.X_JF.translation();
  std::vector<Eigen::Vector3d> origins;  // of the joints that move the frame, from the last one
  for (int j = twist.frame.joint; j >= 0; j = twist_state_.link(j).parent) {
    origins.push_back(twist_state_.link(j).p_WL);
  }
  const auto num = static_cast<Eigen::Index>(origins.size());
  const double rest = settings.inputs.singular * settings.inputs.singular;
  if (twist.free == TwistFreedom::none && num < 6 && (squares_.array() > rest).count() >= num) {
    return "as " + std::to_string(num) + " joints cannot move frame '" + twist.frame.name +
           "' like that; free='rotation' leaves its rotation free";
  }
  const Eigen::Vector3d lost = reduction_.lost.head<3>();
  if (twist_.head<3>().isZero() || lost.norm() < reduction_.lost.tail<3>().norm()) {
    return "as the arm is at a singular configuration, where '" + twist.frame.name + "' cannot turn that way";
  }
  const Eigen::Vector3d reach = p - origins[origins.size() - std::min<std::size_t>(2, origins.size())];  // from the shoulder
  const double out = lost.normalized().dot(reach.normalized());
  return out > outwards    ? "as the arm is stretched"
         : out < -outwards ? "as the arm is folded"
                           : "as the arm is at a singular configuration, where '" + twist.frame.name + "' cannot move that way";
}

}  // namespace sidestep

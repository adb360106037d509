// What of a velocity, twist or trajectory the command is, in words.
#include "explain_input.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "words.hpp"

namespace sidestep {
namespace {

constexpr double outwards = 0.5;  // cosine to the line from the shoulder from which an arm is stretched [-]

/// Which singular configuration keeps a twist from being what was asked for.
std::string explain_singular(const ControllerModel& model, const TwistRequest& twist, const TwistSolver& solver,
                             const Reduction& reduction) {
  const KinematicState::Link& link = solver.state().link(twist.frame.joint);
  const Eigen::Vector3d p = link.p_WL + link.R_WL * twist.frame.X_JF.translation();
  std::vector<Eigen::Vector3d> origins;  // of the joints that move the frame, from the last one
  for (int j = twist.frame.joint; j >= 0; j = solver.state().link(j).parent) {
    origins.push_back(solver.state().link(j).p_WL);
  }
  const auto num = static_cast<Eigen::Index>(origins.size());
  const double rest = model.settings.inputs.singular * model.settings.inputs.singular;
  if (twist.free == TwistFreedom::none && num < 6 && (solver.squares().array() > rest).count() >= num) {
    return "as " + std::to_string(num) + " joints cannot move frame '" + twist.frame.name +
           "' like that; free='rotation' leaves its rotation free";
  }
  const Eigen::Vector3d lost = reduction.lost.head<3>();
  if (solver.asked().head<3>().isZero() || lost.norm() < reduction.lost.tail<3>().norm()) {
    return "as the arm is at a singular configuration, where '" + twist.frame.name + "' cannot turn that way";
  }
  const Eigen::Vector3d reach = p - origins[origins.size() - std::min<std::size_t>(2, origins.size())];  // from the shoulder
  const double out = lost.normalized().dot(reach.normalized());
  return out > outwards    ? "as the arm is stretched"
         : out < -outwards ? "as the arm is folded"
                           : "as the arm is at a singular configuration, where '" + twist.frame.name + "' cannot move that way";
}

/// What makes it slower, before the program; empty where nothing does.
std::string explain_reduction(const ControllerModel& model, const InputsStage& inputs, const Command& command) {
  const VelocityFollower& velocity = inputs.velocity();
  const Reduction& reduction = velocity.what_reduces();
  const std::vector<std::string>& names = model.arm.robot().coordinate_names();
  const auto joint = [&](Eigen::Index j) { return ", as joint '" + names[static_cast<std::size_t>(j)] + "' "; };
  switch (velocity.follows(inputs.request().request(), velocity.wanted_velocity()) ? Reduction::By::nothing : reduction.by) {
    case Reduction::By::speed: {
      const bool slides = model.joints.slides(reduction.joint);
      return joint(reduction.joint) + "is at its velocity limit (" +
             in_digits(model.usable.velocity[reduction.joint], slides ? 3 : 2) + (slides ? " m/s)" : " rad/s)");
    }
    case Reduction::By::joint: return joint(reduction.joint) + "is at its " + (reduction.upper ? "upper" : "lower") + " limit";
    case Reduction::By::singular: return ", " + explain_singular(model, *inputs.request().twist(), velocity.twist(), reduction);
    case Reduction::By::nothing: break;
  }
  if (velocity.misses() || command.status != SafetyStatus::ok) {
    for (std::size_t j = 0; j < command.limits.size(); ++j) {
      if (command.limits[j] != Limit::none) {
        return joint(static_cast<Eigen::Index>(j)) + "is at its " + limit_in_words(command.limits[j]);
      }
    }
  }
  return {};
}

/// How much slower than the velocity that was asked for it moves.
std::string explain_lag(const ControllerModel& model, const VelocityRequest& velocity, const Eigen::VectorXd& next_v) {
  const Eigen::VectorXd& asked = velocity.velocity;
  Eigen::Index most = 0;  // the joint that is off by the largest part of its tolerance
  double worst = 0.0;
  for (Eigen::Index j = 0; j < asked.size(); ++j) {
    const double off = std::abs(next_v[j] - asked[j]) / model.usable.velocity[j];
    if (off >= worst && std::abs(next_v[j] - asked[j]) > joint_tolerance(asked, j, model.joints.slides(j))) {
      worst = off;
      most = j;
    }
  }
  const double side = asked[most] < 0.0 ? -1.0 : 1.0, got = side * next_v[most];
  const bool slides = model.joints.slides(most), slower = got < std::abs(asked[most]) && asked[most] != 0.0;
  return (slower ? "slower than asked: " : "other than asked: ") +
         rates_in_words(got, std::abs(asked[most]), slides ? "m/s" : "rad/s") + " of joint '" +
         model.arm.robot().coordinate_names()[static_cast<std::size_t>(most)] + "'";
}

/// The same of a twist.
std::string explain_lag(const TwistRequest& twist, const TwistSolver& solver, const Eigen::VectorXd& next_v) {
  const Vector6d& asked_twist = solver.asked();
  const Vector6d got = solver.frame_motion(next_v);
  const InputTolerance tolerance = InputTolerance::of(asked_twist);
  std::string words;
  // The part that lacks more of what was asked for, then what is across.
  struct Part {
    double asked, along, across, most;
    const char* unit;
  };
  const auto part = [&](int first, double most, const char* unit) {
    const Eigen::Vector3d asked = asked_twist.segment<3>(first), is = got.segment<3>(first);
    const double size = asked.norm(), along = size > 0.0 ? asked.dot(is) / size : 0.0;
    return Part{size, along, (is - (size > 0.0 ? Eigen::Vector3d(along / size * asked) : Eigen::Vector3d::Zero())).norm(), most,
                unit};
  };
  const Part linear = part(0, tolerance.linear + InputTolerance::least_linear, "m/s");
  const Part angular = part(3, tolerance.angular + InputTolerance::least_angular, "rad/s");
  const auto lack = [](const Part& p) { return p.asked > 0.0 ? (p.asked - p.along) / p.asked : 0.0; };
  const Part& worse = lack(linear) >= lack(angular) ? linear : angular;
  const std::string of_frame = " of frame '" + twist.frame.name + "'";
  if (lack(worse) > InputTolerance::share) {
    words = "slower than asked: " + rates_in_words(worse.along, worse.asked, worse.unit) + of_frame;
  } else if (lack(linear) < -InputTolerance::share || lack(angular) < -InputTolerance::share) {
    const Part& faster = lack(linear) < lack(angular) ? linear : angular;
    words = "faster than asked: " + rates_in_words(faster.along, faster.asked, faster.unit) + of_frame;
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

/// How much slower than the velocity or twist that was asked for it moves; empty where it does not.
std::string explain_lag(const ControllerModel& model, const InputsStage& inputs, const Eigen::VectorXd& next_v) {
  const Request& request = inputs.request().request();
  if (inputs.velocity().follows(request, next_v)) {
    return {};
  }
  if (const auto* velocity = std::get_if<VelocityRequest>(&request)) {
    return explain_lag(model, *velocity, next_v);
  }
  return explain_lag(std::get<TwistRequest>(request), inputs.velocity().twist(), next_v);
}

}  // namespace

std::string explain_input(const ControllerModel& model, const InputsStage& inputs, const AttractorStage& attractor,
                          const Command& command, const Eigen::VectorXd& next_v, const Obstacles& obstacles) {
  const VelocityFollower& velocity = inputs.velocity();
  const VelocityBounds::First& held = velocity.first_held();
  const bool on_trajectory = inputs.request().trajectory() != nullptr;
  const bool is_reduced = !on_trajectory && !velocity.follows(inputs.request().request(), velocity.wanted_velocity());
  Eigen::Index clearance = command.bound_by;
  std::string by;
  if (clearance < 0 && is_reduced) {
    clearance = held.clearance;
  }
  if (clearance < 0 && is_reduced && held.joint >= 0) {
    by = "joint '" + model.arm.robot().coordinate_names()[static_cast<std::size_t>(held.joint)] + "' and its " +
         (held.upper ? "upper" : "lower") + " limit";
  } else if (clearance < 0 && !on_trajectory && (velocity.bends() || velocity.misses_for_long())) {
    clearance = attractor.system().diagnose(attractor.at_reference()).coordinate;
  }
  if (clearance >= 0) {
    by = parties(model.system->labels()[static_cast<std::size_t>(clearance)],
                 obstacles.words_for(attractor.at_reference().clearances.nearest[clearance]));
  }
  if (on_trajectory) {
    std::string words = "follows a trajectory";
    if (inputs.trajectory().is_slowed()) {
      words += " at " + in_digits(100.0 * inputs.trajectory().rate(), 0) + " % of its speed";
    }
    return by.empty() ? words : words + ", bent by the clearance of " + by;
  }
  const std::string lag = explain_lag(model, inputs, next_v);
  if (lag.empty()) {
    return "following the commanded velocity" + (by.empty() ? by : ", at the clearance of " + by);
  }
  const std::string why = (by.empty() ? "" : ", bent by the clearance of " + by) +
                          (is_reduced || by.empty() ? explain_reduction(model, inputs, command) : "");
  if (why.empty() && velocity.bends()) {
    return lag + ", bent by barriers";
  }
  if (why.empty() && !velocity.misses_for_long()) {
    const std::size_t numbers = lag.find(": ");
    return "on the way to the commanded velocity: " + (numbers == std::string::npos ? lag : lag.substr(numbers + 2));
  }
  return lag + why;
}

}  // namespace sidestep

#include "sidestep/constraints/motion_program.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "../math/cholesky.hpp"
#include "../math/finite.hpp"
#include "../math/settings.hpp"
#include "sidestep/constraints/clearance_constraints.hpp"
#include "sidestep/constraints/gravity_torque_constraint.hpp"
#include "sidestep/constraints/joint_limit_constraint.hpp"
#include "sidestep/constraints/speed_constraint.hpp"
#include "sidestep/constraints/torque_constraint.hpp"
#include "sidestep/constraints/torque_rate_constraint.hpp"
#include "tolerances.hpp"

namespace sidestep {
namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();  // Value of what is unknown.

// Asymmetry of a mass matrix that is rounding, relative to its largest entry: more is an error, for example a triangle that
// was never filled.
constexpr double symmetry_tolerance = 1e-6;

Eigen::VectorXd expanded(const Eigen::VectorXd& weight, int num) {
  return weight.size() == 1 ? Eigen::VectorXd::Constant(num, weight[0]) : weight;
}

MotionProgramSettings completed(MotionProgramSettings settings, const Robot& robot) {
  settings.validate(robot);
  settings.hard_bounds = settings.hard_bounds || !settings.by_torque;
  return settings;
}

JointLimits limits_for(const Robot& robot, bool by_torque) {
  JointLimits limits = robot.limits();
  if (!by_torque) {
    limits.effort.setConstant(infinity);
    limits.effort_rate = limits.effort;
  }
  return limits;
}

/// The constraints of every arm, in the order in which their rows stand in the program; then those of one's own.
MotionProgram::Constraints all_constraints(const Robot& robot, const MotionProgramSettings& settings, const JointLimits& limits,
                                           MotionProgram::Constraints own) {
  MotionProgram::Constraints all;
  all.push_back(
      std::make_unique<JointLimitConstraint>(limits, JointLimitSettings{settings.position_margin, settings.velocity_overrun,
                                                                        settings.acceleration_overrun, settings.hard_bounds}));
  all.push_back(std::make_unique<TorqueConstraint>(limits));
  all.push_back(std::make_unique<TorqueRateConstraint>(limits));
  all.push_back(std::make_unique<GravityTorqueConstraint>(limits));
  all.push_back(std::make_unique<ClearanceConstraints>(limits, settings.safety));
  if (settings.limits_speed) {
    all.push_back(std::make_unique<SpeedConstraint>(robot));
  }
  std::move(own.begin(), own.end(), std::back_inserter(all));
  return all;
}

std::vector<RowBlock> blocks_for(const MotionProgram::Constraints& constraints, int num_coordinates) {
  std::vector<RowBlock> blocks;
  for (const auto& constraint : constraints) {
    const Priority priority = constraint->priority();
    if (constraint->max_rows() > 0 && priority != Priority::never && priority != Priority::clearance &&
        priority != Priority::comfort) {
      throw std::invalid_argument("motion program: rows of a constraint give way by never, clearance or comfort, not " +
                                  std::string(priority == Priority::jerk ? "jerk" : "position"));
    }
    blocks.emplace_back(constraint->max_rows(), num_coordinates, priority);
  }
  return blocks;
}

}  // namespace

MotionProgram::MotionProgram(const Robot& robot, MotionProgramSettings settings, Constraints own)
    : nv_(robot.num_coordinates()),
      settings_(completed(std::move(settings), robot)),
      limits_(limits_for(robot, settings_.by_torque)),
      tracking_weight_(expanded(settings_.tracking_weight, nv_)),
      torque_cost_(settings_.by_torque
                       ? Eigen::VectorXd(expanded(settings_.torque_weight, nv_).cwiseQuotient(limits_.effort.cwiseAbs2()))
                       : Eigen::VectorXd::Zero(nv_)),
      effort_has_rate_(limits_.effort_rate.array().isFinite().any()),
      constraints_(all_constraints(robot, settings_, limits_, std::move(own))),
      bounds_(nv_),
      blocks_(blocks_for(constraints_, nv_)),
      hard_(nv_, blocks_),
      slack_(nv_, blocks_, settings_.slack_weight),
      shortfall_(nv_, blocks_),
      short_rows_(blocks_),
      mass_(Eigen::MatrixXd::Identity(nv_, nv_)),
      mass_cholesky_(mass_),
      position_(Eigen::VectorXd::Zero(nv_)),
      velocity_(position_),
      wanted_(position_),
      bias_(position_) {}

ProgramStatus MotionProgram::solve(const MotionRequest& request, MotionSolution& solution) noexcept {
  Known known = take(request);
  const LastCommand& last = request.last;
  const BrakingTorque dynamics{mass_, mass_cholesky_, bias_};
  const bool dynamics_known = known.mass && known.bias;
  Survey found;
  const MotionPeriods& periods = request.periods;
  const double period = periods.coming > 0.0 ? periods.coming : settings_.period;
  const bool torque_has_rate = effort_has_rate_ && settings_.by_torque;
  const Moment now{period,
                   torque_has_rate ? periods.speed : 1.0,
                   torque_has_rate ? periods.inside : 0.0,
                   periods.torque > 0.0 ? std::min(periods.torque, period) : period,
                   position_,
                   velocity_,
                   known.acceleration ? &wanted_ : nullptr,
                   dynamics_known ? &dynamics : nullptr,
                   known.mass && last.torque != nullptr ? jerk_share(periods) : 1.0,
                   last.torque != nullptr && effort_has_rate_,
                   last,
                   request.clearances,
                   request.second,
                   request.speed,
                   found};
  for (const auto& constraint : constraints_) {
    known.constraints = constraint->usable(now) && known.constraints;
    constraint->survey(now, found);
  }
  solution.fault = !known.q              ? ProgramFault::position
                   : !known.v            ? ProgramFault::velocity
                   : !known.acceleration ? ProgramFault::acceleration
                   : !known.mass         ? ProgramFault::mass_matrix
                   : !known.bias         ? ProgramFault::bias
                   : !known.constraints  ? ProgramFault::clearances
                                         : ProgramFault::none;
  write(now, known, solution);
  if (known.all()) {
    solution.status = solve_constrained(now, known.acceleration && known.constraints, solution);
  } else {
    stop(now, known.mass, solution);
    if (!dynamics_known) {
      solution.acceleration.setConstant(not_a_number);
    }
    solution.status = ProgramStatus::fallback_invalid_input;
  }
  ++counts_[static_cast<std::size_t>(solution.status)];
  return solution.status;
}

MotionProgram::Known MotionProgram::take(const MotionRequest& request) noexcept {
  const auto usable = [this](const auto& x) { return x.size() == nv_ && all_finite(x); };
  const bool by_torque = settings_.by_torque;
  const Known known{usable(request.q),
                    usable(request.v),
                    usable(request.acceleration),
                    !by_torque || take_mass(request),
                    !by_torque || usable(request.bias),
                    true};
  if (known.q) {
    position_ = request.q;
  }
  if (known.v) {
    velocity_ = request.v;
  } else {
    velocity_.setZero();
  }
  if (known.acceleration) {
    wanted_ = request.acceleration;
  }
  if (by_torque && known.bias) {
    bias_ = request.bias;
  }
  return known;
}

bool MotionProgram::take_mass(const MotionRequest& request) noexcept {
  if (request.mass_matrix.rows() != nv_ || request.mass_matrix.cols() != nv_ || !all_finite(request.mass_matrix)) {
    return false;
  }
  mass_ = request.mass_matrix;
  const double largest = mass_.cwiseAbs().maxCoeff();
  for (int j = 0; j < nv_; ++j) {
    for (int i = j + 1; i < nv_; ++i) {
      if (std::abs(mass_(i, j) - mass_(j, i)) > symmetry_tolerance * largest) {
        return false;
      }
    }
  }
  return cholesky(mass_, mass_cholesky_);
}

double MotionProgram::jerk_share(const MotionPeriods& periods) const noexcept {
  const double period = periods.coming > 0.0 ? periods.coming : settings_.period;
  const double rate_share = periods.torque > 0.0 ? std::min(1.0, periods.torque / period) : 1.0;
  return sidestep::jerk_share(mass_, limits_, rate_share);
}

void MotionProgram::write(const Moment& now, const Known& known, MotionSolution& solution) noexcept {
  solution.slack.setZero();
  std::fill(solution.active.begin(), solution.active.end(), Limit::none);
  solution.speed_frame = -1;
  solution.speed_slack = 0.0;
  solution.num_safety_rows = 0;
  solution.dominant = -1;
  solution.least_clearance = now.found.least_clearance;
  solution.least_coordinate = now.found.least_coordinate;
  solution.least_nearest = now.found.least_nearest;
  solution.lower.setConstant(not_a_number);
  solution.upper.setConstant(not_a_number);
  for (std::size_t k = 0; k < blocks_.size(); ++k) {
    blocks_[k].clear();
    if ((known.all() && (known.constraints || constraints_[k]->usable(now))) ||
        (known.state() && constraints_[k]->bounds_stop())) {
      constraints_[k]->append(now, bounds_, blocks_[k]);
    }
  }
  if (known.state()) {
    solution.lower = bounds_.box.lower;
    solution.upper = bounds_.box.upper;
  }
}

ProgramStatus MotionProgram::solve_constrained(const Moment& now, bool usable, MotionSolution& solution) noexcept {
  const bool smooth = now.last.acceleration != nullptr || now.last.torque != nullptr;
  if (!usable) {
    wanted_ = -velocity_ / settings_.stop_time;
  }
  hard_.write_torque(mass_, bounds_.torque);
  hard_.write_cost(cost());
  const Search found = search(now, solution);
  ProgramStatus status;
  if (found.solved && !found.recovers && !presses_for_lost(blocks_)) {
    const bool free =
        std::all_of(solution.active.begin(), solution.active.end(), [](Limit limit) { return limit == Limit::none; }) &&
        std::all_of(blocks_.begin(), blocks_.end(), [](const RowBlock& block) { return block.multipliers.isZero(0.0); });
    status = !found.kept_jerk ? ProgramStatus::relaxed : free ? ProgramStatus::ok : ProgramStatus::limited;
  } else {
    for (std::size_t k = 0; now.found.lost() && k < blocks_.size(); ++k) {
      constraints_[k]->defer_recovery(now, blocks_[k]);
    }
    // Recovery shares what the jerk limits leave; so do ways out while nothing of them closes, unless others need more.
    const bool waits = now.found.lost() && !now.found.closes && smooth;
    status = solve_relaxed(now, found.recovers || waits, solution);
    if (waits && (status == ProgramStatus::fallback_solver || others_fall_short(blocks_, solution.acceleration))) {
      status = solve_relaxed(now, found.recovers, solution);
    }
    if (!(found.kept_jerk && (found.recovers || !smooth))) {
      status = std::max(status, ProgramStatus::relaxed);
    }
  }
  solution.status = status;
  for (std::size_t k = 0; k < blocks_.size(); ++k) {
    constraints_[k]->report(now, bounds_, blocks_[k], wanted_, solution);
    if (blocks_[k].unreachable) {
      solution.status = std::max(solution.status, ProgramStatus::relaxed_safety);
    }
  }
  return usable || solution.status == ProgramStatus::fallback_solver ? solution.status : ProgramStatus::fallback_invalid_input;
}

bool MotionProgram::solve_hard(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper, bool smooth,
                               MotionSolution& solution) noexcept {
  return hard_.solve(lower, upper, smooth, bounds_, blocks_, solution) && accept(solution);
}

MotionProgram::Search MotionProgram::search(const Moment& now, MotionSolution& solution) noexcept {
  const AccelerationBounds& box = bounds_.box;
  Search found{solve_hard(box.smooth_lower, box.smooth_upper, true, solution)};
  if (found.solved || (now.last.acceleration == nullptr && now.last.torque == nullptr)) {
    return found;
  }
  bool relaxes = false;
  for (std::size_t k = 0; !now.found.lost() && k < blocks_.size(); ++k) {
    relaxes = constraints_[k]->relax_to_braking(now, blocks_[k]) || relaxes;
  }
  if (relaxes) {
    found.solved = solve_hard(box.smooth_lower, box.smooth_upper, true, solution);
    for (std::size_t k = 0; k < blocks_.size(); ++k) {
      if (found.solved) {
        found.recovers = constraints_[k]->add_recovery(blocks_[k]) || found.recovers;
      } else {
        constraints_[k]->restore(blocks_[k]);
      }
    }
  }
  if (!found.solved) {
    found.kept_jerk = false;
    found.solved = search_without_jerk(now, solution);
  }
  return found;
}

bool MotionProgram::search_without_jerk(const Moment& now, MotionSolution& solution) noexcept {
  // As near as can be to what jerk and torque rate allow: the task has no say in what is beyond. Jerk gives way, or the bounds of
  // a state that noise and disturbances change faster than torque may. The torque's rate stays, since motors take no other.
  const AccelerationBounds& box = bounds_.box;
  wanted_ = wanted_.cwiseMax(box.smooth_lower).cwiseMin(box.smooth_upper);
  hard_.write_cost(cost());
  for (const auto& constraint : constraints_) {
    constraint->widen(Priority::jerk, now, bounds_);
  }
  const bool keeps_rate = now.keeps_torque_rate && !now.found.lost();
  return solve_hard(bounds_.wide.lower, bounds_.wide.upper, false, solution) ||
         (now.last.torque != nullptr && !keeps_rate && solve_hard(box.lower, box.upper, false, solution));
}

bool MotionProgram::accept(MotionSolution& solution) const noexcept {
  solution.torque = bias_;
  for (int j = 0; j < nv_; ++j) {
    solution.torque += solution.acceleration[j] * mass_.col(j);
  }
  for (const auto& constraint : constraints_) {
    if (!constraint->admit(solution)) {
      return false;
    }
  }
  return solution.torque.allFinite();
}

void MotionProgram::stop(const Moment& now, bool mass_known, MotionSolution& solution) const noexcept {
  const BrakingTorque dynamics{mass_, mass_cholesky_, bias_};
  const DampedStop damped{settings_.stop_time, settings_.stop_damping};
  damped.apply({now.torque_period, limits_, velocity_, now.last.torque, dynamics, mass_known}, solution);
}

}  // namespace sidestep

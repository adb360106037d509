#include "sidestep/constraints/clearance_constraints.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "../math/settings.hpp"
#include "largest_product.hpp"
#include "tolerances.hpp"

namespace sidestep {
namespace {

// Braking deceleration that stands for zero [m/s²], so that the profile stays defined.
constexpr double smallest_deceleration = 1e-6;
constexpr double at_rest = 1e-6;  // Speed of a joint that counts as rest [rad/s | m/s].

/// Whether anything comes nearer that is lost already.
bool lost_closes(const Clearances* clearances) noexcept {
  const Eigen::Index num = clearances == nullptr ? 0 : clearances->nearest.size();
  for (Eigen::Index k = 0; k < num; ++k) {
    if (clearances->nearest[k] >= 0 && clearances->least[k] < 0.0 && clearances->approach.rates[k] < -creeping) {
      return true;
    }
  }
  return false;
}

void find_least(const Clearances* clearances, Survey& found) noexcept {
  if (clearances == nullptr) {
    return;
  }
  const Eigen::Index num = std::min({clearances->nearest.size(), clearances->least.size(), clearances->values.size()});
  for (Eigen::Index k = 0; k < num; ++k) {
    const double value = clearances->least[k];
    if (clearances->nearest[k] >= 0 && value < found.least_clearance) {
      found.least_clearance = value;
      found.least_coordinate = static_cast<int>(k);
      found.least_nearest = clearances->nearest[k];
    }
  }
}

}  // namespace

ClearanceConstraints::ClearanceConstraints(JointLimits limits, SafetySettings settings)
    : limits_(std::move(limits)),
      settings_((settings.validate(), settings)),
      effort_is_limited_(limits_.effort.array().isFinite().any()),
      coordinates_(static_cast<std::size_t>(settings.max_rows)),
      nearest_(coordinates_),
      along_path_(coordinates_.size()),
      reserves_(coordinates_.size()),
      asked_(Eigen::VectorXd::Zero(settings.max_rows)),
      urgency_(asked_),
      least_(Eigen::VectorXd::Zero(limits_.acceleration.size())),
      next_lower_(least_),
      next_upper_(least_),
      braking_(static_cast<int>(least_.size()), settings.max_rows) {}

bool ClearanceConstraints::usable(const Moment& now) const noexcept {
  return (now.clearances == nullptr || usable(*now.clearances)) &&
         (now.second.clearances == nullptr || usable(*now.second.clearances));
}

bool ClearanceConstraints::usable(const Clearances& clearances) const noexcept {
  const Eigen::Index num = clearances.nearest.size();
  const ClearanceState& approach = clearances.approach;
  if (clearances.least.size() != num || clearances.curvatures.size() != num || clearances.margins.size() != num ||
      approach.values.size() != num || approach.rates.size() != num || approach.curvatures.size() != num ||
      approach.gradients.rows() != least_.size() || approach.gradients.cols() != num) {
    return false;
  }
  for (Eigen::Index k = 0; k < num; ++k) {
    if (clearances.nearest[k] >= 0 &&
        !(!std::isnan(clearances.least[k]) && std::isfinite(clearances.curvatures[k]) && std::isfinite(approach.values[k]) &&
          std::isfinite(approach.rates[k]) && std::isfinite(approach.curvatures[k]) && approach.gradients.col(k).allFinite())) {
      return false;
    }
  }
  return true;
}

void ClearanceConstraints::survey(const Moment& now, Survey& found) const noexcept {
  find_least(now.clearances, found);
  find_least(now.second.clearances, found);
  found.closes = found.lost() && (!usable(now) || lost_closes(now.clearances) || lost_closes(now.second.clearances));
}

void ClearanceConstraints::append(const Moment& now, Bounds& bounds, RowBlock& rows) noexcept {
  const LastCommand& last = now.last;
  if (now.clearances != nullptr) {
    if (last.acceleration != nullptr && now.keeps_torque_rate) {
      next_lower_ = *last.acceleration - now.period * limits_.jerk;
      next_upper_ = *last.acceleration + now.period * limits_.jerk;
    }
    const RateLimits next{next_lower_, next_upper_, bounds.torque.lower, bounds.torque.upper};
    const LastMotion motion{last.acceleration != nullptr ? *last.acceleration : now.velocity, now.jerk_share,
                            last.early && now.keeps_torque_rate && !now.found.lost(), now.found.closes,
                            now.keeps_torque_rate ? &next : nullptr};
    const BrakingTorque* const torque = effort_is_limited_ ? now.dynamics : nullptr;
    const LastMotion* const before = last.acceleration != nullptr ? &motion : nullptr;
    add(*now.clearances, {now.velocity, limits_, bounds.box, now.period, torque, before}, rows);
    if (now.second.clearances != nullptr) {
      add(*now.second.clearances, {*now.second.velocity, limits_, bounds.box, now.period, torque, before}, rows);
    }
  }
  if (last.decided != nullptr) {
    for (int k = 0; k < rows.size; ++k) {
      rows.lower[k] = std::min(rows.lower[k], rows.normals.row(k).dot(last.decided->transpose()));
    }
  }
}

void ClearanceConstraints::add(const Clearances& clearances, const BrakingState& state, RowBlock& rows) noexcept {
  const double tau = braking_.stop_time(state.v, state.limits, state.torque);
  // [1/s²] Of v: the jerk of a stop along the path.
  const double jerk = state.last == nullptr ? 0.0 : (state.limits.jerk.array() / state.v.array().abs().max(at_rest)).minCoeff();
  PathStop stop{tau, tau * settings_.rate > 1.0 ? 1.0 / tau : settings_.rate, jerk};
  least_ = -state.limits.acceleration;
  const ClearanceState& approach = clearances.approach;
  const int first = rows.size = std::min(rows.size, max_rows() - max_rows() / 2);
  choose(clearances, stop, state.period, first, rows);
  if (state.torque != nullptr) {
    braking_.update(first, rows.size, coordinates_, approach.gradients, state.limits, *state.torque);
  }
  for (int row = first; row < rows.size; ++row) {
    const auto at = static_cast<std::size_t>(row);
    const int k = coordinates_[at];
    const auto gradient = approach.gradients.col(k);
    along_path_[at] = 0;
    double required = 0.0;
    const Closing closing = closing_of(row, clearances, state, stop, required);
    required = without_excess(required, closing, row, state.period, stop);
    reserves_[at] = {closing.distance_left, closing.u, closing.c};
    reserves_[at].limits = closing.limits;
    reserves_[at].margin = approach.values[k] - closing.distance_left;
    reserves_[at].seen = clearances.margins[k] == infinity;
    if (state.last != nullptr) {
      required = with_jerk(required, closing, row, gradient, state, stop);
    }
    const double length = gradient.norm();
    rows.normals.row(row) = gradient.transpose() / length;
    rows.lower[row] = required / length;
    rows.lengths[row] = length;
    nearest_[at] = clearances.nearest[k];
    rows.depths[row] =
        clearances.least[k] < infinity ? std::max(-approach.values[k], 0.0) : 0.0;  // nothing is lost that touches nothing
  }
  if (stop.row >= 0) {
    append_stop(stop, state, rows);
  }
}

double ClearanceConstraints::distance_left_of(const Clearances& clearances, Eigen::Index k) const noexcept {
  return clearances.approach.values[k] - std::min(settings_.margin, clearances.margins[k]);
}

void ClearanceConstraints::choose(const Clearances& clearances, const PathStop& stop, double period, int first,
                                  RowBlock& rows) noexcept {
  // Insert into the list of the most critical, which is kept sorted; it is short.
  const ClearanceState& approach = clearances.approach;
  for (Eigen::Index k = 0; k < clearances.nearest.size(); ++k) {
    if (clearances.nearest[k] < 0 || max_rows() == 0) {
      continue;
    }
    if (!(approach.gradients.col(k).norm() > shortest_gradient)) {
      const ClosingLimits none{smallest_deceleration, smallest_deceleration, stop.rate, settings_.correction};
      const double c = std::min(approach.curvatures[k], std::max(clearances.curvatures[k], 0.0));
      if (demanded_deceleration(distance_left_of(clearances, k), -approach.rates[k], none, period) > c) {
        rows.unreachable = true;
      }
      continue;
    }
    const double urgency = distance_left_of(clearances, k) + approach.rates[k] / stop.rate;
    if (rows.size == max_rows() && (rows.size == first || urgency >= urgency_[rows.size - 1])) {
      continue;
    }
    int at = rows.size < max_rows() ? rows.size++ : rows.size - 1;
    for (; at > first && urgency_[at - 1] > urgency; --at) {
      urgency_[at] = urgency_[at - 1];
      coordinates_[static_cast<std::size_t>(at)] = coordinates_[static_cast<std::size_t>(at) - 1];
    }
    urgency_[at] = urgency;
    coordinates_[static_cast<std::size_t>(at)] = static_cast<int>(k);
  }
}

void ClearanceConstraints::append_stop(const PathStop& stop, const BrakingState& state, RowBlock& rows) noexcept {
  const int row = rows.size < max_rows() ? rows.size++ : rows.size - 1;
  const auto at = static_cast<std::size_t>(row), of = static_cast<std::size_t>(stop.row);
  along_path_[at] = 1;
  const double speed = state.v.norm();
  rows.normals.row(row) = -state.v.transpose() / speed;
  rows.lower[row] = stop.hardest * speed / stop.tau;
  const RateLimits* const rates = state.torque != nullptr && state.last != nullptr ? state.last->rates : nullptr;
  if (rates != nullptr) {
    rows.lower[row] = within_rates(rows.normals.row(row).transpose(), rows.lower[row], *rates);
  }
  rows.lengths[row] = rows.lengths[stop.row];
  coordinates_[at] = coordinates_[of];
  nearest_[at] = nearest_[of];
  rows.depths[row] = 0.0;
}

void ClearanceConstraints::report(const Moment& now, const Bounds&, const RowBlock& rows, const Eigen::VectorXd& wanted,
                                  MotionSolution& solution) const noexcept {
  solution.num_safety_rows = std::min(rows.size, static_cast<int>(solution.safety.size()));
  double largest = 0.0;
  for (int k = 0; k < solution.num_safety_rows; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const double slack = rows.shortfall(k, solution.acceleration, wanted.norm());
    solution.safety[at] = {coordinates_[at],   nearest_[at], along_path_[at] != 0, rows.lengths[k] * rows.lower[k], slack,
                           rows.multipliers[k]};
    if (rows.multipliers[k] > largest) {
      largest = rows.multipliers[k];
      solution.dominant = k;
    }
  }
  if (now.found.lost()) {
    solution.status = std::max(solution.status, ProgramStatus::clearance_lost);
  }
}

}  // namespace sidestep

#include "sidestep/constraints/safety_rows.hpp"

#include <algorithm>
#include <cmath>

#include "../math/settings.hpp"
#include "../math/cholesky.hpp"

namespace sidestep {
namespace {

// A clearance whose gradient is shorter than this [m/rad] is one that no joint can change.
constexpr double shortest_gradient = 1e-6;
// A leaving speed that is missing comes by this many times the rate: see the header.
constexpr double firmness = 3.0;
// A stop along the path takes at most this many times as long by the torque as by the acceleration limits: beyond,
// lines would be so flat that the arm stood still.
constexpr double longest_stop = 10.0;
// What closes in no more than this [m/s] faster than by the arm's own motion is held off by the margin.
constexpr double slow = 0.01;
// Stands for a braking deceleration of zero [m/s²], so that the profile stays defined.
constexpr double smallest_deceleration = 1e-6;
// What accelerations and torques leave together is looked for where so small a share of what they leave alone would matter.
constexpr double scarce = 0.05;
// [m/s] What closes no faster does not close: rounding, or a clearance that joints hardly change.
constexpr double creeping = 1e-4;
// [m] Stands for the depth of what is not lost, so that its way back counts as that of what is: after what others have to keep.
constexpr double least_depth = 1e-6;
// Of its margin, what a clearance keeps that opposes the way out of a lost one.
constexpr double of_margin = 0.2;
constexpr double at_rest = 1e-6;              // [rad/s | m/s], or slower
constexpr double linear = 1e4;                // weight of the direction against the size of accelerations
constexpr double largest_acceleration = 1e3;  // stands for what has no limit [/s²]
// Of the jerk limits that one row takes, leaving some to others, and takes where that is not enough; of the hardest deceleration, that
// a smooth stop counts on.
constexpr double of_jerk = 0.5, of_jerk_alone = 0.95, of_hardest = 0.75;

/// The speed w with p(w) + delay w = room; with delay = 0 the inverse of p. Odd in the room.
double profile_speed(double room, double delay, double A, double rate) noexcept {
  const double size = std::abs(room);
  double speed = size / (1.0 / rate + delay);
  if (speed > A / rate) {
    speed = A * (std::sqrt(delay * delay + 2.0 * (size - 0.5 * A / (rate * rate)) / A) - delay);
  }
  return std::copysign(speed, room);
}

/// p(u): the room that a closing speed needs.
double room_needed(double speed, double A, double rate) noexcept {
  const double size = std::abs(speed);
  return std::copysign(size > A / rate ? 0.5 * (size * size / A + A / (rate * rate)) : size / rate, speed);
}

/// κ, see the header: how many times harder than −v/τ an arm has to stop to keep a room > 0.
double hardness_of_stop(double room, double u, double c, double stop_time) noexcept {
  const double linear = 0.5 * u * stop_time, bent = 0.125 * std::max(-c, 0.0) * stop_time * stop_time;
  return (linear + std::sqrt(linear * linear + 4.0 * bent * room)) / (2.0 * room);
}

/// Whether a stop that begins at a closing speed u, slowing by `slowing` now, fits into the room: by at most A, with jerk J.
bool smooth_stop_fits(double room, double u, double slowing, double A, double J, double period) noexcept {
  const double next = u - slowing * period;
  return room - std::max(u, next) * period >= jerk_braking_distance(next, std::max(-slowing, -A), A, J);
}

/// The least x in [low, high], but for rounding, that fits; `high` does.
template <class Fits>
double least_that_fits(double low, double high, const Fits& fits) noexcept {
  if (low >= high || fits(low)) {
    return low;
  }
  constexpr int halvings = 12;
  for (int n = 0; n < halvings; ++n) {
    const double middle = 0.5 * (low + high);
    (fits(middle) ? high : low) = middle;
  }
  return high;
}

/// The largest direction·a with lower <= a <= upper; a joint that does not count may be without limits.
template <class Direction, class Lower, class Upper>
double largest_product(const Direction& direction, const Lower& lower, const Upper& upper) noexcept {
  double sum = 0.0;
  for (Eigen::Index j = 0; j < direction.size(); ++j) {
    const double d = direction[j];
    if (d != 0.0) {
      sum += d > 0.0 ? d * upper[j] : d * lower[j];
    }
  }
  return sum;
}

}  // namespace

double demanded_deceleration(double room, double u, const ClosingLimits& limits, double period) noexcept {
  const double A = limits.comfortable, rate = limits.rate;
  const bool braking = room_needed(u, A, rate) + u * period > room;
  const double c = braking ? 0.5 : 1.0;
  const double next = profile_speed(room - (1.0 - c) * u * period, c * period, A, rate);
  const double at_once = (u - next) / period;
  const double allowed = profile_speed(room, 0.0, A, rate);
  if (u <= allowed) {
    return at_once;
  }
  const double along_profile = std::clamp(rate * allowed, -A, A);
  const double left = room - u * period;
  const double for_a_stop = u > 0.0 && left > 0.0 ? std::max(rate * u, u * u / (2.0 * left)) : infinity;
  const double too_fast = std::max(u - std::max(allowed, 0.0), 0.0);  // closing
  const double too_slow = std::max(std::min(u, 0.0) - allowed, 0.0);  // leaving
  const double away = std::min(along_profile + firmness * rate * too_slow, A);
  const double returning = away + limits.correction * too_fast / period;
  return std::min({at_once, returning, for_a_stop, limits.hardest});
}

template <>
const std::vector<Field<SafetySettings>>& fields() {
  using S = SafetySettings;
  static const std::vector<Field<S>> all{
      {"margin", &S::margin, "m", 0.0, 0.5,
       "clearance that every command keeps: covers tracking error, delay and noise of points"},
      {"rate", &S::rate, "1/s", 0.5, 200.0, "how quickly a clearance may close on its margin: larger comes close quicker"},
      {"braking_fraction", &S::braking_fraction, "-", 0.05, 1.0, "share of the hardest deceleration that is counted on"},
      {"correction", &S::correction, "-", 0.01, 1.0, "share of an excess of closing speed that one period takes away"},
      {"max_rows", &S::max_rows, "-", 1.0, 256.0, "clearances that bound one command: the most critical ones"},
  };
  return all;
}

void SafetySettings::validate() const { check_fields("safety: ", *this); }

SafetyRows::SafetyRows(int num_coordinates, SafetySettings settings)
    : normals(RowMatrix::Zero((settings.validate(), settings.max_rows), num_coordinates)),
      lower(Eigen::VectorXd::Zero(normals.rows())),
      lengths(Eigen::VectorXd::Zero(normals.rows())),
      coordinates(static_cast<std::size_t>(normals.rows())),
      nearest(static_cast<std::size_t>(normals.rows())),
      depths(Eigen::VectorXd::Zero(normals.rows())),
      along_path(static_cast<std::size_t>(normals.rows())),
      settings_(settings),
      reserves_(static_cast<std::size_t>(normals.rows())),
      asked_(Eigen::VectorXd::Zero(normals.rows())),
      urgency_(asked_),
      response_(Eigen::VectorXd::Zero(num_coordinates)),
      responses_(RowMatrix::Zero(num_coordinates, normals.rows())),
      least_(response_),
      effort_lower_(response_),
      effort_upper_(response_),
      reach_data_(num_coordinates, num_coordinates),
      reach_(num_coordinates, num_coordinates) {}

bool SafetyRows::usable(const Clearances& clearances) const noexcept {
  const Eigen::Index num = clearances.nearest.size();
  const ClearanceState& approach = clearances.approach;
  if (clearances.least.size() != num || clearances.curvatures.size() != num || clearances.margins.size() != num ||
      approach.values.size() != num || approach.rates.size() != num || approach.curvatures.size() != num ||
      approach.gradients.rows() != normals.cols() || approach.gradients.cols() != num) {
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

void SafetyRows::find_responses(int first, const ClearanceState& approach, const Eigen::MatrixXd& L) noexcept {
  const Eigen::Index nv = responses_.rows();
  for (int row = first; row < size_; ++row) {
    responses_.col(row) = approach.gradients.col(coordinates[static_cast<std::size_t>(row)]);
  }
  const auto divide = [&](Eigen::Index i) {
    for (int row = first; row < size_; ++row) {
      responses_(i, row) /= L(i, i);
    }
  };
  const auto subtract = [&](Eigen::Index i, double factor, Eigen::Index k) {
    for (int row = first; row < size_; ++row) {
      responses_(i, row) -= factor * responses_(k, row);
    }
  };
  for (Eigen::Index i = 0; i < nv; ++i) {
    for (Eigen::Index k = 0; k < i; ++k) {
      subtract(i, L(i, k), k);
    }
    divide(i);
  }
  for (Eigen::Index i = nv - 1; i >= 0; --i) {
    for (Eigen::Index k = i + 1; k < nv; ++k) {
      subtract(i, L(k, i), k);
    }
    divide(i);
  }
}

double SafetyRows::hardest_by_torque(int row, const JointLimits& limits, const BrakingTorque& torque) const noexcept {
  double hardest = 0.0;
  for (Eigen::Index j = 0; j < responses_.rows(); ++j) {
    const double response = responses_(j, row);
    if (response != 0.0) {
      hardest += std::abs(response) * limits.effort[j] - response * torque.bias[j];
    }
  }
  return hardest;
}

double SafetyRows::largest_by_both(ConstVectorRef direction, const Eigen::VectorXd& least, const Eigen::VectorXd& most,
                                   const Eigen::VectorXd& row_lower, const Eigen::VectorXd& row_upper,
                                   double otherwise) noexcept {
  // w n·a − |a|²/2 with so large a w that the second term does not count.
  double size = 0.0;
  for (Eigen::Index j = 0; j < most.size(); ++j) {
    size = std::max(size, std::min(std::max(std::abs(least[j]), std::abs(most[j])), largest_acceleration));
  }
  const double length = direction.norm();
  reach_data_.g = -linear * size / length * direction;
  reach_data_.lower = least;
  reach_data_.upper = most;
  reach_data_.row_lower = row_lower;
  reach_data_.row_upper = row_upper;
  if (reach_.solve(reach_data_) != QuadraticProgramStatus::solved) {
    return otherwise;
  }
  return direction.dot(reach_.solution());
}

double SafetyRows::stop_time(const Eigen::VectorXd& v, const JointLimits& limits, const BrakingTorque* torque) noexcept {
  const double by_limits = v.cwiseAbs().cwiseQuotient(limits.acceleration).maxCoeff();
  if (torque == nullptr) {
    return by_limits;
  }
  // |bias − M v/τ| <= effort
  double by_torque = 0.0;
  response_ = v;
  multiply_in_place(torque->mass_cholesky, response_);
  for (Eigen::Index j = 0; j < v.size(); ++j) {
    const double momentum = response_[j];
    const double left = limits.effort[j] + (momentum > 0.0 ? torque->bias[j] : -torque->bias[j]);
    if (momentum != 0.0) {
      by_torque = std::max(by_torque, left > 0.0 ? std::abs(momentum) / left : infinity);
    }
  }
  if (by_limits == 0.0) {  // none, or at rest
    return std::isfinite(by_torque) ? by_torque : 0.0;
  }
  return std::clamp(by_torque, by_limits, longest_stop * by_limits);
}

double SafetyRows::smoothed(double required, double room, double u, double c, double A, ConstVectorRef gradient,
                            const LastMotion& last, const AccelerationBounds& bounds, const JointLimits& limits,
                            double period) noexcept {
  const double jerk = last.jerk_share * gradient.cwiseAbs().dot(limits.jerk);
  if (!(jerk < infinity)) {
    return required;
  }
  const double before = gradient.dot(last.acceleration);
  const double least = -largest_product(-gradient, bounds.smooth_lower, bounds.smooth_upper);
  const double most = largest_product(gradient, bounds.smooth_lower, bounds.smooth_upper);  // joints at a limit give no more
  const auto raised = [&](double share) { return std::min(before + share * std::max(most - before, 0.0), most); };
  const double lasting = last.early ? std::min(c, 0.0) : c;
  const auto stops = [&](double x, double share) { return smooth_stop_fits(room, u, x + lasting, A, share * jerk, period); };
  const double shared = raised(of_jerk), alone = raised(of_jerk_alone);
  if (!last.lost && room <= 0.0 && u <= creeping) {  // nothing closes: the way back can wait for the jerk
    return std::min(required, alone);
  }
  const bool enough = stops(shared, of_jerk);
  if (required > shared) {
    return enough ? shared : stops(alone, of_jerk_alone) ? std::min(required, alone) : required;
  }
  if (!last.early || room <= 0.0) {
    return required;
  }
  const double part = enough ? of_jerk : of_jerk_alone;
  double low = enough ? std::max(required, least) : shared, high = enough ? shared : alone;
  if (low < high && !stops(low, part) && !stops(high, part)) {
    return high;
  }
  return least_that_fits(low, high, [&](double x) { return stops(x, part); });
}

bool SafetyRows::draw_on_reserves(double period) noexcept {
  bool any = false;
  for (int row = 0; row < size_; ++row) {
    const Reserve& reserve = reserves_[static_cast<std::size_t>(row)];
    const double asked = lower[row] * lengths[row];
    // Of what is known and not seen most of the margin is a reserve as well.
    const double room = reserve.room + (reserve.seen ? 0.0 : (1.0 - of_margin) * reserve.margin);
    const auto fits = [&](double x) {
      const double slowing = x + reserve.curvature;
      return room > 0.0
                 ? smooth_stop_fits(room, reserve.closing_speed, slowing, std::max(reserve.hardest, 0.0), reserve.jerk, period)
                 : std::max(reserve.closing_speed, reserve.closing_speed - slowing * period) <= creeping;
    };
    asked_[row] = lower[row];
    if (along_path[static_cast<std::size_t>(row)] != 0 || reserve.jerk <= 0.0 || !fits(asked)) {
      continue;
    }
    const double least = std::min(reserve.before - reserve.jerk * period, asked);
    lower[row] = std::min(lower[row], least_that_fits(least, asked, fits) / lengths[row]);
    any = true;
  }
  return any;
}

void SafetyRows::put_off_ways_back(double period) noexcept {
  asked_.head(size_) = lower.head(size_);
  int spare = max_size() - size_;
  for (int row = 0; row < size_ && spare > 0; ++row) {
    const Reserve& reserve = reserves_[static_cast<std::size_t>(row)];
    if (along_path[static_cast<std::size_t>(row)] != 0 || depths[row] > 0.0 || reserve.seen || reserve.room > 0.0 ||
        !opposes_lost(row)) {
      continue;
    }
    const double room = reserve.room + (1.0 - of_margin) * reserve.margin;
    const double needed = demanded_deceleration(room, reserve.closing_speed, reserve.limits, period) - reserve.curvature;
    if (needed / lengths[row] < lower[row]) {
      lower[row] = needed / lengths[row];
      --spare;
    }
  }
  ask_for_ways_back();
}

bool SafetyRows::opposes_lost(int row) const noexcept {
  for (int lost = 0; lost < size_; ++lost) {
    if (depths[lost] > 0.0 && normals.row(row).dot(normals.row(lost)) < 0.0) {
      return true;
    }
  }
  return false;
}

void SafetyRows::ask_again() noexcept { lower.head(size_) = asked_.head(size_); }

bool SafetyRows::ask_for_ways_back() noexcept {
  bool any = false;
  for (int row = 0, asked = size_; row < asked; ++row) {
    const auto at = static_cast<std::size_t>(row);
    if (reserves_[at].room > 0.0 || lower[row] >= asked_[row]) {
      continue;
    }
    any = true;
    if (depths[row] > 0.0) {
      lower[row] = asked_[row];
    } else if (size_ < max_size()) {
      const auto added = static_cast<std::size_t>(size_);
      normals.row(size_) = normals.row(row);
      lower[size_] = asked_[row];
      lengths[size_] = lengths[row];
      depths[size_] = least_depth;
      coordinates[added] = coordinates[at];
      nearest[added] = nearest[at];
      along_path[added] = 0;
      ++size_;
    }
  }
  return any;
}

void SafetyRows::add(const Clearances& clearances, const Eigen::VectorXd& v, const JointLimits& limits,
                     const AccelerationBounds& bounds, double period, const BrakingTorque* torque,
                     const LastMotion* last) noexcept {
  const double tau = stop_time(v, limits, torque);
  least_ = -limits.acceleration;
  const double rate = tau * settings_.rate > 1.0 ? 1.0 / tau : settings_.rate;
  const ClearanceState& approach = clearances.approach;
  const auto room_of = [&](Eigen::Index k) { return approach.values[k] - std::min(settings_.margin, clearances.margins[k]); };
  // Insert into the list of the most critical, which is kept sorted; it is short.
  const int first = size_ = std::min(size_, max_size() - max_size() / 2);
  for (Eigen::Index k = 0; k < clearances.nearest.size(); ++k) {
    if (clearances.nearest[k] < 0 || max_size() == 0) {
      continue;
    }
    if (!(approach.gradients.col(k).norm() > shortest_gradient)) {
      const ClosingLimits none{smallest_deceleration, smallest_deceleration, rate, settings_.correction};
      const double c = std::min(approach.curvatures[k], std::max(clearances.curvatures[k], 0.0));
      if (demanded_deceleration(room_of(k), -approach.rates[k], none, period) > c) {
        helpless = static_cast<int>(k);
      }
      continue;
    }
    const double urgency = room_of(k) + approach.rates[k] / rate;
    if (size_ == max_size() && (size_ == first || urgency >= urgency_[size_ - 1])) {
      continue;
    }
    int at = size_ < max_size() ? size_++ : size_ - 1;
    for (; at > first && urgency_[at - 1] > urgency; --at) {
      urgency_[at] = urgency_[at - 1];
      coordinates[static_cast<std::size_t>(at)] = coordinates[static_cast<std::size_t>(at) - 1];
    }
    urgency_[at] = urgency;
    coordinates[static_cast<std::size_t>(at)] = static_cast<int>(k);
  }
  if (torque != nullptr) {
    reach_data_.A = torque->mass;
    effort_lower_ = -limits.effort - torque->bias;
    effort_upper_ = limits.effort - torque->bias;
    find_responses(first, approach, torque->mass_cholesky);
  }
  // What motors that change their torque no faster can do next: beyond it light joints would be flung about, and little else.
  const RateLimits* const rates = torque != nullptr && last != nullptr ? last->rates : nullptr;
  const auto within_rates = [&](const auto& direction, double asked) {
    return std::min(asked, largest_by_both(direction, rates->acceleration_lower, rates->acceleration_upper, rates->torque_lower,
                                           rates->torque_upper, asked));
  };
  // [1/s²] Of v: the jerk of a stop along the path.
  const double stop_jerk = last == nullptr ? 0.0 : (limits.jerk.array() / v.array().abs().max(at_rest)).minCoeff();
  double hardest_stop = 0.0;
  int hardest_row = -1;  // that a stop along the path is for
  for (int row = first; row < size_; ++row) {
    along_path[static_cast<std::size_t>(row)] = 0;
    const int k = coordinates[static_cast<std::size_t>(row)];
    const auto gradient = approach.gradients.col(k);
    const double by_torque = torque == nullptr ? infinity : hardest_by_torque(row, limits, *torque);
    const double by_limits = largest_product(gradient, -limits.acceleration, limits.acceleration);
    const double room = room_of(k), u = -approach.rates[k];
    // Either alone may promise more than there is: torques that brake hardest may fling joints about. Where it may matter.
    double by_both = std::min(by_limits, by_torque);
    const bool counts = torque != nullptr && u > 0.0 && u / rate + 0.5 * u * u / (scarce * by_both) > room;
    if (counts) {
      by_both =
          std::min(by_both, largest_by_both(gradient, least_, limits.acceleration, effort_lower_, effort_upper_, by_both));
    }
    const double hardest = std::max(std::min(by_limits, by_torque), smallest_deceleration);
    const ClosingLimits closing{std::max(settings_.braking_fraction * by_both, smallest_deceleration), hardest, rate,
                                settings_.correction};
    // Of the points, but no more than the mean where it says that a surface recedes: see the header.
    const double c = std::min(approach.curvatures[k], std::max(clearances.curvatures[k], 0.0));
    double required = demanded_deceleration(room, u, closing, period) - c;
    double now = std::min(largest_product(gradient, bounds.lower, bounds.upper), by_torque);
    if (counts && required > 0.0) {
      now = std::min(now, largest_by_both(gradient, bounds.lower, bounds.upper, effort_lower_, effort_upper_, now));
    }
    const double of_arm = -gradient.dot(v);
    const double net = now + std::min(c, 0.0);  // a curvature that helps fades as the arm slows
    const bool lasts = net > 0.0 && (u <= 0.0 || room >= u * u / (2.0 * net));
    if (room > 0.0 && tau > 0.0 && u <= of_arm + slow) {
      const double share = of_arm / tau;
      const double of_velocity = settings_.correction * tau / period;  // that goes in this period
      double hardness = std::min(hardness_of_stop(room, std::max(u, of_arm), c, tau), of_velocity);
      if (hardness <= 1.0) {
        required = std::min(required, share);
      } else if (required > now) {
        hardness = share > 0.0 ? std::min(hardness, 2.0 * required / share) : hardness;
        required = std::min({required, hardness * share, lasts ? now : infinity});
        if (net <= 0.0 && hardness > hardest_stop) {
          hardest_stop = hardness;
          hardest_row = row;
        }
      }
    } else if (required > now && lasts) {
      required = now;
    } else if (room <= 0.0 && required > now && net > 0.0) {
      // Of what closes in, not of the way back.
      required = std::min(required, std::max(now, settings_.correction * u / period - c));
    }
    bool smooth = false;
    Reserve& reserve = reserves_[static_cast<std::size_t>(row)];
    reserve = {room, u, c};
    reserve.limits = closing;
    reserve.margin = approach.values[k] - room;
    reserve.seen = clearances.margins[k] == infinity;
    if (last != nullptr) {
      const double asked = required, whole = last->jerk_share * gradient.cwiseAbs().dot(limits.jerk);
      if (whole < infinity && (room <= 0.0 || u <= of_arm + slow)) {
        const double jerk = room > 0.0 ? last->jerk_share * of_arm * stop_jerk : whole;
        reserve.hardest = tau > 0.0 ? of_arm / tau : 0.0;
        reserve.jerk = of_jerk_alone * jerk;
        reserve.before = gradient.dot(last->acceleration);
      }
      required = smoothed(asked, room, u, c, of_hardest * hardest, gradient, *last, bounds, limits, period);
      smooth = required < asked;
      if (rates != nullptr && required == asked && asked > last->acceleration.dot(gradient)) {
        required = within_rates(gradient, required);
      }
    }
    if (hardest_row == row && smooth) {
      hardest_row = -1;
      hardest_stop = 0.0;
    }
    const double length = gradient.norm();
    normals.row(row) = gradient.transpose() / length;
    lower[row] = required / length;
    lengths[row] = length;
    nearest[static_cast<std::size_t>(row)] = clearances.nearest[k];
    depths[row] =
        clearances.least[k] < infinity ? std::max(-approach.values[k], 0.0) : 0.0;  // nothing is lost that touches nothing
  }
  if (hardest_row >= 0) {
    const int row = size_ < max_size() ? size_++ : size_ - 1;
    along_path[static_cast<std::size_t>(row)] = 1;
    const double speed = v.norm();
    normals.row(row) = -v.transpose() / speed;
    lower[row] = hardest_stop * speed / tau;
    if (rates != nullptr) {
      lower[row] = within_rates(normals.row(row).transpose(), lower[row]);
    }
    lengths[row] = lengths[hardest_row];
    coordinates[static_cast<std::size_t>(row)] = coordinates[static_cast<std::size_t>(hardest_row)];
    nearest[static_cast<std::size_t>(row)] = nearest[static_cast<std::size_t>(hardest_row)];
    depths[row] = 0.0;
  }
}

bool SafetyRows::satisfied_within(int k, const Eigen::VectorXd& box_lower, const Eigen::VectorXd& box_upper) const noexcept {
  return -largest_product(-normals.row(k).transpose(), box_lower, box_upper) >= lower[k];
}

}  // namespace sidestep

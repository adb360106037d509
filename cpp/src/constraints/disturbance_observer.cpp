#include "sidestep/constraints/disturbance_observer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/LU>

namespace sidestep {
namespace {

constexpr double filter = 0.03;     // Time constant of all terms [s]: far longer than a delay, which looks like inertia.
constexpr double memory = 3.0;      // Duration of motion that counts [s].
constexpr double adoption = 0.05;   // Time in which a new estimate is adopted [s].
constexpr double direction = 0.02;  // Speed at which dry friction is three quarters of the whole [rad/s | m/s].
// Change of velocity in a period that no model error explains, as a share of the velocity limit [-].
constexpr double leap = 0.1;
constexpr double least_leap = 0.1;  // The same for slow joints [rad/s | m/s]: velocities are noisy.
constexpr double absurd = 1e9;      // Torque from which a value is no measurement [Nm | N].
constexpr double explained = 0.8;   // Share of the missing torque's variation that an estimate must explain [-].
constexpr double largest = 0.1;     // Largest share of the effort limit that a rotor takes at the acceleration limit [-].
// Weights of the priors at zero: of J and of p M_jj [(rad/s²)² s]; of f, b and c.
constexpr double of_rotor = 1.0, of_share = 2.0, of_rest = 0.01;

}  // namespace

DisturbanceObserver::DisturbanceObserver(const JointLimits& limits, double time, double share)
    : time_(time),
      most_disturbance_(share * limits.effort),
      most_leap_((leap * limits.velocity).cwiseMax(least_leap)),
      most_rotor_(largest * limits.effort.cwiseQuotient(limits.acceleration)),
      disturbance_(Eigen::VectorXd::Zero(limits.effort.size())),
      rotors_(disturbance_),
      acceleration_(disturbance_),
      joints_(static_cast<std::size_t>(limits.effort.size())) {}

void DisturbanceObserver::identify(Eigen::Index j, const Seen& seen, const Terms& told, double duration) noexcept {
  Joint& joint = joints_[static_cast<std::size_t>(j)];
  const double share = std::min(1.0, duration / filter);
  joint.seen += share * (seen - joint.seen);
  joint.told += share * (told - joint.told);
  // At rest nothing is learnt or forgotten.
  const double x = joint.told[0], weight = duration * std::min(1.0, x * x), keep = std::exp(-weight / memory);
  joint.instrumented = keep * joint.instrumented + weight * joint.told * joint.seen.transpose();
  joint.products = keep * joint.products + weight * joint.seen * joint.seen.transpose();
}

void DisturbanceObserver::find_rotor(Eigen::Index j, double mass, double duration) noexcept {
  const Joint& joint = joints_[static_cast<std::size_t>(j)];
  Eigen::Matrix<double, num_terms, num_terms> equations = joint.instrumented.leftCols<num_terms>();
  equations.diagonal() += Terms(of_rotor, of_share * mass * mass, of_rest, of_rest, of_rest);
  Seen residual;
  residual << equations.partialPivLu().solve(joint.instrumented.col(num_terms)), -1.0;
  const double left = residual.dot(joint.products * residual), sum = joint.products(num_terms, num_terms - 1);
  const double variation =
      joint.products(num_terms, num_terms) - sum * sum / std::max(joint.products(num_terms - 1, num_terms - 1), duration);
  const double found = left < (1.0 - explained) * variation ? residual[0] : 0.0;
  const double most = std::isfinite(most_rotor_[j]) ? most_rotor_[j] : 0.0;
  const double share = std::min(1.0, static_cast<double>(joints_.size()) * duration / adoption);
  rotors_[j] += share * (std::clamp(found, 0.0, most) - rotors_[j]);
}

void DisturbanceObserver::update(const Motion& motion, const Eigen::MatrixXd& mass_matrix,
                                 const Eigen::VectorXd& bias) noexcept {
  const auto& [before, after, torque, predicted, duration] = motion;
  const double share = std::min(1.0, duration / time_);
  acceleration_ = (after - before) / duration;
  // A velocity that leaps once, by an impact or where a simulation starts anew, says nothing about the model. A push goes on.
  const bool leapt = std::exchange(leaps_, ((acceleration_ - predicted).cwiseAbs().cwiseMin(acceleration_.cwiseAbs()).array() >
                                            most_leap_.array() / duration)
                                               .any());
  if (leaps_ && !leapt) {
    return;
  }
  for (Eigen::Index j = 0; j < disturbance_.size(); ++j) {
    const double moved = mass_matrix.row(j).dot(acceleration_), expected = mass_matrix.row(j).dot(predicted);
    const double surplus = moved - expected + rotors_[j] * (acceleration_[j] - predicted[j]);
    const double missing = torque[j] - bias[j] - moved;
    if (!(std::abs(surplus) < absurd) || !(std::abs(missing) < absurd)) {
      continue;
    }
    disturbance_[j] = std::clamp(disturbance_[j] + share * surplus, -most_disturbance_[j], most_disturbance_[j]);
    const double v = after[j], dry = std::tanh(v / direction);
    identify(j, (Seen() << acceleration_[j], moved, dry, v, 1.0, missing).finished(),
             Terms(predicted[j], expected, dry, v, 1.0), duration);
    if (static_cast<std::size_t>(j) == next_) {
      find_rotor(j, mass_matrix(j, j), duration);
    }
  }
  next_ = (next_ + 1) % joints_.size();
}

void DisturbanceObserver::change_model(const Eigen::VectorXd& change) noexcept {
  for (Eigen::Index j = 0; j < disturbance_.size(); ++j) {
    if (std::isfinite(change[j]) && change[j] * disturbance_[j] < 0.0) {
      disturbance_[j] += std::copysign(std::min(std::abs(change[j]), std::abs(disturbance_[j])), change[j]);
    }
  }
  std::fill(joints_.begin(), joints_.end(), Joint{});
}

void DisturbanceObserver::set_disturbance(const Eigen::VectorXd& disturbance) noexcept {
  disturbance_ = disturbance.cwiseMax(-most_disturbance_).cwiseMin(most_disturbance_);
}

}  // namespace sidestep

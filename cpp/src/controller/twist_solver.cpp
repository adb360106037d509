#include "twist_solver.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace sidestep {
namespace {

// Singular value where a twist comes to rest, as a share of inputs.singular: the last 0.2 mm of an arm of 1 m.
constexpr double rest_share = 0.2;
constexpr double singular_rate = 3.0;  // rate at which singular values come to there, as joints to their limits [1/s]
// Singular value that may come to rest within the response, as a multiple of inputs.singular.
constexpr double watched = 6.0;
constexpr double look_ahead = 0.005;     // largest joint motion over which a singular value's rate is measured [rad]
constexpr double least_singular = 1e-6;  // singular value below which its direction in joint space is rounding
// Singular value below which the Jacobian of a configuration beside this one says which motion leads out, and how far that is.
constexpr double at_singular = 1e-4, beside = 1e-3;  // [-], [rad]
constexpr double least_gain = 1e-3;                  // gain of a share that is worth another set of held bounds
constexpr double left_out = 0.4;                     // share of InputTolerance that a twist may lose to singular directions

/// U and Λ of J Jᵀ = U Λ Uᵀ: the directions of a frame's Jacobian, and the squares of its singular values.
template <class Transposed>
void find_directions(const Transposed& jacobian, Eigen::Matrix<double, 6, 6>& directions, Vector6d& squares) noexcept {
  const Eigen::Matrix<double, 6, 6> gram = jacobian.transpose().lazyProduct(jacobian);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> principal(gram);
  directions = principal.eigenvectors();
  squares = principal.eigenvalues().cwiseMax(0.0);
}

}  // namespace

TwistSolver::TwistSolver(const Robot& robot, const ControllerSettings& settings, const UsableLimits& usable)
    : robot_(robot),
      settings_(settings),
      usable_(usable),
      state_(robot),
      ahead_(robot),
      jacobian_transposed_(Eigen::MatrixXd::Zero(robot.num_coordinates(), 6)),
      projected_(jacobian_transposed_),
      jacobian_ahead_(jacobian_transposed_),
      best_v_(Eigen::VectorXd::Zero(robot.num_coordinates())),
      ahead_q_(best_v_) {}

void TwistSolver::write_jacobian(const KinematicState& state, const TwistRequest& request, FrameJacobian& transposed) noexcept {
  const KinematicState::Link& link = state.link(request.frame.joint);
  const Eigen::Vector3d p = link.p_WL + link.R_WL * request.frame.X_JF.translation();
  transposed.setZero();
  for (int j = request.frame.joint; j >= 0; j = state.link(j).parent) {
    const KinematicState::Link& mover = state.link(j);
    transposed.row(mover.coordinate).head<3>() += (mover.screw.linear + mover.screw.angular.cross(p)).transpose();
    if (request.free != TwistFreedom::rotation) {
      transposed.row(mover.coordinate).tail<3>() += mover.screw.angular.transpose();
    }
  }
}

void TwistSolver::take(const TwistRequest& request) noexcept {
  twist_ = request.twist;
  if (request.local) {
    const Eigen::Matrix3d R = state_.link(request.frame.joint).R_WL * request.frame.X_JF.linear();
    twist_ << R * request.twist.head<3>(), R * request.twist.tail<3>();
  }
  if (request.free == TwistFreedom::rotation) {
    twist_.tail<3>().setZero();
  }
  write_jacobian(state_, request, jacobian_transposed_);
}

// The whole twist is scaled to what singular configurations and joints leave of it; obstacles then bend what is left.
void TwistSolver::solve(const TwistRequest& request, const NearReference& near, VelocityBounds& bounds, Eigen::VectorXd& wanted,
                        Reduction& reduction) noexcept {
  take(request);
  step_off_singular(request);
  scale(request, near, bounds, wanted, reduction);
  if (bounds.find_worst(wanted, state_.q(), near, true, false).excess > bound_rounding) {
    slide(reduction.share * twist_, near, bounds, wanted);
    usable_.scale(wanted, reduction);
  }
}

// A singular configuration itself has no motion at first order in the direction that it lacks, one beside it has.
void TwistSolver::step_off_singular(const TwistRequest& request) noexcept {
  find_directions(jacobian_transposed_, principal_, squares_);
  const InputTolerance tolerance = InputTolerance::of(twist_);
  bool lacks = false;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const bool needed = std::abs(principal_.col(i).dot(twist_)) > left_out * tolerance.along(principal_.col(i));
    lacks = lacks || (needed && squares_[i] < at_singular * at_singular);
  }
  if (!lacks) {
    return;
  }
  for (Eigen::Index j = 0; j < ahead_q_.size(); ++j) {  // no two joints by the same
    const double by = beside * (1.0 + static_cast<double>(j) / static_cast<double>(ahead_q_.size()));
    ahead_q_[j] = state_.q()[j] + (j % 2 == 0 ? by : -by);
  }
  ahead_.update(robot_, ahead_q_, state_.v());
  write_jacobian(ahead_, request, jacobian_transposed_);
  find_directions(jacobian_transposed_, principal_, squares_);
}

// v = v_h + P Jᵀ U Λ⁻¹ Uᵀ (s V − J v_h) with J P Jᵀ = U Λ Uᵀ, where P projects on what is left free: joints that v would move on too
// fast towards their limits are held, the worst first, and redundancy makes up for them; where it cannot, s is smaller. For a
// singular value σ below σ₀, s is such that the joints' speed s |uᵀV| / σ stays below |V| / σ₀, and that σ falls no faster than at
// `singular_rate` to the one at rest. On the way out of a singular configuration, where σ grows, only the first of both counts. What
// is within `left_out` of the tolerance is not insisted on.
void TwistSolver::scale(const TwistRequest& request, const NearReference& near, VelocityBounds& bounds, Eigen::VectorXd& wanted,
                        Reduction& reduction) noexcept {
  Reduction best;
  best.share = -1.0;
  bounds.release_all();
  projected_ = jacobian_transposed_;
  Matrix6d U = principal_;
  Vector6d squares = squares_;
  for (Eigen::Index held = 0;; ++held) {
    if (held > 0) {
      find_directions(projected_, U, squares);
    }
    Reduction now;
    Directions directions;
    if (!write_scaled(U, squares, bounds, held, directions, wanted, now)) {
      break;
    }
    now.share *= usable_.scale(wanted, now);
    const double kept = keep_off_singular(request, directions, wanted, now);
    wanted *= kept;
    now.share *= kept;
    const double fits = fit_joints(wanted, bounds, now);
    now.share *= fits;
    if (now.share > best.share + least_gain) {
      best = now;
      best_v_ = fits * wanted;
    }
    if (fits == 1.0 || held == bounds.max_held() ||
        !bounds.hold(bounds.find_worst(wanted, state_.q(), near, false, true), near, held, projected_)) {
      break;
    }
  }
  wanted = best_v_;
  reduction = best;
}

bool TwistSolver::write_scaled(const Matrix6d& U, const Vector6d& squares, const VelocityBounds& bounds, Eigen::Index held,
                               Directions& directions, Eigen::VectorXd& wanted, Reduction& reduction) const noexcept {
  const double small = settings_.inputs.singular, size = twist_.norm();
  const InputTolerance tolerance = InputTolerance::of(twist_);
  directions.U = U;
  directions.asked = U.transpose() * twist_;
  directions.sigma = squares.cwiseSqrt();
  const Vector6d given = U.transpose() * jacobian_transposed_.transpose().lazyProduct(bounds.held_velocity());
  const Vector6d &asked = directions.asked, &sigma = directions.sigma;
  Vector6d& drop = directions.drop;
  for (Eigen::Index i = 0; i < 6; ++i) {
    drop[i] = held > 0 ? 0.0 : left_out * tolerance.along(U.col(i));  // else a held joint would be worth what is left out
    const double needed = std::abs(asked[i]) - drop[i], have = std::copysign(1.0, asked[i]) * given[i];
    if (sigma[i] < small && needed > 0.0 && reduction.share * needed > have + sigma[i] / small * size) {
      reduction.share = std::max(0.0, (have + sigma[i] / small * size) / needed);
      reduction.by = Reduction::By::singular;
      reduction.lost = std::copysign(1.0, asked[i]) * U.col(i);
    }
  }
  Vector6d along = reduction.share * asked - given;
  bool reaches = true;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const double missing = std::abs(along[i]);
    double made = missing;
    if (sigma[i] < small) {
      made = std::max(missing * squares[i] / (small * small), missing - reduction.share * drop[i]);
      made = sigma[i] < least_singular ? 0.0 : std::min(made, sigma[i] / small * size);
      reaches = reaches && missing - made <= reduction.share * drop[i] + bound_rounding;
    }
    along[i] = made > 0.0 ? std::copysign(made / squares[i], along[i]) : 0.0;
  }
  if (!reaches && held > 0) {
    return false;
  }
  wanted = bounds.held_velocity() + projected_.lazyProduct(U * along);
  return true;
}

double TwistSolver::fit_joints(const Eigen::VectorXd& wanted, const VelocityBounds& bounds,
                               Reduction& reduction) const noexcept {
  double fits = 1.0;
  for (Eigen::Index j = 0; j < wanted.size(); ++j) {
    const double most = bounds.largest_speed(j, state_.q()[j], wanted[j] > 0.0);
    if (fits * std::abs(wanted[j]) > most + bound_rounding) {
      fits = most / std::abs(wanted[j]);
      reduction.by = Reduction::By::joint;
      reduction.joint = j;
      reduction.upper = wanted[j] > 0.0;
    }
  }
  return fits;
}

double TwistSolver::keep_off_singular(const TwistRequest& request, const Directions& directions, const Eigen::VectorXd& wanted,
                                      Reduction& reduction) noexcept {
  const double largest = wanted.cwiseAbs().maxCoeff(), small = settings_.inputs.singular;
  const Vector6d &sigma = directions.sigma, &asked = directions.asked, &drop = directions.drop;
  double kept = 1.0;
  bool looked = false;
  for (Eigen::Index i = 0; i < 6 && largest > 0.0; ++i) {
    const double needed = std::abs(asked[i]) - drop[i];
    if (!(needed > 0.0) || sigma[i] > watched * small || sigma[i] < least_singular) {
      continue;
    }
    if (!looked) {
      ahead_q_ = state_.q() + look_ahead / largest * wanted;
      ahead_.update(robot_, ahead_q_, state_.v());
      write_jacobian(ahead_, request, jacobian_ahead_);
      looked = true;
    }
    ahead_q_.noalias() = projected_.lazyProduct(directions.U.col(i));
    const Vector6d moved = jacobian_ahead_.transpose().lazyProduct(ahead_q_);
    const double rate = (directions.U.col(i).dot(moved) / sigma[i] - sigma[i]) * largest / look_ahead;
    const double most = singular_rate * std::max(0.0, sigma[i] - rest_share * small);
    if (-rate > most) {
      const double weight = std::min(1.0, needed / drop[i]);
      const double share = 1.0 - weight * (1.0 - most / -rate);
      if (share < kept) {
        kept = share;
        reduction.by = Reduction::By::singular;
        reduction.lost = std::copysign(1.0, asked[i]) * directions.U.col(i);
      }
    }
  }
  return kept;
}

// Where what clearances hold, at g·v = b, is free to be lost. f = 1/λ, and for small singular values |Uᵀv| is at most σ |V| / σ₀².
void TwistSolver::slide(const Vector6d& twist, const NearReference& near, VelocityBounds& bounds,
                        Eigen::VectorXd& wanted) noexcept {
  const double small = settings_.inputs.singular, size = twist_.norm();
  projected_ = jacobian_transposed_;
  bounds.release_all();
  Matrix6d U;
  Vector6d squares;
  for (Eigen::Index held = 0;; ++held) {
    find_directions(projected_, U, squares);
    const Vector6d left = twist - jacobian_transposed_.transpose().lazyProduct(bounds.held_velocity());
    Vector6d along = U.transpose() * left;
    for (Eigen::Index i = 0; i < 6; ++i) {
      const double square = squares[i];
      if (square < small * small) {
        const double made = std::min(std::abs(along[i]), square / (small * small) * size);
        along[i] = square < least_singular * least_singular ? 0.0 : std::copysign(made / square, along[i]);
      } else {
        along[i] /= square;
      }
    }
    wanted = bounds.held_velocity() + projected_.lazyProduct(U * along);
    if (held == bounds.max_held() || !bounds.hold_worst(wanted, state_.q(), near, held, projected_)) {
      return;
    }
  }
}

void TwistSolver::write_change(const Eigen::VectorXd& v, Eigen::VectorXd& change) const noexcept {
  const double least = settings_.inputs.singular * settings_.inputs.singular;
  const Vector6d error = jacobian_transposed_.transpose().lazyProduct(v) - twist_;
  const Vector6d along = (principal_.transpose() * error).cwiseQuotient(squares_.cwiseMax(least));
  change = jacobian_transposed_.lazyProduct(principal_ * along);
}

}  // namespace sidestep

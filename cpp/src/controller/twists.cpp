// Twists: the joint velocities that move a frame as asked, as far as singular configurations, limits and clearances leave it.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "impl.hpp"

namespace sidestep {
namespace {

// Singular value where a twist comes to rest, as a share of inputs.singular: the last 0.2 mm of an arm of 1 m.
constexpr double rest_share = 0.2;
constexpr double singular_rate = 3.0;  // [1/s] at which singular values come to there: as joints to their limits
// Singular values that may come to rest within the response, as a multiple of inputs.singular.
constexpr double watched = 6.0;
constexpr double look_ahead = 0.005;     // [rad] largest joint motion over which a singular value's rate is measured
constexpr double least_singular = 1e-6;  // below that its direction in joint space is rounding
// Singular value below which the Jacobian of a configuration beside this one says which motion leads out, and how far that is.
constexpr double at_singular = 1e-4, beside = 1e-3;  // [-], [rad]
constexpr double least_gain = 1e-3;                  // of a share that is worth another set of held bounds
constexpr double left_out = 0.4;                     // of InputTolerance: what a twist may lose to directions that are singular

/// U and Λ of J Jᵀ = U Λ Uᵀ: the directions of a frame's Jacobian, and the squares of its singular values.
template <class Transposed>
void find_directions(const Transposed& jacobian, Eigen::Matrix<double, 6, 6>& directions, Vector6d& squares) noexcept {
  const Eigen::Matrix<double, 6, 6> gram = jacobian.transpose().lazyProduct(jacobian);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> principal(gram);
  directions = principal.eigenvectors();
  squares = principal.eigenvalues().cwiseMax(0.0);
}

}  // namespace

void Controller::Impl::write_jacobian(const KinematicState& state, const TwistOrder& order,
                                      FrameJacobian& transposed) noexcept {
  const KinematicState::Link& link = state.link(order.frame.joint);
  const Eigen::Vector3d p = link.p_WL + link.R_WL * order.frame.X_JF.translation();
  transposed.setZero();
  for (int j = order.frame.joint; j >= 0; j = state.link(j).parent) {
    const KinematicState::Link& mover = state.link(j);
    transposed.row(mover.coordinate).head<3>() += (mover.screw.linear + mover.screw.angular.cross(p)).transpose();
    if (order.free != TwistFreedom::rotation) {
      transposed.row(mover.coordinate).tail<3>() += mover.screw.angular.transpose();
    }
  }
}

void Controller::Impl::take_twist(const TwistOrder& order) noexcept {
  twist_ = order.twist;
  if (order.local) {
    const Eigen::Matrix3d R = twist_state_.link(order.frame.joint).R_WL * order.frame.X_JF.linear();
    twist_ << R * order.twist.head<3>(), R * order.twist.tail<3>();
  }
  if (order.free == TwistFreedom::rotation) {
    twist_.tail<3>().setZero();
  }
  write_jacobian(twist_state_, order, jacobian_transposed_);
}

// The whole twist is scaled to what singular configurations and joints leave of it; obstacles then bend what is left.
void Controller::Impl::solve_twist(const TwistOrder& order) noexcept {
  take_twist(order);
  step_off_singular(order);
  scale_twist(order);
  if (find_worst(true, false).excess > bound_rounding) {
    slide(reduction_.share * twist_);
    scale_to_limits(wanted_v_, reduction_);
  }
}

// A singular configuration itself has no motion at first order in the direction that it lacks, one beside it has.
void Controller::Impl::step_off_singular(const TwistOrder& order) noexcept {
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
    ahead_q_[j] = twist_state_.q()[j] + (j % 2 == 0 ? by : -by);
  }
  ahead_.update(arm.robot(), ahead_q_, v_);
  write_jacobian(ahead_, order, jacobian_transposed_);
  find_directions(jacobian_transposed_, principal_, squares_);
}

// J v = s V with the largest s in [0, 1]. v = v_h + P Jᵀ U Λ⁻¹ Uᵀ (s V − J v_h) with J P Jᵀ = U Λ Uᵀ, where P projects on what is
// left free: joints that v would move on too fast towards their limits are held, the worst first, and redundancy makes up for
// them; where it cannot, s is smaller. For a singular value σ below σ₀, s is such that the joints' speed s |uᵀV| / σ stays below
// |V| / σ₀, and that σ falls no faster than at `singular_rate` to the one at rest. On the way out of a singular configuration, where σ grows, only the
// first of both counts. What is within `left_out` of the tolerance is not insisted on.
void Controller::Impl::scale_twist(const TwistOrder& order) noexcept {
  const double small = settings.inputs.singular, size = twist_.norm();
  const InputTolerance tolerance = InputTolerance::of(twist_);
  Reduction best;
  best.share = -1.0;
  held_v_.setZero();
  projected_ = jacobian_transposed_;
  Eigen::Matrix<double, 6, 6> U = principal_;
  Vector6d squares = squares_;
  for (Eigen::Index held = 0;; ++held) {
    if (held > 0) {
      find_directions(projected_, U, squares);
    }
    const Vector6d asked = U.transpose() * twist_;
    const Vector6d given = U.transpose() * jacobian_transposed_.transpose().lazyProduct(held_v_);
    const Vector6d sigma = squares.cwiseSqrt();
    Vector6d drop;
    Reduction now;
    for (Eigen::Index i = 0; i < 6; ++i) {
      drop[i] = held > 0 ? 0.0 : left_out * tolerance.along(U.col(i));  // else a held joint would be worth what is left out
      const double needed = std::abs(asked[i]) - drop[i], have = std::copysign(1.0, asked[i]) * given[i];
      if (sigma[i] < small && needed > 0.0 && now.share * needed > have + sigma[i] / small * size) {
        now.share = std::max(0.0, (have + sigma[i] / small * size) / needed);
        now.by = Reduction::By::singular;
        now.lost = std::copysign(1.0, asked[i]) * U.col(i);
      }
    }
    Vector6d along = now.share * asked - given;
    bool reaches = true;
    for (Eigen::Index i = 0; i < 6; ++i) {
      const double missing = std::abs(along[i]);
      double made = missing;
      if (sigma[i] < small) {
        made = std::max(missing * squares[i] / (small * small), missing - now.share * drop[i]);
        made = sigma[i] < least_singular ? 0.0 : std::min(made, sigma[i] / small * size);
        reaches = reaches && missing - made <= now.share * drop[i] + bound_rounding;
      }
      along[i] = made > 0.0 ? std::copysign(made / squares[i], along[i]) : 0.0;
    }
    if (!reaches && held > 0) {
      break;  // those held move the frame otherwise than asked
    }
    wanted_v_ = held_v_ + projected_.lazyProduct(U * along);
    now.share *= scale_to_limits(wanted_v_, now);
    const double kept = keep_off_singular(order, U, sigma, asked, drop, now);
    wanted_v_ *= kept;
    now.share *= kept;
    double fits = 1.0;
    for (Eigen::Index j = 0; j < wanted_v_.size(); ++j) {
      const double most = joint_room(j, wanted_v_[j] > 0.0);
      if (fits * std::abs(wanted_v_[j]) > most + bound_rounding) {
        fits = most / std::abs(wanted_v_[j]);
        now.by = Reduction::By::joint;
        now.joint = j;
        now.upper = wanted_v_[j] > 0.0;
      }
    }
    now.share *= fits;
    if (now.share > best.share + least_gain) {
      best = now;
      best_v_ = fits * wanted_v_;
    }
    if (fits == 1.0 || held == held_.cols() || !hold(find_worst(false, true), held)) {
      break;
    }
  }
  wanted_v_ = best_v_;
  reduction_ = best;
}

double Controller::Impl::keep_off_singular(const TwistOrder& order, const Eigen::Matrix<double, 6, 6>& directions,
                                           const Vector6d& sigma, const Vector6d& asked, const Vector6d& drop,
                                           Reduction& reduction) noexcept {
  const double largest = wanted_v_.cwiseAbs().maxCoeff(), small = settings.inputs.singular;
  double kept = 1.0;
  bool looked = false;
  for (Eigen::Index i = 0; i < 6 && largest > 0.0; ++i) {
    const double needed = std::abs(asked[i]) - drop[i];
    if (!(needed > 0.0) || sigma[i] > watched * small || sigma[i] < least_singular) {
      continue;
    }
    if (!looked) {
      ahead_q_ = twist_state_.q() + look_ahead / largest * wanted_v_;
      ahead_.update(arm.robot(), ahead_q_, v_);
      write_jacobian(ahead_, order, jacobian_ahead_);
      looked = true;
    }
    ahead_q_.noalias() = projected_.lazyProduct(directions.col(i));
    const Vector6d moved = jacobian_ahead_.transpose().lazyProduct(ahead_q_);
    const double rate = (directions.col(i).dot(moved) / sigma[i] - sigma[i]) * largest / look_ahead;
    const double most = singular_rate * std::max(0.0, sigma[i] - rest_share * small);
    if (-rate > most) {
      const double weight = std::min(1.0, needed / drop[i]);
      const double share = 1.0 - weight * (1.0 - most / -rate);
      if (share < kept) {
        kept = share;
        reduction.by = Reduction::By::singular;
        reduction.lost = std::copysign(1.0, asked[i]) * directions.col(i);
      }
    }
  }
  return kept;
}

// Least squares: v = v_h + P Jᵀ U f Uᵀ (V − J v_h), where what clearances hold, at g·v = b, is free to be lost. f = 1/λ, and for
// small singular values |Uᵀv| is at most σ |V| / σ₀².
void Controller::Impl::slide(const Vector6d& twist) noexcept {
  const double small = settings.inputs.singular, size = twist_.norm();
  projected_ = jacobian_transposed_;
  held_v_.setZero();
  Eigen::Matrix<double, 6, 6> U;
  Vector6d squares;
  for (Eigen::Index held = 0;; ++held) {
    find_directions(projected_, U, squares);
    const Vector6d left = twist - jacobian_transposed_.transpose().lazyProduct(held_v_);
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
    wanted_v_ = held_v_ + projected_.lazyProduct(U * along);
    if (held == held_.cols() || !hold_worst(held)) {
      return;
    }
  }
}

}  // namespace sidestep

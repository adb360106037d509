#include "sidestep/controller/posture_search.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include "../dynamical_system/random_configuration.hpp"
#include "../settings.hpp"

namespace sidestep {
namespace {

constexpr int iterations = 50;         // from a configuration nearby about ten are enough
constexpr int most_fruitless = 8;      // iterations in a row that come no nearer: out of reach from here
constexpr double progress = 0.99;      // of the error: less is no progress
constexpr double largest_damping = 0.03;  // [m | rad] directions in which an arm moves less than this are left alone
constexpr double largest_step = 0.3;   // [rad | m] of any joint: a metre of arm moves 4 cm beside the tangent
constexpr double accuracy = 1e-7;      // [m] and [rad]: the frame is at the pose
constexpr double clearly = 0.9;        // of the error of a posture nearby: less is worth a way to quite another one

/// Limits with a turn for joints that have none.
std::pair<Eigen::VectorXd, Eigen::VectorXd> finite_interval(const Robot& robot, const Eigen::VectorXd& near) {
  Eigen::VectorXd lower = robot.limits().lower, upper = robot.limits().upper;
  for (Eigen::Index j = 0; j < lower.size(); ++j) {
    lower[j] = std::isfinite(lower[j]) ? lower[j] : std::min(upper[j], near[j]) - std::numbers::pi;
    upper[j] = std::isfinite(upper[j]) ? upper[j] : std::max(lower[j], near[j]) + std::numbers::pi;
  }
  return {lower, upper};
}

double size_of(const Posture& posture) noexcept { return std::hypot(posture.position_error, posture.rotation_error); }

class Descent {
 public:
  Descent(const Robot& robot, const PoseGoal& goal, const Eigen::VectorXd& near)
      : robot_(robot), goal_(goal), interval_(finite_interval(robot, near)), state_(robot), rest_(Eigen::VectorXd::Zero(near.size())) {
    frame_ = robot.frame_index(goal.frame().name);
  }

  const Eigen::VectorXd& lower() const noexcept { return interval_.first; }
  const Eigen::VectorXd& upper() const noexcept { return interval_.second; }

  Posture from(Eigen::VectorXd q) {
    q = q.cwiseMax(lower()).cwiseMin(upper());
    Posture best{q, infinity, infinity};
    double least = infinity;
    int fruitless = 0;
    for (int k = 0; k < iterations; ++k) {
      state_.update(robot_, q, rest_);
      const Vector6d error = error_here();
      const double size = error.norm();
      fruitless = size > progress * least ? fruitless + 1 : 0;
      if (size < least) {
        least = size;
        best = {q, error.head<3>().norm(), error.tail<3>().norm()};
      }
      if (size < accuracy || fruitless == most_fruitless) {
        break;
      }
      Eigen::MatrixXd J = frame_jacobian(robot_, state_, frame_);
      if (goal_.settings.position_only) {
        J.bottomRows<3>().setZero();
      }
      const double damping = std::min(largest_damping, size);
      Eigen::Matrix<double, 6, 6> gram = J * J.transpose();
      gram.diagonal().array() += damping * damping;
      Eigen::VectorXd step = J.transpose() * gram.ldlt().solve(error);
      const double largest = step.cwiseAbs().maxCoeff();
      if (largest > largest_step) {
        step *= largest_step / largest;
      }
      q = (q + step).cwiseMax(lower()).cwiseMin(upper());
    }
    return best;
  }

 private:
  Vector6d error_here() const {
    const Eigen::Isometry3d X = frame_pose(robot_, state_, frame_);
    Vector6d error;
    error.head<3>() = goal_.pose.translation() - X.translation();
    error.tail<3>() = goal_.settings.position_only ? Eigen::Vector3d::Zero().eval()
                                                   : rotation_vector(goal_.pose.linear() * X.linear().transpose());
    return error;
  }

  const Robot& robot_;
  const PoseGoal& goal_;
  std::pair<Eigen::VectorXd, Eigen::VectorXd> interval_;
  KinematicState state_;
  Eigen::VectorXd rest_;
  int frame_;
};

}  // namespace

bool Posture::found() const noexcept { return size_of(*this) < accuracy; }

PoseError pose_error(const PoseGoal& goal, const KinematicState& state) noexcept {
  const KinematicState::Link& link = state.link(goal.frame().joint);
  const Eigen::Vector3d p = link.p_WL + link.R_WL * goal.frame().X_JF.translation();
  const Eigen::Matrix3d R = link.R_WL * goal.frame().X_JF.linear();
  return {(p - goal.pose.translation()).norm(),
          goal.settings.position_only ? 0.0 : rotation_vector(goal.pose.linear().transpose() * R).norm()};
}

Posture find_posture(const Robot& robot, const PoseGoal& goal, const Eigen::VectorXd& near, int starts, std::uint64_t seed,
                     const std::function<bool(const Eigen::VectorXd&)>& free) {
  Descent descent(robot, goal, near);
  std::mt19937_64 random(seed);
  const auto judged = [&](Posture posture) {
    posture.free = posture.found() && free(posture.q);
    return posture;
  };
  Posture best = judged(descent.from(near));
  if (seed == 0 && best.free) {
    return best;
  }
  Eigen::VectorXd begin(near.size());
  for (int k = 1; k < starts; ++k) {
    const double spread = std::numbers::pi * k / std::max(1, starts - 1);
    random_configuration(random, descent.lower(), descent.upper(), near, spread, begin);
    Posture other = judged(descent.from(begin));
    if (other.free) {
      return other;
    }
    if ((other.found() && !best.found()) || size_of(other) < clearly * size_of(best)) {
      best = std::move(other);
    }
  }
  return best;
}

}  // namespace sidestep

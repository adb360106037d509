#include "sidestep/controller/posture_search.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "../attractor/random_configuration.hpp"
#include "../math/settings.hpp"

namespace sidestep {
namespace {

constexpr int iterations = 50;  // Iterations from one configuration; nearby about ten are enough.
constexpr int most_fruitless =
    8;  // Iterations in a row without progress after which the pose counts as out of reach from here.
constexpr double progress = 0.99;  // Factor by which the error must fall to count as progress [-].
constexpr double largest_damping =
    0.03;  // Damping at a large error: directions in which the arm moves less are left alone [m | rad].
constexpr double largest_step = 0.3;       // Largest step of a joint: a metre of arm moves 4 cm beside the tangent [rad | m].
constexpr double accuracy = 1e-7;          // Error with which the frame is at the pose [m] and [rad].
constexpr double most_limit_share = 0.05;  // Largest distance kept from a limit, as a share of the joint's range [-].
constexpr double least_limit_distance = 0.02;  // Least distance kept from a limit: barriers act there [rad | m].
constexpr double clearly = 0.9;  // Share of the error of a posture nearby below which quite another one is better [-].

/// Limits with room to them, and a turn for joints that have none.
std::pair<Eigen::VectorXd, Eigen::VectorXd> finite_interval(const Robot& robot, const Eigen::VectorXd& near,
                                                            double limit_distance) {
  Eigen::VectorXd lower = robot.limits().lower, upper = robot.limits().upper;
  for (Eigen::Index j = 0; j < lower.size(); ++j) {
    const double margin = std::min(limit_distance, most_limit_share * (upper[j] - lower[j]));
    lower[j] += margin;
    upper[j] -= margin;
    lower[j] = std::isfinite(lower[j]) ? lower[j] : std::min(upper[j], near[j]) - std::numbers::pi;
    upper[j] = std::isfinite(upper[j]) ? upper[j] : std::max(lower[j], near[j]) + std::numbers::pi;
  }
  return {lower, upper};
}

double size_of(const Posture& posture) noexcept {
  return std::sqrt(posture.position_error * posture.position_error + posture.rotation_error * posture.rotation_error);
}

class Descent {
 public:
  Descent(const Robot& robot, const PoseGoal& goal, const Eigen::VectorXd& near, double limit_distance)
      : robot_(robot),
        interval_(finite_interval(robot, near, limit_distance)),
        state_(robot),
        rest_(Eigen::VectorXd::Zero(near.size())) {
    add(goal);
    for (const PoseGoal& other : goal.others) {
      add(other);
    }
    error_.resize(6 * static_cast<Eigen::Index>(goals_.size()));
    jacobian_.resize(error_.size(), near.size());
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
      Posture here{q, 0.0, 0.0};
      look(here);
      const double size = error_.norm();
      fruitless = size > progress * least ? fruitless + 1 : 0;
      if (size < least) {
        least = size;
        best = std::move(here);
      }
      if (size < accuracy || fruitless == most_fruitless) {
        break;
      }
      const double damping = std::min(largest_damping, size);
      Eigen::MatrixXd gram = jacobian_ * jacobian_.transpose();
      gram.diagonal().array() += damping * damping;
      Eigen::VectorXd step = jacobian_.transpose() * gram.ldlt().solve(error_);
      const double largest = step.cwiseAbs().maxCoeff();
      if (largest > largest_step) {
        step *= largest_step / largest;
      }
      q = (q + step).cwiseMax(lower()).cwiseMin(upper());
    }
    return best;
  }

 private:
  void add(const PoseGoal& goal) { goals_.push_back(&goal); }

  /// Error and Jacobian of all frames, one below the other; the largest errors of them.
  void look(Posture& posture) {
    for (std::size_t k = 0; k < goals_.size(); ++k) {
      const PoseGoal* const goal = goals_[k];
      const auto row = 6 * static_cast<Eigen::Index>(k);
      const Eigen::Isometry3d X = frame_pose(state_, goal->frame());
      auto J = jacobian_.middleRows<6>(row);
      J = frame_jacobian(robot_, state_, goal->frame());
      error_.segment<3>(row) = goal->pose.translation() - X.translation();
      if (goal->settings.position_only) {
        J.bottomRows<3>().setZero();
        error_.segment<3>(row + 3).setZero();
      } else {
        error_.segment<3>(row + 3) = rotation_vector(goal->pose.linear() * X.linear().transpose());
      }
      posture.position_error = std::max(posture.position_error, error_.segment<3>(row).norm());
      posture.rotation_error = std::max(posture.rotation_error, error_.segment<3>(row + 3).norm());
    }
  }

  const Robot& robot_;
  std::pair<Eigen::VectorXd, Eigen::VectorXd> interval_;
  KinematicState state_;
  Eigen::VectorXd rest_;
  std::vector<const PoseGoal*> goals_;
  Eigen::VectorXd error_;
  Eigen::MatrixXd jacobian_;
};

}  // namespace

bool Posture::found() const noexcept { return size_of(*this) < accuracy; }

PoseError pose_error(const PoseGoal& goal, const KinematicState& state) noexcept {
  const KinematicState::Link& link = state.link(goal.frame().joint);
  const Eigen::Vector3d p = link.p_WL + link.R_WL * goal.frame().X_JF.translation();
  const Eigen::Matrix3d R = link.R_WL * goal.frame().X_JF.linear();
  PoseError largest{(p - goal.pose.translation()).norm(),
                    goal.settings.position_only ? 0.0 : rotation_vector(goal.pose.linear().transpose() * R).norm()};
  for (const PoseGoal& other : goal.others) {
    const PoseError error = pose_error(other, state);
    largest = {std::max(largest.position, error.position), std::max(largest.rotation, error.rotation)};
  }
  return largest;
}

Posture find_posture(const Robot& robot, const PoseGoal& goal, const Eigen::VectorXd& near,
                     const PostureSearchSettings& settings, const std::function<double(const Eigen::VectorXd&)>& clearance_at) {
  Descent wide(robot, goal, near, settings.limit_distance),
      narrow(robot, goal, near, std::min(settings.limit_distance, least_limit_distance));
  std::mt19937_64 random(settings.seed);
  const auto judged = [&](Posture posture) {
    posture.clearance = posture.found() ? clearance_at(posture.q) : -infinity;
    return posture;
  };
  const auto search = [&](const Eigen::VectorXd& from) {
    Posture posture = wide.from(from);
    return judged(posture.found() ? std::move(posture) : narrow.from(posture.q));
  };
  Posture best = search(near);
  if (!settings.another && best.clearance >= settings.clearance) {
    return best;
  }
  if (settings.another) {
    best.clearance = -infinity;  // any other one that is free is better
  }
  Eigen::VectorXd begin(near.size());
  for (int k = 1; k < settings.starts; ++k) {
    const double spread = std::numbers::pi * k / std::max(1, settings.starts - 1);
    random_configuration(random, wide.lower(), wide.upper(), near, spread, begin);
    Posture other = search(begin);
    if (other.clearance >= settings.clearance) {
      return other;
    }
    if (other.found() ? other.clearance > best.clearance || !best.found() : size_of(other) < clearly * size_of(best)) {
      best = std::move(other);
    }
  }
  if (!best.found() && settings.limit_distance > 0.0) {
    Posture at_limits = judged(Descent(robot, goal, near, 0.0).from(best.q));
    if (size_of(at_limits) < size_of(best)) {
      best = std::move(at_limits);
    }
  }
  return best;
}

}  // namespace sidestep

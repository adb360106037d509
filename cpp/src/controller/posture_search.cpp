#include "sidestep/controller/posture_search.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include "../system/random_configuration.hpp"
#include "../settings.hpp"

namespace sidestep {
namespace {

constexpr int iterations = 50;         // from a configuration nearby about ten are enough
constexpr int most_fruitless = 8;      // iterations in a row that come no nearer: out of reach from here
constexpr double progress = 0.99;      // of the error: less is no progress
constexpr double largest_damping = 0.03;  // [m | rad] directions in which an arm moves less than this are left alone
constexpr double largest_step = 0.3;   // [rad | m] of any joint: a metre of arm moves 4 cm beside the tangent
constexpr double accuracy = 1e-7;      // [m] and [rad]: the frame is at the pose
constexpr double most_room = 0.05;     // of a joint's range
constexpr double least_room = 0.02;    // [rad | m] barriers keep the arm off the last of the way to a limit
constexpr double clearly = 0.9;        // of the error of a posture nearby: less is worth a way to quite another one

/// Limits with room to them, and a turn for joints that have none.
std::pair<Eigen::VectorXd, Eigen::VectorXd> finite_interval(const Robot& robot, const Eigen::VectorXd& near, double limit_room) {
  Eigen::VectorXd lower = robot.limits().lower, upper = robot.limits().upper;
  for (Eigen::Index j = 0; j < lower.size(); ++j) {
    const double room = std::min(limit_room, most_room * (upper[j] - lower[j]));
    lower[j] += room;
    upper[j] -= room;
    lower[j] = std::isfinite(lower[j]) ? lower[j] : std::min(upper[j], near[j]) - std::numbers::pi;
    upper[j] = std::isfinite(upper[j]) ? upper[j] : std::max(lower[j], near[j]) + std::numbers::pi;
  }
  return {lower, upper};
}

double size_of(const Posture& posture) noexcept { return std::hypot(posture.position_error, posture.rotation_error); }

class Descent {
 public:
  Descent(const Robot& robot, const PoseGoal& goal, const Eigen::VectorXd& near, double limit_room)
      : robot_(robot), goal_(goal), interval_(finite_interval(robot, near, limit_room)), state_(robot), rest_(Eigen::VectorXd::Zero(near.size())) {
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

Posture find_posture(const Robot& robot, const PoseGoal& goal, const Eigen::VectorXd& near, const PostureSearchSettings& settings,
                     const std::function<double(const Eigen::VectorXd&)>& room) {
  Descent wide(robot, goal, near, settings.limit_room), narrow(robot, goal, near, std::min(settings.limit_room, least_room));
  std::mt19937_64 random(settings.seed);
  const auto judged = [&](Posture posture) {
    posture.room = posture.found() ? room(posture.q) : -infinity;
    return posture;
  };
  const auto search = [&](const Eigen::VectorXd& from) {
    Posture posture = wide.from(from);
    return judged(posture.found() ? std::move(posture) : narrow.from(posture.q));
  };
  Posture best = search(near);
  if (!settings.another && best.room >= settings.room) {
    return best;
  }
  if (settings.another) {
    best.room = -infinity;  // any other one that is free is better
  }
  Eigen::VectorXd begin(near.size());
  for (int k = 1; k < settings.starts; ++k) {
    const double spread = std::numbers::pi * k / std::max(1, settings.starts - 1);
    random_configuration(random, wide.lower(), wide.upper(), near, spread, begin);
    Posture other = search(begin);
    if (other.room >= settings.room) {
      return other;
    }
    if (other.found() ? other.room > best.room || !best.found() : size_of(other) < clearly * size_of(best)) {
      best = std::move(other);
    }
  }
  if (!best.found() && settings.limit_room > 0.0) {
    Posture at_limits = judged(Descent(robot, goal, near, 0.0).from(best.q));
    if (size_of(at_limits) < size_of(best)) {
      best = std::move(at_limits);
    }
  }
  return best;
}

}  // namespace sidestep

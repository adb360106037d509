#pragma once

#include <Eigen/Core>
#include <vector>

#include "sidestep/controller/controller.hpp"
#include "sidestep/math/interruption.hpp"

namespace sidestep {

/// Which coordinates turn without limits, so that a configuration is the same a turn further (nv).
std::vector<bool> unlimited_joints(const Robot& robot);

/// A motion of a controller without physics: row k is the state before step k and the result of step k.
struct MotionRecord {
  Eigen::MatrixXd q, v, acceleration;  ///< (steps, nv)
  std::vector<SafetyStatus> statuses;
  std::vector<Activity> activities;
  Eigen::VectorXd clearance;       ///< (steps) [m], of the covering body
  Eigen::VectorXd step_seconds;    ///< (steps) [s] that each step took
  Eigen::VectorXd last_q, last_v;  ///< the state after the last step
  bool arrived = false;            ///< every joint came within the tolerance of the goal, which ended the motion
};

/// Moves a perfect model by semi-implicit Euler: v ← v + a T, q ← q + v T. Ends when every joint is
/// within `tolerance` [rad], a sliding one within a tenth of it [m], of `goal` (nv), which may be empty. Throws
/// std::invalid_argument on sizes, states that are not finite, less than one step, and a controller that is not
/// synchronous, whose threads keep the machine's time; Interruption where `interrupted` says so before a step.
MotionRecord integrate(Controller& controller, const Eigen::VectorXd& q, const Eigen::VectorXd& v, int steps,
                       const Eigen::VectorXd& goal = {}, double tolerance = 0.0,
                       const Interrupted& interrupted = never_interrupted);

/// The motions of several controllers, each as `integrate` gives it, bit for bit, on `threads` threads (0: one per
/// processor). Row k of q, v (N, nv) and of goals, which may be empty, is of controller k. Throws as `integrate` does,
/// std::invalid_argument also on a controller that is there twice, records of more than 8 GiB, and a number of threads
/// that is not from 0 to 1024; std::runtime_error if a controller is in use, see Controller::ClaimedController. `interrupted` is
/// asked by the calling thread.
std::vector<MotionRecord> integrate_batch(const std::vector<Controller*>& controllers, const Eigen::MatrixXd& q,
                                          const Eigen::MatrixXd& v, int steps, const Eigen::MatrixXd& goals = {},
                                          double tolerance = 0.0, int threads = 0,
                                          const Interrupted& interrupted = never_interrupted);

}  // namespace sidestep

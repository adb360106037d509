#pragma once

#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <limits>
#include <optional>

#include "sidestep/constraints/disturbance_observer.hpp"
#include "sidestep/controller/plausibility.hpp"
#include "sidestep/robot/robot.hpp"
#include "sidestep/planning/avoidance_trajectory.hpp"
#include "sidestep/clearance/body_clearance.hpp"
#include "sidestep/attractor/goal.hpp"
#include "input.hpp"

namespace sidestep {

/// What a step of a Controller hands on to the next, whatever body the arm has: reference, measurements, where it is in what it
/// was told. Copying one to another of the same joints does not allocate.
struct StepState {
  explicit StepState(const Robot& robot);

  Eigen::VectorXd q_, v_, a_, wanted_;  // the reference: now, and its acceleration in the last period or this one
  Eigen::VectorXd smooth_a_;            // from which jerk goes on
  Eigen::VectorXd next_q_, next_v_;     // after this period
  Eigen::VectorXd arm_q_, arm_v_, last_arm_q_, last_arm_v_, turns_;  // measured
  bool apart_ = false;                                               // the arm is not exactly where the reference is
  /// The sample of this step, and whether it can be the arm's.
  struct Measurement {
    Eigen::VectorXd q, v, last_q, last_v;  // as measured, in this step and in the last
    Eigen::VectorXd predicted;             // where the arm is by the last step
    Eigen::VectorXd turns;                 // of the last sample that was taken
    Eigen::VectorXd anchor;                // near which an arm that is far from its command has been since
    double anchored_at = 0.0;              // [s]
    int disagreeing = 0;                   // samples in a row
    int repeated = 0;                      // samples in a row that are the same although the arm moves
    int leaps = 0;                         // samples in a row whose velocity leaps and whose position does not
    bool takes_velocity = false;           // that leaps no more than once: without a filter
    bool agrees = true;                    // with the reference; else the arm comes to rest
    bool is_bridged = false;               // no motion explains it: the prediction takes its place
    bool unusable = false;                 // the last one had a wrong size or was not finite
    bool is_far = false;                   // from the command
    Eigen::Index farthest = 0;             // joint
    double elapsed = 0.0;                  // since the last step, by the machine's clock [s]
    double replayed_elapsed = std::numeric_limits<double>::quiet_NaN();  // in its place, of a recording; NaN: there is none
    double moved_until = 0.0;                                            // [s] until when that is worth a word
    std::chrono::steady_clock::time_point stepped_at{};
  } measurement_;
  bool begins_anew_ = false;  // where the next usable sample is
  Eigen::VectorXd drift_;     // of an output of velocity, beside that of the reference [rad/s | m/s]
  bool has_last_torque_ = false;
  Eigen::VectorXd reference_torque_, last_torque_, last_acceleration_, expected_v_, last_measured_v_, coupling_, feedback_,
      gravity_, gravity_change_;
  Eigen::MatrixXd model_mass_;
  Eigen::VectorXd model_bias_;
  std::optional<DisturbanceObserver> observer_;
  double frequency_ = 0.0;  // of the feedback [1/s]
  Eigen::MatrixXd mass_, mass_cholesky_;
  Eigen::VectorXd bias_;
  double time_ = 0.0, next_look_ = 0.0, next_posture_ = 0.0, obstacle_age_ = 0.0;
  bool begins_goal_ = false, wakes_worker_ = false;
  bool plausible_before_ = false;        // a state was measured that an arm can be in
  Plausibility::Impossible impossible_;  // else what was wrong with the last
  bool known_before_ = false, disturbed_ = false, target_blocked_ = false;
  bool rests_ = false;  // short of a goal that it was on the way to
  // The way to a goal at rest, as the planner, the posture search and the barriers know it.
  enum class Way { unknown, open, none };
  Way way_ = Way::unknown;    // the last that was known
  double way_since_ = 0.0;    // [s]
  double way_settles_ = 0.0;  // after so long [s]
  double rest_time_ = 0.0;    // for how long it has rested short of its goal [s]
  bool no_way_ = false;       // as reported: `way_`, once it has settled
  std::uint64_t goal_number_ = 0, obstacle_number_ = 0, posture_attempt_ = 0, tick_ = 0;
  bool has_target_ = false, posture_found_ = false, moves_ = false;
  Eigen::VectorXd target_;  // a configuration that the arm is led to
  Goal reference_;          // JointGoal
  Goal avoidance_goal_;     // JointGoal: the target of the trajectory
  // Of velocities, twists and trajectories.
  Goal input_goal_;  // JointGoal: where and how the arm is to move now
  Goal input_pull_;  // JointGoal whose pull is the acceleration that is wanted for that
  bool pulls_ = false, begins_input_ = false, waits_ = false;
  double order_age_ = 0.0;  // [s]
  Eigen::VectorXd wanted_v_, last_wanted_v_, pulled_;
  bool has_last_wanted_v_ = false;
  Eigen::Index deviating_ = 0;  // joint that is farthest from its trajectory
  Reduction reduction_;
  Vector6d twist_ = Vector6d::Zero();  // asked for, in axes of the world
  Eigen::VectorXd ideal_v_;            // of an arm that responds to the wanted velocity and meets no limit
  bool has_ideal_v_ = false;
  double missed_for_ = 0.0;  // [s] for which the reference has been off that
  bool is_bent_ = false;     // barriers keep it off that now
  struct Clock {
    double time = 0.0, rate = 0.0, change = 0.0;  // s [s], ds/dt, d²s/dt² [1/s]
    double free = 0.0, seen = -1.0;               // the path is free up to there; it is looked at there
    double allowed = 1.0;                         // the rate that limits, errors and obstacles leave
    double delay = 0.0;                           // behind time, at the end the last [s]
    double room = 0.0;                            // clearance that is asked for [m]
    bool blocked = false;
    BodyClearance::Nearest blocker{};
  } clock_;
  Eigen::VectorXd begin_q_, begin_v_, path_q_, path_v_, path_a_;
  bool avoiding_ = false;
  double looked_at_ = 0.0;       // time of the state that the look-ahead which is followed began with [s]
  double look_excess_ = 0.0;     // by which that look took longer by the machine's clock than by the steps' [s]
  double pending_excess_ = 0.0;  // the same of the one that is followed next [s]
  double pace_ = 1.0;            // share of its speed that the look-ahead's age leaves the arm
  AvoidanceTrajectory trajectory_;
};

}  // namespace sidestep

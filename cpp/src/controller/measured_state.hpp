#pragma once

#include <Eigen/Core>
#include <string>

#include "joint_kinds.hpp"
#include "sidestep/controller/plausibility.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/robot/robot.hpp"
#include "tick.hpp"

namespace sidestep {

/// What the measurement remembers from one step to the next, whatever body the arm has.
struct MeasurementMemory {
  explicit MeasurementMemory(Eigen::Index nv);

  Eigen::VectorXd q, v;            // the state that counts: measured, or predicted where the sample cannot be
  Eigen::VectorXd last_q, last_v;  // State of the last step that had a usable one.
  Eigen::VectorXd turns;           // whole turns that are added to what encoders say [rad]
  bool known_before = false;       // the last step had a usable state
  bool begins_anew = false;        // The motion begins anew at the next usable sample.
  bool plausible_before = false;   // a state was measured that an arm can be in
  Plausibility::Impossible impossible;

  /// The sample of this step beside the last one.
  struct Sample {
    Eigen::VectorXd q, v, last_q, last_v;  // as measured
    Eigen::VectorXd turns;                 // Turns of the last sample that was taken.
    Eigen::VectorXd change;                // by which velocities should have changed since samples are the same [rad/s | m/s]
    int disagreeing = 0;                   // samples in a row that disagree with the reference
    int repeated = 0;                      // samples in a row that are the same although the arm moves
    int leaps = 0;                         // samples in a row whose velocity leaps and whose position does not
    bool takes_velocity = false;           // a velocity that leaps for good is taken without a filter
    bool unusable = false;                 // the last sample had a wrong size or was not finite
  } sample;
  Eigen::VectorXd predicted_q, predicted_v;  // State of the arm by the last step.
  bool agrees = true;                        // The sample agrees with the reference; else the arm comes to rest.
  bool is_bridged = false;                   // no motion explains the sample: the prediction takes its place

  /// An arm away from its command.
  struct Away {
    bool is_far = false;
    Eigen::Index farthest = 0;  // joint
    Eigen::VectorXd anchor;     // place near which it has been since `since`
    double since = 0.0;         // [s]
    double moved_until = 0.0;   // time until when it is worth a word that something else moved the arm [s]
  } away;
};

/// Stage `observe`: the state of the arm, as far as the measurement can be believed.
///
/// A sample that cannot be the arm's is bridged by the prediction q + t q̇, q̇ + t q̈, where t is the time since the last step. Where five in a row, or the first after a
/// pause, disagree with the reference, the motion begins anew where the arm is.
class MeasuredState : private MeasurementMemory {
 public:
  MeasuredState(const Robot& robot, const JointKinds& joints, const Plausibility& plausible, const ControllerSettings& settings,
                bool drives_track);

  /// Takes the sample of this step; false where its sizes or numbers are those of no arm.
  bool take(ConstVectorRef q, ConstVectorRef v) noexcept;
  /// Compares the sample with the position that was commanded for now and the motion since the last step.
  void judge(const Eigen::VectorXd& commanded_q, const Eigen::VectorXd& last_acceleration, const Tick& tick) noexcept;
  /// Draws the velocity that was predicted to the measured one: noise is filtered.
  void filter_velocity(const Eigen::VectorXd& last_acceleration, const Tick& tick) noexcept;
  /// How far the sample is from what the step commands.
  void compare(const Eigen::VectorXd& commanded_q) noexcept;
  /// The step ends with this state.
  void end_step() noexcept;
  /// The step ends without a usable state; `forgets`: the next one is a first one.
  void end_without_state(bool forgets) noexcept;
  /// The next usable sample is where the motion begins.
  void restart() noexcept {
    begins_anew = true;
    plausible_before = false;
  }
  void begun() noexcept { begins_anew = false; }
  void go_on_from(const MeasuredState& before) noexcept { static_cast<MeasurementMemory&>(*this) = before; }

  const Eigen::VectorXd& position() const noexcept { return q; }
  const Eigen::VectorXd& velocity() const noexcept { return v; }
  const Eigen::VectorXd& last_position() const noexcept { return last_q; }
  const Eigen::VectorXd& sample_q() const noexcept { return sample.q; }
  const Eigen::VectorXd& sample_v() const noexcept { return sample.v; }
  double turn(Eigen::Index j) const noexcept { return turns[j]; }
  const Eigen::VectorXd& all_turns() const noexcept { return turns; }
  const Plausibility::Impossible& what_is_impossible() const noexcept { return impossible; }
  /// The motion begins in this step: there is no step before it, or it begins anew.
  bool begins() const noexcept { return !known_before || begins_anew; }
  bool was_known() const noexcept { return known_before; }
  bool agrees_with_reference() const noexcept { return agrees; }
  bool bridges_sample() const noexcept { return is_bridged; }
  bool is_far_from_command() const noexcept { return away.is_far; }

  /// Why the arm is not where it was commanded, or that it was moved; empty where neither.
  std::string explain(const Eigen::VectorXd& commanded_q, double time) const;

 private:
  /// Whether the sample is near the reference, can be reached from the last one that was taken, and from the last sample.
  struct Comparison {
    bool is_near = true, is_possible = true, is_steady = true;
  };
  Comparison compare_sample(const Eigen::VectorXd& commanded_q, const Tick& tick) const noexcept;
  /// Whether the arm rests away from what its drives were commanded, for longer than they lag.
  bool rests_elsewhere(double time) noexcept;
  /// Bridges a sample that is an old one again.
  void check_repetition(const Tick& tick) noexcept;
  /// Replaces velocities that leap alone.
  void check_velocity(const Tick& tick) noexcept;
  /// By which an error that counts of joint j differs from that of revolute joints: 1, or 0.2 m/rad where it is prismatic.
  double error_scale(Eigen::Index j) const noexcept;

  const Robot& robot_;
  const JointKinds& joints_;
  const Plausibility& plausible_;
  const ControllerSettings& settings_;
  const bool drives_track_;
};

}  // namespace sidestep

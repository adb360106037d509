#pragma once

#include <Eigen/Core>
#include <string>

#include "joint_kinds.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// What the judge of touches remembers from one step to the next, whatever body the arm has. (nv) each.
struct TouchMemory {
  explicit TouchMemory(Eigen::Index nv);

  Eigen::VectorXd last_q, last_v;     // State of the last sample that counts.
  Eigen::VectorXd felt, moved, sign;  // Filtered: torque that the model lacks, M v̇, direction of motion [Nm | N], [-].
  Eigen::VectorXd load, friction;     // What explains the torque that the model lacks [Nm | N].
  double seeds = 0.0;                 // Time left in which all that is felt counts as load [s].
  double lasted = 0.0;                // Time of samples in a row beyond what is allowed [s].
  int lasts = 0;                      // Number of these samples.
  bool gap = true;                    // The last sample does not count.
  int unsteady = 0;                   // Number of samples that still do not count, after one that came late.
  bool touched = false;               // Until `release`.
  Eigen::Index joint = 0;             // Joint that felt the touch.
  double torque = 0.0,
         allowed = 0.0;  // Torque that nothing explained there, and the most that counts as a model's error [Nm | N].
};

/// Stage `touch`: says when the arm feels a torque that nothing explains, as where it touches something.
///
/// The torque that the model lacks, filtered over 10 ms, is
///     d = (M + J) v̇ + h − τ.
/// Payload, wrong gravity and friction explain d = c + f sign(v). What they explain changes only as the arm moves: c and f
/// are learnt by normalised least mean squares over a way of 0.05 rad of the joint, or of one that moves its inertia. An arm that is
/// held learns nothing.
/// The rest u = d − c − f sign(v) is a touch where it lasts for `ContactSettings::time` with
///     |u| > share · effort limit + |f| + 0.2 |M v̇|
/// in a joint. What the arm feels in the first 50 ms of a motion is load.
class TouchJudge : private TouchMemory {
 public:
  /// `judges`: whether the arm is moved by torque, and not made to be pushed.
  TouchJudge(const Robot& robot, const JointKinds& joints, const ControllerSettings& settings, bool judges);

  /// A sample of the arm, `elapsed` [s] after the one before. `begins`: nothing before it counts; `bridged`: it is no measurement;
  /// `late`: it did not come when it was expected, so that the torque was held for another time.
  struct Sample {
    const Eigen::VectorXd& q;
    const Eigen::VectorXd& v;
    double elapsed;
    bool begins = false, bridged = false, late = false;
  };
  /// What acted on the arm in the period before: the torque sent, the mass matrix with rotors, the bias of the model.
  struct Acted {
    const Eigen::VectorXd& torque;
    const Eigen::MatrixXd& mass;
    const Eigen::VectorXd& bias;
  };
  /// Takes one period; true where a touch begins. Values that are not finite say nothing.
  bool judge(const Sample& now, const Acted& acted) noexcept;
  /// The arm goes on.
  void release() noexcept { touched = false; }
  void go_on_from(const TouchJudge& before) noexcept;

  bool is_touched() const noexcept { return touched; }
  /// Part of d that counts as load, without friction (nv) [Nm | N].
  const Eigen::VectorXd& explained_load() const noexcept { return load; }
  /// Largest torque by which an arm that was touched resists (nv) [Nm | N].
  const Eigen::VectorXd& resistance() const noexcept { return resistance_; }
  /// What was felt, for a person.
  std::string explain() const;

 private:
  /// Whether the position moved as the velocity says: else time has passed that nobody told.
  bool is_steady(const Sample& now) const noexcept;
  void learn(const Sample& now, const Eigen::MatrixXd& mass) noexcept;

  const Robot& robot_;
  const JointKinds& joints_;
  const bool judges_;
  const double least_lasting_;  // Time that a touch lasts, at least [s].
  Eigen::VectorXd share_;       // Torque that is a model's error, beside friction [Nm | N].
  Eigen::VectorXd most_;        // Largest change of d that one sample shows [Nm | N].
  Eigen::VectorXd resistance_;
  Eigen::VectorXd acceleration_, rest_;
};

}  // namespace sidestep

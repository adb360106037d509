#pragma once

#include <Eigen/Core>
#include <array>

#include "sidestep/guard/stop_trajectory.hpp"
#include "sidestep/robot/robot.hpp"
#include "sidestep/scene/obstacles.hpp"
#include "sidestep/clearance/clearance_query.hpp"

namespace sidestep {

/// What a stop takes of torques, which are M a + h (Coriolis, centrifugal and gravity forces) of now.
struct StopTorque {
  const Eigen::MatrixXd& mass;
  const Eigen::VectorXd& bias;
  double jerk_share;  ///< of the jerk limits, with which torques keep their rate

  /// Writes M a + h.
  void of(const Eigen::VectorXd& a, Eigen::VectorXd& torque) const noexcept;
};

/// Lets a motion go on only to states from which a stop is known that keeps every limit and touches nothing; where it would go
/// on otherwise, it stops instead. So limits of jerk and acceleration are kept among whatever is at rest: of several clearances
/// that ask for opposite things none has to be met by a demand that comes too late.
///
/// A stop is free where the body keeps its clearances, of obstacles and of its own links, above floors: a fifth of the margin, or
/// what there was when the first stop was found, if that was less. Places are looked at along it; around one no point of the body
/// moves farther than R·|Δq|, see ClearanceQuery::reach, so that clearances are known to be as far above the floors, or where that
/// is less than a spacing as large as the floor, above zero. What was looked at for one stop serves the next ones.
///
/// Torques that change slowly take long stops. Where there is none, none is looked for in a few periods, as that takes long.
///
/// One thread at a time; nothing here allocates after construction.
class BackupManoeuvre {
 public:
  /// `body`, which stays; `limits` of the motion; `margin` of clearances [m]; period [s].
  BackupManoeuvre(const ClearanceQuery& body, const JointLimits& limits, double margin, double period);

  /// No stop is known: of a state that was not reached by what `keep` gave, or where something moves.
  void reset() noexcept {
    known_ = false;
    num_looked_ = 0;
  }
  /// The obstacles are others, or have moved: places are looked at again when they are needed, a few in a step.
  void invalidate() noexcept;

  /// At q, v, after the acceleration `last` in the period before, `a` is wanted in this one (nv). Where that changes faster than
  /// the limits allow, only as much of the change is made. True where another acceleration is written to `a`: that, or that of a
  /// stop. It stays where it leads on to a stop, where no stop is known and it is within the limits, and where there is none.
  /// `torque`: null for motion without torque.
  bool keep(const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Eigen::VectorXd& last, const Obstacles& obstacles,
            const StopTorque* torque, Eigen::VectorXd& a) noexcept;

 private:
  static constexpr int most_looked = 512;

  /// The share of the change from `last` to `a` with which acceleration and jerk keep their limits, in [0, 1].
  double smooth_share(const Eigen::VectorXd& last, const Eigen::VectorXd& a) const noexcept;
  /// Writes the acceleration of the stop that is known, or else of one from here; false where there is none.
  bool stop_instead(const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Eigen::VectorXd& last, const Obstacles& obstacles,
                    const StopTorque* torque, Eigen::VectorXd& a) noexcept;
  /// Plans a stop from q, v, a: false where none is within the limits.
  bool plan(const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Eigen::VectorXd& a, const StopTorque* torque) noexcept;
  /// Plans one and takes it where it is free; false where it is not.
  bool find_stop(const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Eigen::VectorXd& a, const Obstacles& obstacles,
                 const StopTorque* torque) noexcept;
  bool is_within_effort(const Eigen::VectorXd& a, const StopTorque& torque) noexcept;
  bool is_free(const StopTrajectory& stop, const Obstacles& obstacles) noexcept;
  /// Looks at q, and writes what it finds to a place of what was looked at; negative where the body is below a floor.
  double look(ConstVectorRef q, int at, const Obstacles& obstacles) noexcept;
  void set_floors(const Eigen::VectorXd& q, const Obstacles& obstacles) noexcept;
  /// How far any of the body may move from q on without a clearance below its floor [m]: by what was looked at before, each place
  /// good for the spacing at least, or by a look.
  double room_at(const Eigen::VectorXd& q, const Obstacles& obstacles) noexcept;

  const ClearanceQuery& body_;
  ClearanceQuery::Workspace room_;
  const JointLimits limits_;
  JointLimits slowed_;            // with less acceleration
  const double floor_, spacing_;  // [m] of clearance, and of motion between looks
  const double period_;
  StopTrajectory stop_, next_stop_;   // from here, and from where this period ends
  bool known_ = false, low_ = false;  // a stop is known; a floor is below the usual one
  Eigen::VectorXd next_q_, next_v_, next_a_, q_, next_place_, a_, force_;
  Eigen::VectorXd clearances_, floors_, last_floors_;  // of items
  // Where was looked, the newest over the oldest, and the room there.
  Eigen::MatrixXd looked_at_;
  Eigen::VectorXd looked_room_;
  std::array<bool, most_looked> stale_{};
  int num_looked_ = 0, hit_ = 0;  // hit_: what served last
  int left_ = 0;                  // looks at stale places in this step
  int checks_ = 0;                // steps in which a known stop is looked at again
  int pause_ = 0;                 // steps in which none is looked for
};

}  // namespace sidestep

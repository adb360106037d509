#pragma once

#include <Eigen/Core>
#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sidestep/controller/command.hpp"
#include "sidestep/controller/joint_trajectory.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/system/goal.hpp"
#include "sidestep/planning/online_planner.hpp"
#include "sidestep/model/arm.hpp"
#include "sidestep/model/attachment.hpp"
#include "sidestep/obstacles/obstacles.hpp"

namespace sidestep {

/// The controller: state in, safe command out, once a period.
///
///   1. Reference: the goal; or a point that runs ahead on the planner's path; or a sub-goal out of a local minimum.
///   2. Geometric system: a damped spring to the reference on the graph of the barriers, see GeometricSystem. Barriers
/// are
///      lowered where the arm has to come near what rests: at its goal and in narrow places of the path.
///   3. Look-ahead: where what moves would come too near on that way, a trajectory out of its way is followed instead.
///   4. Quadratic program: the nearest acceleration within every limit and clearance, as torque or acceleration.
///
/// Clearances bound every command: no setting, goal or fault takes them away while the state is known.
///
/// `step` belongs to one thread, allocates nothing, takes no lock and never throws. Goals and obstacles may be set from
/// other threads. Planner, look-ahead and posture search run in threads of their own; with `synchronous` inside `step`,
/// which may then allocate, and repeats a motion bit for bit.
class Controller {
 public:
  /// Throws std::invalid_argument that names the setting at fault, or what the arm lacks.
  explicit Controller(Arm arm, ControllerSettings settings = {});
  ~Controller();
  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;

  /// Holds a controller for one thread or run: for programs whose parts might both call `step`, which does not ask.
  class Use {
   public:
    /// Throws std::runtime_error if it is held already.
    explicit Use(Controller& controller);
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;
    ~Use() { end(); }
    void end() noexcept {
      if (controller_ != nullptr) {
        std::exchange(controller_, nullptr)->in_use_.store(false, std::memory_order_release);
      }
    }

   private:
    Controller* controller_;
  };

  /// From the next step on: a configuration (nv) [rad | m] within the limits, of joints without limits at the nearest
  /// turn. Throws std::invalid_argument that names the joint, its value and what is allowed; the goal before stays.
  void set_goal(const Eigen::VectorXd& position);
  /// The same for a configuration that moves, or a pose of a frame. A goal that moves is followed without planner. A
  /// posture for a pose is looked for near its `rest`, or near the arm where it has none.
  void set_goal(Goal goal);
  // Each of these takes the place of the goal or order before, and needs none. They too throw std::invalid_argument, and the
  // order before stays.

  /// Wanted joint velocities (nv) [rad/s | m/s], as a whole scaled down to the limits. Obstacles steer the arm around them
  /// and stop it. After `inputs.timeout` without another order the arm stops.
  void set_velocity(const Eigen::VectorXd& v);
  /// The same for the twist of a frame: the velocity of its origin [m/s] and its angular velocity [rad/s], in axes of the world
  /// or, `local`, its own; rows as in frame_jacobian. Joint velocities by least squares: exact away from singular
  /// configurations and limits, along which the arm slides.
  void set_twist(const std::string& frame, const Vector6d& twist, bool local = false);
  /// Joint positions q (nv × K) at times (K) [s] from the step that takes them over, see JointTrajectory. A first time after
  /// zero leaves that long to get to the first sample, which need not be where the arm is.
  void set_trajectory(const Eigen::MatrixXd& q, const Eigen::VectorXd& times,
                      TrajectoryBehaviour behaviour = TrajectoryBehaviour::keep_path);

  /// The arm comes to rest where it is, and goes on evading.
  void clear_goal();

  /// From the next step on. Points move on by their velocities until they are set again.
  void set_obstacles(Obstacles obstacles);

  // Each of these prepares another body beside the loop, which takes a few tenths of a second, and returns; steps go on, and the
  // next one takes it over. Goals are planned for anew, from where the arm is.

  /// Another body, inertias and pairs for the same joints and limits, as a finer cover that is ready later. Objects stay
  /// attached. Throws std::invalid_argument that says what differs.
  void set_arm(Arm arm);
  /// An object that a link holds from now on, see sidestep::attach; at the arm's last configuration it is taken to be apart from
  /// all links. What rests on obstacles there (Attachment::rests_on) may stay as near to them as it is, see sidestep::resting, until
  /// its whole cover is `lifted_room` off all obstacles. Throws std::invalid_argument that names what is wrong, such as an object that
  /// rests before the first step; nothing changes then.
  void attach(const Attachment& object);
  /// Lets it go. Throws std::invalid_argument that lists what is attached.
  void detach(const std::string& name);
  /// The names of what is attached.
  std::vector<std::string> attached() const;

  /// One period at q [rad | m] and v [/s] (nv). A size that is wrong, or a value that is not finite, gives a damped
  /// stop with the status `stopping`.
  const Command& step(ConstVectorRef q, ConstVectorRef v) noexcept;
  /// The same with the arm's own mass matrix (nv × nv) and bias (nv) [Nm | N] there; for torque output.
  const Command& step(ConstVectorRef q, ConstVectorRef v, Eigen::Ref<const Eigen::MatrixXd> mass_matrix,
                      ConstVectorRef bias) noexcept;

  /// Of the last step; the same object all the time.
  const Command& command() const noexcept { return command_; }
  /// What the last step saw; its name_of(command().point) is the name of what is nearest. For the thread of `step`.
  const Obstacles& obstacles() const noexcept;
  /// One sentence: what the last command does and why, and what to do about it. For the thread of `step`; allocates.
  std::string explain() const;

  int num_coordinates() const noexcept { return static_cast<int>(command_.position.size()); }
  // References of what follows hold until the next change of the arm.

  /// With what is attached; from the step after a change on.
  Arm arm() const;
  const ControllerSettings& settings() const noexcept;
  /// What the clearances are of (m).
  const std::vector<CoordinateLabel>& labels() const noexcept;
  const GeometricSystem& system() const noexcept;
  const GeometricSystem::Workspace& workspace() const noexcept;
  /// The program's solution of the last step.
  const TorqueSolution& solution() const noexcept;
  /// The configuration that the arm is led to: the goal, or the posture of a pose goal; empty if none is known. For the
  /// thread of `step`; allocates.
  Eigen::VectorXd target() const;
  /// What the planner found last, and how often it searched. Not for the loop.
  Plan last_plan() const;
  OnlinePlanner::Counts planner_counts() const;
  bool has_torque() const noexcept;

 private:
  class Impl;
  template <class Action>
  void tell(Action&& action);
  void take_over() noexcept;
  struct Held {
    Attachment object;
    Eigen::VectorXd q;  // where it was attached; empty: before the first step
    std::optional<RestingObject> resting;
  };
  Impl& newest() const noexcept;
  void forget_lifted() noexcept;
  void change(const Arm& whole, std::vector<Held> held);

  static void destroy(Impl* newest) noexcept;

  const ControllerSettings settings_;
  Command command_;
  std::unique_ptr<Impl> impl_;           // of the thread of `step`
  std::atomic<Impl*> next_{nullptr};     // which it takes over in the next step
  std::atomic<Impl*> retired_{nullptr};  // those before, for another thread to destroy
  mutable std::mutex setters_;
  Impl* newest_;                // of those that step, which setters tell
  Impl* lifted_ = nullptr;      // the one that newest_ goes over to, which they tell too
  mutable std::mutex changes_;  // of what follows; held while a body is prepared
  Arm whole_;                   // without what is attached
  std::vector<Held> held_;
  bool has_torque_;
  std::atomic<bool> in_use_{false};
};

}  // namespace sidestep

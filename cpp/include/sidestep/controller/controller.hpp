#pragma once

#include <Eigen/Core>
#include <atomic>
#include <filesystem>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sidestep/controller/command.hpp"
#include "sidestep/controller/joint_trajectory.hpp"
#include "sidestep/controller/plausibility.hpp"
#include "sidestep/controller/recording.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/controller/single_stepper.hpp"
#include "sidestep/controller/source.hpp"
#include "sidestep/controller/state_history.hpp"
#include "sidestep/attractor/goal.hpp"
#include "sidestep/planning/online_planner.hpp"
#include "sidestep/arm/arm.hpp"
#include "sidestep/arm/attachment.hpp"
#include "sidestep/scene/obstacles.hpp"

namespace sidestep {

class Recorder;
class SourceRegistry;

/// Which part of a twist is left free.
enum class TwistFreedom {
  none,      ///< translation and rotation are both commanded
  rotation,  ///< only the velocity of the frame's origin is commanded; its rotation is free
};

namespace detail {

/// How the parts of the last step ended, for tests and bindings; Command::status is what counts.
struct PartResults {
  StepStatus attraction;           ///< Status of the geometric system.
  ProgramStatus program;           ///< Status of the quadratic program.
  const MotionSolution& solution;  ///< Its solution.
};

}  // namespace detail

/// The controller turns the arm's state into a safe command, once per period.
///
///   1. Reference: the goal, a point ahead of the arm on the planner's path, or a sub-goal out of a local minimum.
///   2. Geometric system: a damped spring to the reference on the graph of the barriers, see GeometricSystem. Activation
///      distances shrink among resting obstacles at the goal and in narrow places of the path.
///   3. Look-ahead: if a moving obstacle would come too near, the arm follows an avoidance trajectory instead.
///   4. Quadratic program: the nearest acceleration within all limits and clearances, as torque or acceleration.
///
/// Clearances bound every command. No setting, goal or fault switches them off while the state is known.
///
/// Call `step` from one thread. It allocates nothing, takes no lock and never throws. You may set goals and obstacles from
/// other threads. Planner, look-ahead and posture search run in their own threads. With `synchronous` they run inside
/// `step`, which may then allocate, and motions repeat bit for bit.
class Controller {
 public:
  /// Throws std::invalid_argument that names the wrong setting, or what the arm lacks.
  explicit Controller(Arm arm, ControllerSettings settings = {});
  ~Controller();
  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;

  /// RAII lock: claims the controller for one caller. `step` itself does not check.
  class ClaimedController {
   public:
    /// Throws std::runtime_error if it is claimed already.
    explicit ClaimedController(Controller& controller);
    ClaimedController(const ClaimedController&) = delete;
    ClaimedController& operator=(const ClaimedController&) = delete;
    ~ClaimedController() { end(); }
    void end() noexcept {
      if (controller_ != nullptr) {
        std::exchange(controller_, nullptr)->in_use_.store(false, std::memory_order_release);
      }
    }

   private:
    Controller* controller_;
  };

  /// A configuration (nv) [rad | m] within the limits, from the next step on. Joints without limits go to the nearest full
  /// turn. Throws std::invalid_argument that names the joint, its value and what is allowed; the previous goal stays.
  void set_goal(const Eigen::VectorXd& position);
  /// A moving configuration, or the pose of a frame. A moving goal is followed without planner. The posture for a pose is
  /// searched near its `rest`, or near the arm if it has none.
  void set_goal(Goal goal);
  // Each of these replaces the previous goal or request. They too throw std::invalid_argument; the previous request then stays.

  /// Commanded joint velocities (nv) [rad/s | m/s]; one factor scales them down to the limits. A joint stops at its position limit
  /// while the others continue. The arm slides along obstacles or stops at them. After `inputs.timeout` without a new request it stops.
  void set_velocity(const Eigen::VectorXd& v);
  /// The commanded twist of a frame: velocity of its origin [m/s] and angular velocity [rad/s], in world axes or, with `local`, in
  /// the frame's axes; rows as in frame_jacobian. The frame moves with s times the whole twist, with the largest s in [0, 1]
  /// that joint limits and singular configurations allow. With `free` the last three numbers are ignored and the frame may
  /// turn: for arms with fewer than six joints. Along obstacles the arm slides; status, `explain` and Command::input_change
  /// say so.
  void set_twist(const std::string& frame, const Vector6d& twist, bool local = false, TwistFreedom free = TwistFreedom::none);
  /// Joint positions q (nv × K) at times (K) [s] after the step that receives them, see JointTrajectory. If the first time is
  /// after zero, the arm has that long to reach the first sample, which may differ from its present state.
  void set_trajectory(const Eigen::MatrixXd& q, const Eigen::VectorXd& times,
                      TrajectoryBehaviour behaviour = TrajectoryBehaviour::keep_path);

  /// The arm comes to rest where it is, and still avoids moving obstacles.
  void clear_goal();
  /// Restarts the reference at the measured state of the next usable step: for arms that something else has moved, and to go on
  /// after a touch, see ContactSettings. The goal stays, and a trajectory continues from where its clock is. From any thread; no allocation.
  ///
  /// Without this call the reference restarts once five measured positions in a row agree with each other but not with the
  /// reference, or at the first one that disagrees after more than 0.1 s without a step, by the time that is told or the machine's clock. Until then the reference comes to rest,
  /// and the status is `tracking_lost`.
  void restart() noexcept { restarts_.store(true, std::memory_order_release); }
  /// What the arm's drives say that they go on from (nv each), for outputs of positions: the reference of the next step begins there,
  /// and its jerk is counted from that acceleration. Call it where a command did not reach them and they have gone on by themselves.
  /// Numbers that are not finite, and other outputs, change nothing: a sum of velocities that drives have been told is not where the arm
  /// is. For the thread of `step`, before it; no allocation.
  void continue_from(ConstVectorRef position, ConstVectorRef velocity, ConstVectorRef acceleration) noexcept;
  /// The arm comes to rest within its limits and clearances, and stays there until `resume`; its goal or request is kept. The activity
  /// is `waiting` then. From any thread; waits for nobody.
  void pause() noexcept { paused_.store(true, std::memory_order_release); }
  /// Goes on to the goal after `pause`.
  void resume() noexcept { paused_.store(false, std::memory_order_release); }
  bool is_paused() const noexcept { return paused_.load(std::memory_order_acquire); }

  // What each source of obstacles says, from the next step on. Until anything was set the arm stays where it is. All of these throw
  // std::invalid_argument that names the value and what is allowed; then nothing changes.

  /// Replaces what a source said before, and nothing of the others. Points move on by their velocities, from the time of their capture
  /// on, up to the age for which the source is valid; beyond it the arm stops until the source comes again, see SourceOptions. An empty
  /// set after one with points is believed once it has been empty for SourceSettings::empty_after.
  void set_obstacles(Obstacles obstacles, const SourceOptions& options = {});
  /// Tells that a source will come: the arm stays where it is until it has said something. A source that has, stays as it is.
  void expect_obstacles(const std::string& source) { expect_obstacles(std::vector{source}); }
  /// The same of several, all or none.
  void expect_obstacles(const std::vector<std::string>& sources);
  /// Forgets a source, at once; also one that was expected.
  void remove_obstacles(const std::string& source);
  /// Adds named points to a source, see Obstacles::named. Throws also where it has something of that name.
  void add_obstacle(const Obstacles& obstacle, const std::string& source = SourceOptions::scene);
  /// Moves what has a name rigidly to another pose in the world: from that with which it was named, or from the origin. A tracker that
  /// comes again and again is one that can fail, as with `set_obstacles`.
  void move_obstacle(const std::string& name, const Eigen::Isometry3d& pose, const SourceOptions& options = {});
  /// Removes what has a name, at once.
  void remove_obstacle(const std::string& name, const std::string& source = SourceOptions::scene);
  /// What all sources said last. From any thread.
  std::vector<SourceContent> said() const;
  /// What is believed of each source. Only for the thread of `step`; allocates.
  std::vector<SourceState> sources() const;
  /// Where the arm was at its last steps, on the clock of `step`; from any thread.
  const StateHistory& history() const noexcept { return history_; }
  /// Clock on which obstacles are captured: time of the last step [s]; from any thread.
  double time() const noexcept { return now() - offset_.load(std::memory_order_relaxed); }

  // Each of these prepares another body while steps go on, in a few tenths of a second, and returns. The next step uses the new
  // body. The planner plans again, from where the arm is.

  /// Replaces body, inertias and pairs, for example by a finer cover; joints and limits must be the same. Objects stay attached. Throws
  /// std::invalid_argument that says what differs.
  void set_arm(Arm arm);
  /// A link holds this object from now on, see sidestep::attach. At the arm's last configuration it counts as apart from all
  /// links. An object that rests on obstacles there (Attachment::rests_on) may stay as near to them as it is, see
  /// sidestep::resting, until its whole cover is `lifted_clearance` away from all obstacles. Throws std::invalid_argument that names
  /// what is wrong, for example an object that rests before the first step; then nothing changes.
  /// Returns what is implausible about where it is, in words, see sidestep::doubt; empty: nothing.
  std::string attach(const Attachment& object);
  /// Releases an object. Throws std::invalid_argument that lists the attached objects.
  void detach(const std::string& name);
  /// Names of the attached objects.
  std::vector<std::string> attached() const;

  /// Computes the command of one period at q [rad | m] and v [rad/s | m/s] (nv). A wrong size or a value that is not finite
  /// gives a damped stop with the status `stopping`. So does a call while another thread is inside `step`: that call gets a
  /// command of its own, at rest and without a position, and changes nothing.
  ///
  /// `time`: when q and v were measured, on a monotonic clock of the caller [s]; NaN: not told. Then the machine's clock counts, where
  /// steps that come sooner than a period count as a period: a loop faster than real time is a simulation. A `synchronous` controller
  /// then counts exactly a period. A time that goes back or stands still gives a damped stop, and the next step goes on from it.
  const Command& step(ConstVectorRef q, ConstVectorRef v, double time = std::numeric_limits<double>::quiet_NaN()) noexcept;
  /// The same with the arm's own mass matrix (nv × nv) and bias (nv) [Nm | N] there; for torque output.
  const Command& step(ConstVectorRef q, ConstVectorRef v, Eigen::Ref<const Eigen::MatrixXd> mass_matrix, ConstVectorRef bias,
                      double time = std::numeric_limits<double>::quiet_NaN()) noexcept;

  /// Whether the last steps came from several threads in turn, as from two loops that share a controller. Only for the thread
  /// of `step`.
  bool stepped_in_turn() const noexcept { return stepper_.in_turn(); }

  /// Records every input of every step and its command to a file from which `replay` gives the same commands, see recording.hpp. From
  /// the thread of `step`, before the first step: later steps depend on what was before. Replaces a file. Throws
  /// std::runtime_error after the first step or where one was recorded already, std::system_error where it cannot be written.
  ///
  /// Steps still allocate nothing and wait for nobody: a thread writes what they put into a ring of 16 MiB. Where that is full, the
  /// recording ends and the steps after it are counted as lost. A `synchronous` controller waits instead.
  void record(const std::filesystem::path& path);
  /// Ends the recording, and says what it holds. Throws std::runtime_error where nothing is recorded, std::system_error where
  /// writing failed.
  RecordingSummary stop_recording();
  /// Keeps the last seconds on disk from now on, whatever comes: files of a third of `seconds` each in a folder that is made if need be,
  /// of which the oldest are deleted, so that between 1 and 4/3 times `seconds` are there. The folder is kept near `most_bytes`: where they
  /// are reached, less than `seconds` are there, and the file being written comes on top. For reports, see recorded_run.hpp: what begins in
  /// the middle of a motion cannot be replayed. From any thread, at any time, beside a recording; costs steps as much. Throws
  /// std::runtime_error where it is on, std::invalid_argument, std::system_error.
  void black_box(const std::filesystem::path& folder, double seconds = 30.0, std::uint64_t most_bytes = black_box_bytes);
  /// Ends it; the files stay. From any thread. Throws std::runtime_error where it is not on.
  BlackBoxSummary stop_black_box();

  /// The command of the last step; always the same object.
  const Command& command() const noexcept { return command_; }
  /// The obstacles of the last step; name_of(command().point) names the nearest. Only for the thread of `step`.
  const Obstacles& obstacles() const noexcept;
  /// One sentence: what the last command does, why, and what to do about it. Only for the thread of `step`; allocates.
  std::string explain() const;

  /// What is hard to believe in the request and the obstacles that were set last, such as millimetres for metres, see Plausibility;
  /// they are followed all the same. From any thread; allocates.
  Questions questions() const;

  int num_coordinates() const noexcept { return static_cast<int>(command_.position.size()); }
  // The references below are valid until the next change of the arm.

  /// The arm with its attached objects; a change shows from the next step on.
  Arm arm() const;
  const ControllerSettings& settings() const noexcept;
  /// What each embedding coordinate belongs to (m).
  const std::vector<CoordinateLabel>& labels() const noexcept;
  const GeometricSystem& system() const noexcept;
  const GeometricSystem::Workspace& workspace() const noexcept;
  /// @cond internal
  detail::PartResults part_results() const noexcept;
  /// @endcond
  /// The target configuration: the goal, or the posture of a pose goal; empty if none is known. Only for the thread of
  /// `step`; allocates.
  Eigen::VectorXd target() const;
  /// The planner's last plan, and how often it searched. Not for use in the loop.
  Plan last_plan() const;
  /// What the covering body touches at the goal, or at the posture found for a pose, among the obstacles as they were set; nothing
  /// where that is free or there is no goal. From any thread; not for use in the loop.
  std::optional<Obstruction> goal_obstruction() const;
  OnlinePlanner::Counts planner_counts() const;
  bool has_torque() const noexcept;

 private:
  class Impl;
  friend class Recorder;
  friend class Replay;
  Controller(Arm arm, ControllerSettings settings, bool workers);
  template <class Action>
  void tell(Action&& action);
  template <class Action>
  void tell_locked(Action&& action);  // with setters_ locked
  template <class Change>
  void change_sources(const Obstacles& said, Change&& change);
  double now() const noexcept;  // the controller's own time of the last step [s]
  void take_over() noexcept;
  struct Held {
    Attachment object;
    Eigen::VectorXd q;  // Configuration at which it was attached; empty: before the first step.
    std::optional<RestingObject> resting;
  };
  Impl& newest() const noexcept;
  void forget_lifted() noexcept;
  void change(const Arm& whole, std::vector<Held> held);
  void install(std::unique_ptr<Impl> fresh, const Arm& whole, std::vector<Held> held);
  void note_requests();
  const Command& step_with(ConstVectorRef q, ConstVectorRef v, const Eigen::Ref<const Eigen::MatrixXd>* mass_matrix,
                           const Eigen::Ref<const Eigen::VectorXd>* bias, double time) noexcept;

  static void destroy(Impl* newest) noexcept;

  const ControllerSettings settings_;
  Command command_;
  const Command refused_;  // Command for a thread that steps while another one does.
  /// What the drives go on from.
  struct Told {
    bool is = false;
    Eigen::VectorXd position, velocity, acceleration;
  };
  Told told_;  // by continue_from, until the next step
  SingleStepper stepper_;
  std::unique_ptr<SourceRegistry> registry_;  // guarded by setters_
  std::unique_ptr<Impl> impl_;                // Used by the thread of `step`.
  std::atomic<Impl*> next_{nullptr};          // which it takes over in the next step
  std::atomic<Impl*> retired_{nullptr};       // those before, for another thread to destroy
  std::atomic<bool> restarts_{false};         // The next step restarts.
  std::atomic<bool> paused_{false};           // From the next step on the arm rests.
  mutable std::mutex setters_;
  Impl* newest_;                // Newest of those that step, which setters tell.
  Impl* lifted_ = nullptr;      // the one that newest_ goes over to, which they tell too
  mutable std::mutex changes_;  // Guards what follows; held while a body is prepared.
  Arm whole_;                   // without what is attached
  std::vector<Held> held_;
  bool has_torque_;
  std::uint64_t arm_count_ = 0;  // Number of arms after the first.
  std::unique_ptr<Recorder> recorder_;
  std::unique_ptr<Recorder> box_;            // guarded by setters_
  std::atomic<Recorder*> records_{nullptr};  // Used by the thread of `step`; null once the recording has ended.
  std::atomic<Recorder*> boxes_{nullptr};    // the same of the black box
  std::atomic<bool> in_use_{false};
  StateHistory history_;
  std::atomic<double> time_{0.0}, offset_{0.0};  // own time of the last step, and what it is more than the caller's [s]
};

}  // namespace sidestep

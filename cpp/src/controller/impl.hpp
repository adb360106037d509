#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "activation_distances.hpp"
#include "activity_judge.hpp"
#include "arm_dynamics.hpp"
#include "attractor_stage.hpp"
#include "clock.hpp"
#include "inputs_stage.hpp"
#include "joint_program.hpp"
#include "look_ahead_follower.hpp"
#include "measured_state.hpp"
#include "model.hpp"
#include "request_board.hpp"
#include "resting_clearances.hpp"
#include "sidestep/controller/controller.hpp"
#include "../guard/backup_manoeuvre.hpp"
#include "sources.hpp"
#include "speed_limiter.hpp"
#include "touch_judge.hpp"
#include "tracker.hpp"
#include "worker.hpp"

namespace sidestep {

/// A controller for one body: the stages of a step, see step.cpp, and what setters and the worker share with it.
class Controller::Impl {
 public:
  /// Writes its commands to `command`, of which it is the only writer while it steps. Without `works` it starts no thread, and
  /// what a step takes over is put into its buffers before: for a replay.
  Impl(Arm arm, ControllerSettings settings, Command& command, bool works = true);
  ~Impl();

  // For any thread.
  void set_goal(std::optional<Goal> goal);
  void set_velocity(const Eigen::VectorXd& v);
  void set_twist(const std::string& frame, const Vector6d& twist, bool local, TwistFreedom free);
  void set_trajectory(const Eigen::MatrixXd& q, const Eigen::VectorXd& times, TrajectoryBehaviour behaviour);
  /// All obstacles; `question`: what is hard to believe in what was set.
  void put(std::shared_ptr<const World> world, std::string question = {});
  /// `question`: of a trajectory; that of other requests is found here.
  void put(Request request, std::string question = {});
  /// Obstacles that were set, for the planner's thread.
  void share_with_planner(const Obstacles& obstacles);
  const RequestBoard& board() const noexcept { return board_; }
  RequestBoard& board() noexcept { return board_; }
  /// See Controller.
  std::optional<Obstruction> goal_obstruction() const;
  OnlinePlanner* planner() const noexcept { return inputs_.goal().planner(); }

  // In the thread of `step`.
  /// `time`: on the caller's clock [s]; NaN: not told.
  const Command& step(ConstVectorRef q, ConstVectorRef v, const ToldDynamics& told, double time) noexcept;
  /// The next step with a usable state begins where the arm is.
  void restart() noexcept;
  /// From this step on the arm rests, or goes on again.
  void pause(bool paused) noexcept;
  void continue_from(ConstVectorRef q, ConstVectorRef v, ConstVectorRef a) noexcept;
  /// Goes on where another one stopped: the target stays, a way to it is planned anew, and other requests go on. No allocation.
  void go_on_from(Impl& before) noexcept;
  bool is_lifted() const noexcept;
  std::string explain() const;
  Eigen::VectorXd target() const;
  const Obstacles& obstacles() const noexcept { return sources_.obstacles(); }
  const Sources& sources() const noexcept { return sources_; }
  const Tick& tick() const noexcept { return clock_.tick(); }
  std::uint64_t num_steps() const noexcept { return state_.steps; }
  const MeasuredState& measured() const noexcept { return measured_; }
  const GeometricSystem::Workspace& workspace() const noexcept { return attractor_.at_reference(); }
  detail::PartResults part_results() const noexcept { return {state_.attraction, state_.program, solution_}; }

  // Before the first step.
  /// Takes over the requests of another one whose arm has the same joints.
  void take_requests_of(Impl& before);
  /// Makes objects keep off obstacles that they rest on only as far as they do now.
  void let_rest(const std::vector<RestingObject>& objects);
  RestingClearances& resting() noexcept { return resting_; }
  const RestingClearances& resting() const noexcept { return resting_; }
  /// Asks the threads to end, and does not wait.
  void retire() noexcept { worker_.retire(); }

  const ControllerModel model;
  Impl* before = nullptr;              // Next of those that wait for another thread to destroy them.
  std::atomic<Impl*> lifted{nullptr};  // Controller to go on with once what rests is lifted; owned until then.
  std::uint64_t arm_number = 0;        // Number among the arms of a controller, in the order of preparation.

 private:
  friend class Recorder;
  friend class Replay;
  /// What a step took over from other threads beside its requests: a recording keeps it, and a replay gives it again. Null: nothing.
  struct Taken {
    std::uint64_t request = 0, obstacles = 0;  // numbers when this arm took over; 0: it did not
    bool is_told = false;                      // what the drives go on from
    bool restarts = false, pauses = false;     // the latter: it is paused and was not, or the other way round
    GoalFollower::Taken goal;
    const FoundActivations* activations = nullptr;
    const FoundTrajectory* trajectory = nullptr;
  };
  /// What a step hands on beside its stages.
  struct StepState {
    explicit StepState(Eigen::Index nv);

    std::uint64_t steps = 0;
    double next_look = 0.0;  // [s]
    bool apart = false;      // the arm is not exactly where the reference is
    bool paused = false;
    Told told;                                                      // what the drives go on from
    const Goal* followed = nullptr;                                 // Goal by which the reference is led.
    StepStatus attraction = StepStatus::invalid_state;              // how the attractor ended
    ProgramStatus program = ProgramStatus::fallback_invalid_input;  // how the program ended
    Eigen::VectorXd wanted, coupling;  // accelerations: after barriers, and to an arm that cannot follow
    TargetFindings findings;           // Findings for the next step.
    Places places;                     // Configurations near which activation distances shrink.
  };

  // Parts of `step`, in its order.
  void take_over(const Tick& tick) noexcept;
  /// Whether planner and barriers look at the obstacles in this step, once a while.
  bool begin_look(const Obstacles& obstacles, double time) noexcept;
  /// The motion begins where the arm is, or the reference goes on to now. Whether the arm is elsewhere than the reference.
  bool follow_arm(const Tick& tick) noexcept;
  void begin_motion() noexcept;
  /// The arm touched something: it begins anew where it is, and waits.
  void judge_touch(const Tick& tick) noexcept;
  /// The arm stops: the obstacles are old, it touched something, or it is paused.
  bool must_rest() const noexcept { return sources_.is_stale() || touch_.is_touched() || state_.paused; }
  /// Activation distances, shorter where the arm is led; `looks`: it is time to look for what moves.
  void update_activation_distances(bool looks, const Obstacles& obstacles) noexcept;
  /// Out of the way of what moves, in place of what is followed; and the pace that the look-ahead leaves.
  void look_ahead(const Goal& followed, const Tick& tick, const Obstacles& obstacles) noexcept;
  Lead lead(const Goal& followed, bool stale, const Tick& tick) const noexcept;
  /// Share of its speed that the arm may use: for the look-ahead's age, and where torques change rarely.
  double pace(const Tick& tick) const noexcept;
  /// The program's answer to the wanted acceleration, with the clearances of the arm where that is `apart`.
  ProgramStatus solve(const Eigen::VectorXd& wanted, bool apart, const Goal& followed, const ToldDynamics& told,
                      const Tick& tick) noexcept;
  /// Lets the reference go on only to where it can stop, see BackupManoeuvre.
  ProgramStatus guard(ProgramStatus solved, const Tick& tick) noexcept;
  ProgramStatus track(ProgramStatus solved, bool apart, double tracking_error, const ToldDynamics& told,
                      const Tick& tick) noexcept;
  void tell_worker(const Goal& followed, double time, bool wakes) noexcept;
  /// A stop, where the state or its time is unusable.
  const Command& stop(ConstVectorRef q, ConstVectorRef v, const ToldDynamics& told, const Tick& tick) noexcept;

  // What a step reports, see report.cpp.
  void report_motion(const Goal& followed, bool apart, const Tick& tick) noexcept;
  void report_timing(const Tick& tick) noexcept;
  void report_stop(const Tick& tick) noexcept;
  void report_torque(bool apart, const Tick& tick) noexcept;
  void write_gravity(bool known) noexcept;
  void report_program() noexcept;
  void report_position(const Eigen::VectorXd& q) noexcept;
  void report_clearance(bool apart) noexcept;
  void report_status(const Goal& followed, bool apart, const Tick& tick) noexcept;

  // See explain.cpp.
  std::string explain_motion() const;
  std::string explain_way() const;

  InputsStage::Moment moment(const NearReference& near, const Tick& tick) const noexcept;
  NearReference near_reference() const noexcept {
    const GeometricSystem::Workspace& at = attractor_.at_reference();
    return {at.clearances, at.state().v(), sources_.closing()};
  }
  const KinematicState& arm_state(bool apart) const noexcept {
    return apart ? attractor_.at_arm().state() : attractor_.at_reference().state();
  }

  RequestBoard board_;
  Clock clock_;
  MeasuredState measured_;
  Sources sources_;
  InputsStage inputs_;
  LookAheadFollower look_ahead_;
  AttractorStage attractor_;
  ActivationDistances distances_;
  ArmDynamics dynamics_;
  TouchJudge touch_;
  SpeedLimiter speed_;
  JointProgram program_;
  MotionSolution solution_;  // Solution for the reference.
  BackupManoeuvre guard_;
  Tracker tracker_;
  ActivityJudge activity_;
  Worker worker_;
  RestingClearances resting_;
  Reference reference_;
  LastOutput last_;
  StepState state_;
  Taken taken_;
  Command& command_;
};

template <class Action>
void Controller::tell(Action&& action) {
  const std::lock_guard lock(setters_);
  tell_locked(std::forward<Action>(action));
}

template <class Action>
void Controller::tell_locked(Action&& action) {
  // The one that takes over is told first: then it has no older request. The other one needs none after that.
  if (lifted_ != nullptr) {
    action(*lifted_);
  }
  if (lifted_ == nullptr || newest_->lifted.load() != nullptr) {
    action(*newest_);
  }
  note_requests();
}

}  // namespace sidestep

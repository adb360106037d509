#pragma once

#include <Eigen/Eigenvalues>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <semaphore>
#include <thread>
#include <variant>
#include <vector>

#include "sidestep/constraints/acceleration_filter.hpp"
#include "sidestep/math/triple_buffer.hpp"
#include "sidestep/controller/controller.hpp"
#include "sidestep/controller/motion.hpp"
#include "sidestep/controller/plausibility.hpp"
#include "sidestep/controller/posture_search.hpp"
#include "sidestep/clearance/stopping_clearance.hpp"
#include "sidestep/attractor/local_minimum_recovery.hpp"
#include "sidestep/planning/look_ahead.hpp"
#include "closing_estimate.hpp"
#include "../guard/failsafe.hpp"
#include "step_state.hpp"

namespace sidestep {

/// For example "link 'hand' and 'ball'".
std::string parties(const CoordinateLabel& label, const std::string& obstacle);

constexpr double lifted_room = 0.005;  // [m] from which on what rested is lifted

/// What the step, the setters and the worker of a Controller share. Members are grouped by the thread that owns them.
class Controller::Impl : private StepState {
 public:
  /// Writes its commands to `command`, of which it is the only writer while it steps. Without `workers` it starts no thread, and
  /// what a step takes over is put into its buffers before: for a replay.
  Impl(Arm arm, ControllerSettings settings, Command& command, bool workers = true);
  ~Impl();

  /// Takes over the orders of another one whose arm has the same joints; before the first step of this one.
  void take_orders_of(Impl& before);
  /// Goes on where another one stopped, in the thread of `step`: the target stays, a way to it is planned anew, and other orders
  /// go on. No allocation.
  void go_on_from(Impl& before) noexcept;

  void set_goal(std::optional<Goal> goal);
  void set_velocity(const Eigen::VectorXd& v);
  void set_twist(const std::string& frame, const Vector6d& twist, bool local, TwistFreedom free);
  void set_trajectory(const Eigen::MatrixXd& q, const Eigen::VectorXd& times, TrajectoryBehaviour behaviour);
  void set_obstacles(Obstacles obstacles);
  const Obstacles& obstacles() const noexcept { return obstacle_orders_.current().obstacles; }
  const Command& step(ConstVectorRef q, ConstVectorRef v, const Eigen::Ref<const Eigen::MatrixXd>* mass_matrix,
                      const Eigen::Ref<const Eigen::VectorXd>* bias) noexcept;
  /// As they were set last. For any thread.
  Obstacles newest_obstacles() const {
    const std::lock_guard lock(mutex_);
    return *shown_obstacles_;
  }
  std::string explain() const;
  /// The next step with a usable state begins where the arm is. In the thread of `step`.
  void restart() noexcept {
    begins_anew_ = taken_.restarts = true;
    plausible_before_ = false;
  }
  Questions questions() const {
    const std::lock_guard lock(mutex_);
    return questions_;
  }
  Eigen::VectorXd target() const;
  /// Makes objects keep off obstacles that they rest on only as far as they do now.
  void let_rest(const std::vector<RestingObject>& objects);
  bool is_lifted() const noexcept;
  /// Asks the threads to end, and does not wait.
  void retire() noexcept { stopping_.store(true); }
  /// See Controller.
  std::optional<Obstruction> goal_obstruction() const;
  /// Measured in the last step; empty before the first. For one thread at a time.
  Eigen::VectorXd last_q() {
    const Eigen::VectorXd& q = measured_.get();
    return q.allFinite() ? q : Eigen::VectorXd();
  }

  const Arm arm;
  const ControllerSettings settings;
  const bool torque;
  const std::optional<HoldingTorque> holding_;
  std::shared_ptr<const GeometricSystem> system;
  GeometricSystem::Workspace workspace;
  TorqueSolution solution;
  Command& command;
  Impl* before = nullptr;              // of those that wait for another thread to destroy them
  std::atomic<Impl*> lifted{nullptr};  // to go on with once what rests is lifted; its own until then
  std::unique_ptr<OnlinePlanner> guide;
  std::uint64_t arm_number = 0;  // of the arms of a controller, in the order in which they were prepared

 private:
  friend class Recorder;
  friend class Replay;
  struct VelocityOrder {
    Eigen::VectorXd velocity;
  };
  struct TwistOrder {
    Frame frame;
    Vector6d twist;
    bool local;
    TwistFreedom free;
  };
  struct TrajectoryOrder {
    JointTrajectory path;
    TrajectoryBehaviour behaviour;
    std::shared_ptr<const TrajectorySamples> samples;  // as they were given
  };
  /// What the arm is to do, as it was set.
  using Order = std::variant<std::monostate, Goal, VelocityOrder, TwistOrder, TrajectoryOrder>;
  /// With its number: 0 is none.
  struct GoalOrder {
    std::uint64_t number = 0;
    Order order;
  };
  struct ObstacleOrder {
    std::uint64_t number = 0;
    Obstacles obstacles = Obstacles::none();
  };
  /// What the step tells the worker every `look_period_`.
  struct Snapshot {
    explicit Snapshot(const Arm& arm, const AvoidanceTrajectory& flight);

    double time = 0.0;
    Eigen::VectorXd q, v;
    std::uint64_t goal_number = 0, posture_attempt = 0;
    std::uint64_t obstacle_number = 0;
    double obstacle_age = 0.0;
    JointGoal followed;          // the reference of the step
    bool on_trajectory = false;  // of the order, which began there, and whose clock is there
    Eigen::VectorXd begin_q, begin_v;
    double clock = 0.0, rate = 0.0;
    bool by_pose = false;    // the pose goal itself is followed, as it moves
    double order_age = 0.0;  // for how long it has moved [s]
    OnlinePlanner::Following following;
    Eigen::MatrixXd places;  // where barriers leave room (nv × num_places)
    Eigen::Index num_places = 0;
    bool avoiding = false;
    AvoidanceTrajectory trajectory;
    std::chrono::steady_clock::time_point written{};
  };
  /// Activation distances, and whether the target itself is inside a barrier.
  struct Activations {
    std::uint64_t goal_number = 0, posture_attempt = 0;
    Eigen::VectorXd values;
    bool target_blocked = false;
  };
  struct FoundPosture {
    std::uint64_t goal_number = 0, attempt = 0;
    Posture posture;
  };
  /// What to follow from `time` + delay on.
  struct FoundTrajectory {
    double time = 0.0;
    std::uint64_t goal_number = 0;
    bool avoid = false;
    AvoidanceTrajectory trajectory;
    double duration = 0.0;  // from the state to here, by the machine's clock [s]
  };
  /// What a step took over from other threads beside its orders: a recording keeps it, and a replay gives it again. Null: nothing.
  struct Taken {
    std::uint64_t goal = 0, obstacles = 0;  // numbers of the orders when this arm took over; 0: it did not
    bool restarts = false;
    const FoundPosture* posture = nullptr;
    const Activations* activations = nullptr;
    const FoundTrajectory* trajectory = nullptr;
    const OnlinePlanner::Answer* answer = nullptr;
    const OnlinePlanner::Looked* look = nullptr;
  };

  /// `question`: of a trajectory; that of other orders is found here.
  void put(Order order, std::string question = {});
  std::string question_of(const Order& order) const;

  // Of the step.
  bool take_state(ConstVectorRef q, ConstVectorRef v) noexcept;
  void take_orders() noexcept;
  void take_obstacles() noexcept;
  /// The position that is commanded of a joint: at its limit, where the reference is beyond it by no more than noise.
  double within_limits(double q, Eigen::Index joint) const noexcept;
  /// Leaves out the push out of what is in doubt, where nothing else asks for one.
  void wait_in_doubt() noexcept;
  void begin_goal() noexcept;
  void next_posture(const PoseGoal& pose) noexcept;
  void take_posture(const Posture& posture) noexcept;
  void choose_reference() noexcept;
  /// Adds to the reference's acceleration what its pull lacks of the critical spring that follows a path, which is stiffer
  /// than one that approaches a goal.
  void hold_to_path(const Eigen::VectorXd& q, const Eigen::VectorXd& v, JointGoal& reference) const noexcept;
  void leave_room(bool looks) noexcept;
  const TrajectoryOrder* trajectory_order() const noexcept {
    return std::get_if<TrajectoryOrder>(&goal_orders_.current().order);
  }
  bool is_fresh() const noexcept { return order_age_ <= settings.inputs.timeout; }
  /// Velocity, twist or trajectory, while no goal has taken its place.
  bool has_input() const noexcept { return goal_ == &input_goal_ && moves_; }
  void begin_input() noexcept;
  void follow_input() noexcept;
  void follow_velocity(const VelocityOrder* velocity, const TwistOrder* twist) noexcept;
  void pull(const Eigen::VectorXd& velocity, const Eigen::VectorXd& acceleration) noexcept;
  void keep_bounds(const Eigen::VectorXd& velocity) noexcept;
  /// A bound of the wanted velocity that it does not keep: g·v ≥ least, or of a joint ±v ≤ most.
  struct Bound {
    Eigen::Index joint = -1, clearance = -1;
    double excess = 0.0, least = 0.0, length = 1.0;
  };
  double joint_room(Eigen::Index j, bool up) const noexcept;
  Bound find_worst(bool clearances, bool joints) const noexcept;
  bool hold(const Bound& bound, Eigen::Index held) noexcept;
  bool hold_worst(Eigen::Index held) noexcept;
  using FrameJacobian = Eigen::Matrix<double, Eigen::Dynamic, 6>;  // transposed
  static void write_jacobian(const KinematicState& state, const TwistOrder& order, FrameJacobian& transposed) noexcept;
  void take_twist(const TwistOrder& order) noexcept;
  void solve_twist(const TwistOrder& order) noexcept;
  void step_off_singular(const TwistOrder& order) noexcept;
  void scale_twist(const TwistOrder& order) noexcept;
  /// The share of the wanted velocity at which no singular value falls too fast to the one where a twist comes to rest.
  double keep_off_singular(const TwistOrder& order, const Eigen::Matrix<double, 6, 6>& directions, const Vector6d& sigma,
                           const Vector6d& asked, const Vector6d& drop, Reduction& reduction) noexcept;
  void slide(const Vector6d& twist) noexcept;
  /// Writes to `path_a_` with which acceleration v goes to the wanted velocity.
  void respond(const Eigen::VectorXd& v) noexcept;
  /// Scales a velocity to the limits; by how much.
  double scale_to_limits(Eigen::VectorXd& velocity, Reduction& reduction) const noexcept;
  /// Writes `command.input_change`, and raises the status where what was asked for is reduced.
  void judge_input() noexcept;
  /// [rad/s | m/s] By how much a joint may be off a velocity of all and count as following it.
  double joint_tolerance(const Eigen::VectorXd& asked, Eigen::Index j) const noexcept;
  /// Whether that is the velocity or twist that was asked for, within InputTolerance.
  bool follows(const Eigen::VectorXd& v) const noexcept;
  /// Whether that change of velocity is more than a share of the tolerance of what was asked for.
  bool differs(const Eigen::VectorXd& change, double share) const noexcept;
  bool slows_trajectory() const noexcept;
  void begin_trajectory(TrajectoryOrder& order) noexcept;
  void follow_trajectory(const TrajectoryOrder& order) noexcept;
  double starting_rate(const JointTrajectory& path, double s) noexcept;
  void run_clock(const TrajectoryOrder& order) noexcept;
  void look_along(const JointTrajectory& path, double window) noexcept;
  bool keeps_path() const noexcept {
    return pulls_ && trajectory_order() && trajectory_order()->behaviour == TrajectoryBehaviour::keep_path;
  }
  std::string explain_motion() const;
  std::string explain_trajectory() const;
  std::string explain_input() const;
  /// How much slower than the velocity or twist that was asked for it moves; empty where it does not.
  std::string explain_lag() const;
  /// What it gives way to though nobody told its velocity; empty where there is nothing.
  std::string explain_closing() const;
  /// What makes it slower, before the program; empty where nothing does.
  std::string explain_reduction() const;
  std::string explain_singular() const;
  /// Why the last step moved as it did; how far the goal is counts from the arm to the goal that was set, wherever a path or a
  /// sub-goal leads first.
  Diagnosis diagnosis() const;
  /// What is in the way at the target, as deep as the covering body says; empty where nothing is.
  std::string explain_target() const;
  /// What to do where the arm is in something now.
  std::string way_out(const Obstruction& here) const;
  /// Whether what is in the way may be so for the covering body alone: links overshoot by more than they reach into it.
  bool finer_covers_may_free(const Obstruction& obstruction) const;
  void avoid() noexcept;
  /// How old the look-ahead and the planner are, and how fast the arm may move at that.
  void judge_age() noexcept;
  /// Whether the age of the look-ahead slows the arm.
  bool is_slowed_by_age() const noexcept { return pace_ < 1.0 && command.activity == Activity::moving; }
  std::string explain_age() const;
  using MassMatrix = const Eigen::Ref<const Eigen::MatrixXd>*;
  using Bias = const Eigen::Ref<const Eigen::VectorXd>*;
  void begin_reference() noexcept;
  /// Compares the sample with where the arm can be. One that cannot be is bridged by the prediction; where several in a row, or the
  /// first after a pause, disagree with the reference, it begins anew.
  void judge_sample() noexcept;
  /// Whether the sample is near the reference, can be reached from the last one that was taken, and from the last sample.
  void compare_sample(double elapsed, bool& is_near, bool& is_possible, bool& is_steady) const noexcept;
  /// Whether the arm rests away from what its drives were commanded, for longer than they lag.
  bool rests_elsewhere() noexcept;
  /// By which an error that counts of joint j differs from that of joints that turn: 1, or 0.2 m/rad where it slides.
  double error_scale(Eigen::Index j) const noexcept;
  /// Bridges a sample that is an old one again.
  void check_repetition() noexcept;
  /// Replaces velocities that leap alone.
  void check_velocity() noexcept;
  /// Begins where the arm is what a first step begins; the goal stays.
  void begin_anew() noexcept;
  /// Adds to the commanded velocity what leads an arm back to its reference, within its limits of velocity and acceleration.
  void add_drift(bool known) noexcept;
  /// Of a sample that was bridged: the clearances and the error that are reported.
  void look_at_sample() noexcept;
  /// The last guard of the torque's rate, for what comes from elsewhere than the program.
  void keep_torque_rate() noexcept;
  std::string explain_measurement() const;
  void follow_arm() noexcept;
  void observe() noexcept;
  void take_dynamics(const KinematicState& state, MassMatrix mass_matrix, Bias bias) noexcept;
  void solve_reference(MassMatrix mass_matrix, Bias bias) noexcept;
  /// Lets the reference go on only to where it can stop, see Failsafe.
  void keep_failsafe() noexcept;
  void track(MassMatrix mass_matrix, Bias bias) noexcept;
  bool is_impedance() const noexcept { return torque && settings.tracking.stiffness > 0.0; }
  static constexpr int most_of_impedance = 32;  // joints
  using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most_of_impedance, most_of_impedance>;
  /// ω of the feedback [1/s].
  double feedback_frequency() noexcept;
  /// Writes the acceleration that an impedance around the reference asks for.
  void write_impedance() noexcept;
  const KinematicState& arm_state() const noexcept { return apart_ ? arm_workspace_.state() : workspace.state(); }
  void limit_speed() noexcept;
  void limit_pace(double limit) noexcept;
  std::string explain_speed() const;
  void stop(MassMatrix mass_matrix, Bias bias, ConstVectorRef q, ConstVectorRef v) noexcept;
  void advance_reference() noexcept;
  LastCommand last_command(const Eigen::VectorXd* acceleration, const Eigen::VectorXd* of_torque, double factor,
                           bool binds) const noexcept;
  void write_gravity(bool known) noexcept;
  void report(bool known) noexcept;
  Activity judge_activity() noexcept;
  Way way_to_goal() noexcept;
  /// Follows `way_to_goal` once it has said the same for a while.
  void settle_way() noexcept;
  void forget_way() noexcept;
  bool at_goal() noexcept;
  void write_places(Eigen::MatrixXd& places, Eigen::Index& num) const noexcept;
  void write_snapshot() noexcept;
  /// Also where a timeout was set and obstacles never were: nothing is known to be free.
  bool is_stale() const noexcept {
    return obstacle_age_ > settings.obstacle_timeout || (obstacle_number_ == 0 && std::isfinite(settings.obstacle_timeout));
  }
  bool has_sub_goal() const noexcept { return followed_ != nullptr && followed_ != &reference_ && followed_ != goal_; }
  void keep_room() noexcept;
  bool has_goal() const noexcept { return goal_ != nullptr; }
  /// The target is inside something, and the arm goes straight to it: it stops before.
  bool stops_short() const noexcept {
    return target_blocked_ && (!guide || (path_reference_.arrives && followed_ == &reference_));
  }
  const PoseGoal* pose_goal() const noexcept { return goal_ == nullptr ? nullptr : std::get_if<PoseGoal>(goal_); }

  // Of the worker; in `step` where synchronous.
  void run();
  void look(const Snapshot& snapshot);
  /// Calls action(); what it throws costs its result, is kept for `explain`, and ends neither the thread nor the
  /// process.
  template <class Action>
  void guarded(Action&& action) noexcept;
  void note_fault(const char* what) noexcept;
  Obstacles obstacles_at(const Snapshot& snapshot) const;
  Posture search_posture(const PoseGoal& goal, const Eigen::VectorXd& near, const Obstacles& obstacles, std::uint64_t attempt,
                         std::uint64_t goal_number);
  LookAhead::Leader leader_of(const OnlinePlanner::Following& following) const;
  LookAhead::Leader leader_of(JointTrajectory path, double clock, double rate) const;
  /// Writes activation distances that leave room at places; whether the last of them is inside a barrier.
  bool lower_at(const Eigen::MatrixXd& places, Eigen::Index num, const Obstacles& obstacles,
                GeometricSystem::Workspace& workspace, Eigen::VectorXd& activations) const noexcept;

  // Between the threads.
  TripleBuffer<GoalOrder> goal_orders_;
  TripleBuffer<ObstacleOrder> obstacle_orders_;
  TripleBuffer<Snapshot> snapshots_;
  TripleBuffer<Activations> activations_;
  TripleBuffer<FoundPosture> postures_;
  TripleBuffer<FoundTrajectory> trajectories_;
  TripleBuffer<Eigen::VectorXd> measured_;  // NaN before the first step
  mutable std::mutex mutex_;                // of what follows; the step never takes it unless synchronous
  Order shown_order_;
  std::uint64_t goal_count_ = 0, obstacle_count_ = 0;
  std::shared_ptr<const Obstacles> shown_obstacles_;
  std::optional<Posture> shown_posture_;
  Questions questions_;
  std::array<char, 160> shown_fault_{};  // what the worker failed with; empty: nothing

  // Of the step.
  Taken taken_;
  std::optional<RigidBodyDynamics> dynamics_;
  std::optional<RigidBodyDynamics::Workspace> dynamics_workspace_;
  std::optional<TorqueController> torque_program_, tracking_program_;  // of the reference, of the arm
  std::optional<AccelerationFilter> filter_, tracking_filter_;
  std::optional<LocalMinimumRecovery> escape_;
  BodyClearance body_;
  BodyClearance::Workspace here_;
  const Plausibility plausible_;
  Eigen::VectorXd unknown_;  // a state that is none: not finite
  Failsafe failsafe_;
  ClosingEstimate closing_;                // of obstacles, beyond the velocities that they were told with
  Clearances corrected_, arm_corrected_;   // by it: of the reference, of the arm
  bool drives_track_ = false;              // the output is position or velocity
  SpeedRows speed_rows_, arm_speed_rows_;  // of the reference, of the arm
  int nearest_point_ = -1;                 // of obstacles
  KinematicState leader_;                  // the reference on the planner's path
  GeometricSystem::Workspace arm_workspace_;
  TorqueSolution tracked_;
  Eigen::SelfAdjointEigenSolver<Small> modes_;  // of an impedance
  std::vector<bool> is_sliding_, is_unlimited_;
  std::vector<Eigen::Index> metric_coordinates_;  // of obstacles, planes and links: clearances in metres
  struct Resting {
    Eigen::Index coordinate;
    double clearance;  // from which on its whole ellipsoid is free [m]
  };
  std::vector<Resting> resting_;
  Goal* goal_ = nullptr;  // in the current order
  OnlinePlanner::Reference path_reference_;
  OnlinePlannerStatus guide_status_ = OnlinePlannerStatus::idle;
  const Goal* followed_ = nullptr;
  Eigen::VectorXd held_v_;
  Eigen::MatrixXd held_;                                // directions that limits hold, orthonormal (nv × 6)
  Eigen::Index held_clearance_ = -1, held_joint_ = -1;  // what holds the first of them, of a velocity or twist; -1: none
  bool held_upper_ = false;                             // at that joint's upper limit
  Eigen::VectorXd best_v_, ahead_q_, off_;
  KinematicState twist_state_, ahead_;
  FrameJacobian jacobian_transposed_, projected_, jacobian_ahead_;
  Eigen::Matrix<double, 6, 6> principal_ = Eigen::Matrix<double, 6, 6>::Identity();  // directions of the Jacobian
  Vector6d squares_ = Vector6d::Zero();                                              // of its singular values
  Eigen::VectorXd most_v_, most_a_;                                                  // limits that motions use
  Eigen::VectorXd seen_q_, seen_v_, seen_a_, path_step_;
  bool pending_ = false;  // a trajectory out of the way, found and not followed yet
  Eigen::MatrixXd places_, lowered_places_;
  Eigen::Index num_places_ = 0, num_lowered_ = -1;
  std::uint64_t lowered_version_ = 0;  // of obstacles
  GeometricSystem::Workspace room_;    // for looks at places, where synchronous

  // Of the worker.
  std::unique_ptr<LookAhead> evasion_;
  std::optional<RrtConnect> ends_;  // says what is free at an end
  BodyClearance::Workspace posture_room_;
  GeometricSystem::Workspace worker_workspace_;
  std::uint64_t sought_goal_ = 0, sought_attempt_ = 0;
  double next_trajectory_ = 0.0;
  double look_period_;
  std::counting_semaphore<> wake_{0};
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

template <class Action>
void Controller::tell(Action&& action) {
  const std::lock_guard lock(setters_);
  // The one that takes over is told first: then it has no older order. The other one needs none after that.
  if (lifted_ != nullptr) {
    action(*lifted_);
  }
  if (lifted_ == nullptr || newest_->lifted.load() != nullptr) {
    action(*newest_);
  }
  note_requests();
}

template <class Action>
void Controller::Impl::guarded(Action&& action) noexcept {
  try {
    action();
  } catch (const std::exception& error) {
    note_fault(error.what());
  } catch (...) {
    note_fault("an unknown exception");
  }
}

}  // namespace sidestep

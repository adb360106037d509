#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "sidestep/attractor/diagnosis.hpp"
#include "sidestep/attractor/gain.hpp"
#include "sidestep/attractor/goal.hpp"
#include "sidestep/attractor/penetration_recovery.hpp"
#include "sidestep/attractor/switch.hpp"
#include "sidestep/attractor/embedding.hpp"
#include "sidestep/clearance/stopping_clearance.hpp"
#include "sidestep/attractor/graph_metric.hpp"

namespace sidestep {

/// Where damping acts: h = −G⁻¹ ∂U − D (v − v*) (plain, T5.4), or h = −G⁻¹ (∂U + D (v − v*)) (metric, T2.12).
enum class DampingForm { plain, metric };

/// Form of the attraction: −G⁻¹ ∂U (metric, T5.4), or held back only where a ψ rises (one_sided, see one_sided_metric.hpp).
enum class PullForm { metric, one_sided };

struct GeometricSystemSettings {
  Eigen::MatrixXd stiffness;  ///< K (nv × nv) [1/s²], symmetric positive semi-definite.
  Eigen::MatrixXd damping;    ///< D (nv × nv) [1/s], symmetric positive semi-definite.
  DampingForm damping_form = DampingForm::plain;
  Switch combination = Unswitched{};
  double fallback_rate = 10.0;        ///< Rate of the fallback's damped stop, q̈ = −rate v [1/s].
  PenetrationRecovery recovery = {};  ///< Recovery of an arm that is inside a barrier.
  PullForm pull_form = PullForm::metric;
};

/// @cond internal
/// Status of a step.
enum class StepStatus {
  ok,                   ///< The equations hold.
  outside_limits,       ///< The equations hold, but a joint is outside its position limits.
  goal_out_of_reach,    ///< The equations hold, but the frame cannot reach the goal.
  inside_barrier,       ///< The equations hold, with a push: a clearance is below its barrier's floor.
  goal_outside_limits,  ///< The goal is outside the position limits: the equations hold without its attraction.
  invalid_goal,         ///< The goal is not finite, or made for another robot: the equations hold without its attraction.
  invalid_state,        ///< Fallback: q or v is not finite.
  not_finite,           ///< Fallback: the equations gave a value that is not finite.
};

/// Whether the acceleration is the fallback, a damped stop within the acceleration limits.
constexpr bool is_fallback(StepStatus status) noexcept {
  return status == StepStatus::invalid_state || status == StepStatus::not_finite;
}
/// @endcond

/// A damped spring that moves on the graph of ψ: obstacles bend its path (Bosc 2024, chapter 5).
///
///     harmonic   h = −G⁻¹ ∂U − D (v − v*)         (T5.4; ∂U = K (q − q*) and v* = 0 for a configuration at rest)
///     geodesic   g = −G⁻¹ Jᵀ d²ψ/dt²              (T5.3 in closed form)
///     a = h + g, or weighted joint by joint as the Switch says, plus the push of recovery.hpp out of barriers.
///
/// Immutable; a Workspace per thread holds everything that changes. Several embeddings are stacked: each has its own
/// coordinates. None at all gives flat space.
class GeometricSystem {
 public:
  /// Throws std::invalid_argument that names the setting at fault.
  GeometricSystem(Robot robot, std::vector<std::shared_ptr<const Embedding>> embeddings, GeometricSystemSettings settings);

  /// The result of a step, and the memory it needs.
  class Workspace {
   public:
    explicit Workspace(const GeometricSystem& system);

    Eigen::VectorXd acceleration;         ///< Acceleration a (nv) [rad/s²].
    Eigen::VectorXd harmonic, geodesic;   ///< Harmonic and geodesic parts h and g (nv) [rad/s²].
    Eigen::VectorXd attraction;           ///< −G⁻¹ ∂U (nv) [rad/s²]: the desired acceleration that the metric lets through.
    Eigen::VectorXd recovery;             ///< Acceleration out of barriers (nv) [rad/s²]; zero outside.
    int inside = -1;                      ///< Coordinate deepest below its floor; -1: none.
    Eigen::VectorXd switch_weights;       ///< Weights s (nv): 1 is harmonic.
    Eigen::VectorXd values, curvatures;   ///< ψ and d²ψ/dt² (m).
    Eigen::MatrixXd jacobian_transposed;  ///< ∂ψ/∂q as columns (nv × m).
    Clearances clearances;                ///< Clearances of the coordinates that are barriers of clearances (m).
    Eigen::VectorXd activations;          ///< Input: activation distances (m) of these, at first the system's.
    /// Input: least time τ [s] within which approaching obstacles count, see Horizon.
    double horizon = Horizon::of_obstacles;
    GraphMetric metric;
    GoalPotential goal;  ///< U, ∂U, v* and the distance to the goal.

    /// Positions and velocities of the links at the last step.
    const KinematicState& state() const noexcept { return state_; }

   private:
    friend class GeometricSystem;
    KinematicState state_;
    Eigen::VectorXd relative_velocity_, distances_;
    Eigen::VectorXd rest_;
    OneSidedMetric one_sided_;
    PenetrationRecoveryWorkspace recovery_;
    Goal joint_goal_;
    StepStatus status_ = StepStatus::ok;
  };

  /// One step at (q, v) [rad, rad/s] towards `goal` [rad]. Never throws, never allocates; the status must be read.
  /// After a fallback only `workspace.acceleration` is of this step and, unless the state is invalid, what `embed`
  /// writes.
  [[nodiscard]] StepStatus acceleration(ConstVectorRef q, ConstVectorRef v, ConstVectorRef goal, const Obstacles& obstacles,
                                        Workspace& workspace) const noexcept;

  /// The same towards any goal, see goal.hpp.
  [[nodiscard]] StepStatus acceleration(ConstVectorRef q, ConstVectorRef v, const Goal& goal, const Obstacles& obstacles,
                                        Workspace& workspace) const noexcept;

  /// The embedding alone, without a goal: coordinates and clearances of `workspace`. False, and nothing is written,
  /// where q or v is not finite. No allocation.
  [[nodiscard]] bool embed(ConstVectorRef q, ConstVectorRef v, const Obstacles& obstacles, Workspace& workspace) const noexcept;

  /// Whether the body at q, finite, reaches deeper than `depth` [m] into an obstacle, see Embedding: quick, and may
  /// miss it. No allocation.
  bool touches(ConstVectorRef q, const Obstacles& obstacles, double depth, Workspace& workspace) const noexcept;

  /// Explains the motion of the step in `workspace`, see diagnosis.hpp. No allocation.
  Diagnosis diagnose(const Workspace& workspace) const noexcept;

  /// The same, and whether the goal itself is blocked. Takes a step at the goal as well, so not for every step of a loop. A pose
  /// may be reached in many configurations and is not examined.
  Diagnosis diagnose(ConstVectorRef q, ConstVectorRef v, const Goal& goal, const Obstacles& obstacles,
                     Workspace& workspace) const noexcept;

  /// Lowers activation distances (m) so that barriers leave a configuration (nv) [rad | m] free, see Barrier. Overwrites the last
  /// step in the workspace. False, and nothing changes, if the configuration is not finite. No allocation.
  [[nodiscard]] bool lower_activations(ConstVectorRef q, const Obstacles& obstacles, Workspace& workspace,
                                       Eigen::Ref<Eigen::VectorXd> activations) const noexcept;

  /// The activation distances (m) that a workspace begins with.
  const Eigen::VectorXd& activations() const noexcept { return activations_; }

  /// What every embedding coordinate stands for (m).
  const std::vector<CoordinateLabel>& labels() const noexcept { return labels_; }
  const Robot& robot() const noexcept { return robot_; }
  const GeometricSystemSettings& settings() const noexcept { return settings_; }
  const std::vector<std::shared_ptr<const Embedding>>& embeddings() const noexcept { return embeddings_; }
  int num_embedding_coordinates() const noexcept { return num_embedding_coordinates_; }

 private:
  // `nv` is from with_size (vectors.hpp).
  template <class Size>
  StepStatus step(ConstVectorRef q, ConstVectorRef v, const Goal& goal, const Obstacles& obstacles, Workspace& workspace,
                  Size nv) const noexcept;
  template <class Size>
  void combine(const Obstacles& obstacles, Workspace& workspace, Size nv) const noexcept;
  StepStatus fall_back(StepStatus status, ConstVectorRef v, Workspace& workspace) const noexcept;

  Robot robot_;
  std::vector<std::shared_ptr<const Embedding>> embeddings_;
  GeometricSystemSettings settings_;
  Gain stiffness_, damping_;
  int num_embedding_coordinates_ = 0;
  std::vector<CoordinateLabel> labels_;
  Eigen::VectorXd floors_, activations_;
};

}  // namespace sidestep

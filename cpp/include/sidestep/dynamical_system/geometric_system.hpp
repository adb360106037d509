#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "sidestep/dynamical_system/switch.hpp"
#include "sidestep/embedding/embedding.hpp"
#include "sidestep/geometry/graph_metric.hpp"

namespace sidestep {

/// Where damping acts: h = −G⁻¹ K (q − q*) − D v (plain, T5.4), or h = −G⁻¹ (K (q − q*) + D v) (metric, T2.12).
enum class DampingForm { plain, metric };

struct GeometricSystemSettings {
  Eigen::MatrixXd stiffness;                      ///< K (nv × nv) [1/s²], symmetric positive semi-definite
  Eigen::MatrixXd damping;                        ///< D (nv × nv) [1/s], the same
  DampingForm damping_form = DampingForm::plain;
  Switch combination = Unswitched{};
  double fallback_rate = 10.0;                    ///< [1/s] the damped stop of the fallback is q̈ = −rate v
};

/// What a step of the system says about its result.
enum class StepStatus {
  ok,                   ///< the equations hold
  outside_limits,       ///< the equations hold, but a joint is outside its position limits
  goal_outside_limits,  ///< fallback: the goal is outside the position limits
  invalid_state,        ///< fallback: q or v is not finite
  invalid_goal,         ///< fallback: the goal is not finite
  not_finite,           ///< fallback: the equations gave a value that is not finite
};

/// Whether the acceleration is the fallback, a damped stop within the acceleration limits.
constexpr bool is_fallback(StepStatus status) noexcept {
  return status != StepStatus::ok && status != StepStatus::outside_limits;
}

/// A damped spring that moves on the graph of ψ: obstacles bend its path (Bosc 2024, chapter 5).
///
///     harmonic   h = −G⁻¹ K (q − q*) − D v        (T5.4)
///     geodesic   g = −G⁻¹ Jᵀ d²ψ/dt²              (T5.3 in closed form)
///     a = h + g, or weighted joint by joint as the Switch says.
///
/// Immutable; a Workspace per thread holds everything that changes. Several embeddings are stacked: each has its own
/// coordinates. None at all gives flat space.
class GeometricSystem {
 public:
  /// Throws std::invalid_argument that names the setting at fault.
  GeometricSystem(Robot robot, std::vector<std::shared_ptr<const Embedding>> embeddings,
                  GeometricSystemSettings settings);

  /// The result of a step, and the room it needs.
  class Workspace {
   public:
    explicit Workspace(const GeometricSystem& system);

    Eigen::VectorXd acceleration;         ///< a (nv) [rad/s²]
    Eigen::VectorXd harmonic, geodesic;   ///< h and g (nv) [rad/s²]
    Eigen::VectorXd switch_weights;       ///< s (nv): 1 is harmonic
    Eigen::VectorXd values, curvatures;   ///< ψ and d²ψ/dt² (m)
    Eigen::MatrixXd jacobian_transposed;  ///< (nv × m)
    Clearances clearances;                ///< of the coordinates that are barriers of clearances (m)
    GraphMetric metric;

   private:
    friend class GeometricSystem;
    KinematicState state_;
    Eigen::VectorXd displacement_, distances_;
  };

  /// One step at (q, v) [rad, rad/s] towards `goal` [rad]. Never throws, never allocates; the status must be read.
  /// After a fallback only `workspace.acceleration` is of this step.
  [[nodiscard]] StepStatus acceleration(Eigen::Ref<const Eigen::VectorXd> q, Eigen::Ref<const Eigen::VectorXd> v,
                                        Eigen::Ref<const Eigen::VectorXd> goal, const Obstacles& obstacles,
                                        Workspace& workspace) const noexcept;

  const Robot& robot() const noexcept { return robot_; }
  const GeometricSystemSettings& settings() const noexcept { return settings_; }
  int num_embedding_coordinates() const noexcept { return num_embedding_coordinates_; }

 private:
  void embed(const Obstacles& obstacles, Workspace& workspace) const noexcept;
  void combine(const Obstacles& obstacles, Workspace& workspace) const noexcept;
  StepStatus fall_back(StepStatus status, Eigen::Ref<const Eigen::VectorXd> v, Workspace& workspace) const noexcept;

  Robot robot_;
  std::vector<std::shared_ptr<const Embedding>> embeddings_;
  GeometricSystemSettings settings_;
  int num_embedding_coordinates_ = 0;
};

}  // namespace sidestep

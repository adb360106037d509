#pragma once

#include <Eigen/Core>
#include <optional>

#include "sidestep/constraints/disturbance_observer.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/robot/dynamics.hpp"
#include "sidestep/robot/kinematic_state.hpp"
#include "tick.hpp"

namespace sidestep {

/// The arm's own mass matrix (nv × nv) and bias (nv) [Nm | N] where they are told; null: not.
struct ToldDynamics {
  const Eigen::Ref<const Eigen::MatrixXd>* mass_matrix = nullptr;
  const Eigen::Ref<const Eigen::VectorXd>* bias = nullptr;
};

/// What the arm was commanded last.
struct LastOutput {
  explicit LastOutput(Eigen::Index nv) : acceleration(Eigen::VectorXd::Zero(nv)), torque(acceleration) {}
  /// No allocation.
  void take(const Eigen::VectorXd& a, const Eigen::VectorXd& t, bool by_torque) noexcept {
    acceleration = a;
    torque = t;
    has_torque = by_torque;
  }

  Eigen::VectorXd acceleration, torque;  // (nv) each
  bool has_torque = false;
};

/// The dynamics M q̈ + h = τ + d of the arm: model or told, with the disturbance d that is observed.
class ArmDynamics {
 public:
  ArmDynamics(const std::optional<RigidBodyDynamics>& model, const Robot& robot, const ControllerSettings& settings,
              bool torque);

  /// Compares the velocity v with what the last output makes of the last one; `begins`: there is no last one. A gap says nothing.
  void observe(bool begins, const Eigen::VectorXd& v, const LastOutput& last, const Tick& tick) noexcept;
  /// Nothing but `load` (nv) [Nm | N] acts on the arm beside the model, as far as is known: what was observed since was a touch.
  void hold(const Eigen::VectorXd& load) noexcept;
  /// The motion begins at the velocity v: what it was before explains nothing.
  void begin_at(const Eigen::VectorXd& v) noexcept { last_v_ = v; }
  /// Writes M and h at a state, as told or by the model, with what is observed. Without either M is NaN.
  void update(const KinematicState& state, const ToldDynamics& told) noexcept;
  /// Gravity at a state, and its change since the last call; `first`: none.
  void update_gravity(const KinematicState& state, bool first) noexcept;
  /// Writes the bias of the model at q, v: what would hold the arm. Only with a model.
  void write_bias(const Eigen::VectorXd& q, const Eigen::VectorXd& v, Eigen::VectorXd& bias) noexcept;
  /// Goes on from another body's.
  void go_on_from(const ArmDynamics& before) noexcept;
  /// Another model from now on, of an arm at q, v: what it weighs more by that, the observer has seen before.
  void change_weight(const Eigen::VectorXd& q, const Eigen::VectorXd& v) noexcept;

  bool has_model() const noexcept { return model_.has_value(); }
  const Eigen::MatrixXd& mass() const noexcept { return mass_; }
  const Eigen::VectorXd& bias() const noexcept { return bias_; }
  const Eigen::VectorXd& model_bias() const noexcept { return model_bias_; }  ///< without what is observed
  const Eigen::VectorXd& gravity() const noexcept { return gravity_; }
  const Eigen::VectorXd& gravity_change() const noexcept { return gravity_change_; }
  const std::optional<DisturbanceObserver>& observer() const noexcept { return observer_; }
  const std::optional<RigidBodyDynamics>& model() const noexcept { return model_; }

 private:
  const Robot& robot_;
  std::optional<RigidBodyDynamics> model_;
  std::optional<RigidBodyDynamics::Workspace> workspace_;
  std::optional<DisturbanceObserver> observer_;
  Eigen::MatrixXd mass_, model_mass_;  // Mass matrix with and without what is observed.
  Eigen::VectorXd bias_, model_bias_;
  Eigen::VectorXd gravity_, gravity_change_;
  Eigen::VectorXd last_v_;
  KinematicState state_;
};

}  // namespace sidestep

#include "arm_dynamics.hpp"

#include <limits>

#include "../math/settings.hpp"

namespace sidestep {

ArmDynamics::ArmDynamics(const std::optional<RigidBodyDynamics>& model, const Robot& robot, const ControllerSettings& settings,
                         bool torque)
    : robot_(robot),
      mass_(Eigen::MatrixXd::Constant(robot.num_coordinates(), robot.num_coordinates(),
                                      std::numeric_limits<double>::quiet_NaN())),
      model_mass_(Eigen::MatrixXd::Zero(mass_.rows(), mass_.cols())),
      bias_(Eigen::VectorXd::Zero(mass_.rows())),
      model_bias_(bias_),
      gravity_(bias_),
      gravity_change_(bias_),
      last_v_(bias_),
      state_(robot) {
  if (!torque) {
    return;
  }
  if (settings.tracking.observer_time < infinity) {
    observer_.emplace(robot.limits(), settings.tracking.observer_time, settings.tracking.observer_share);
  }
  if (model) {
    model_ = model;
    workspace_.emplace(*model_);
  }
}

void ArmDynamics::observe(bool begins, const Eigen::VectorXd& v, const LastOutput& last, const Tick& tick) noexcept {
  if (begins || tick.gap) {
    last_v_ = v;
  } else if (observer_) {
    observer_->update({last_v_, v, last.torque, last.acceleration, tick.elapsed}, model_mass_, model_bias_);
    last_v_ = v;
  }
}

void ArmDynamics::hold(const Eigen::VectorXd& load) noexcept {
  if (observer_) {
    observer_->set_disturbance(load);
  }
}

void ArmDynamics::update(const KinematicState& state, const ToldDynamics& told) noexcept {
  // Without inertias of its own, an arm has to be told them in every step.
  if (told.mass_matrix != nullptr) {
    const bool fits = told.mass_matrix->rows() == mass_.rows() && told.mass_matrix->cols() == mass_.cols() &&
                      told.bias->size() == bias_.size();
    if (fits) {
      mass_ = *told.mass_matrix;
      bias_ = *told.bias;
    } else {
      mass_.setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  } else if (model_) {
    model_->mass_matrix(state, *workspace_, mass_);
    model_->bias(state, *workspace_, bias_);
  } else {
    mass_.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  model_mass_ = mass_;
  model_bias_ = bias_;
  if (observer_) {
    mass_.diagonal() += observer_->rotors();
    bias_ -= observer_->disturbance();
  }
}

void ArmDynamics::update_gravity(const KinematicState& state, bool first) noexcept {
  model_->gravity(state, *workspace_, gravity_change_);
  gravity_change_.swap(gravity_);
  gravity_change_ = gravity_ - gravity_change_;
  if (first) {
    gravity_change_.setZero();
  }
}

void ArmDynamics::write_bias(const Eigen::VectorXd& q, const Eigen::VectorXd& v, Eigen::VectorXd& bias) noexcept {
  model_->bias(q, v, *workspace_, bias);
}

void ArmDynamics::go_on_from(const ArmDynamics& before) noexcept {
  observer_ = before.observer_;
  mass_ = before.mass_;
  model_mass_ = before.model_mass_;
  bias_ = before.bias_;
  model_bias_ = before.model_bias_;
  gravity_ = before.gravity_;
  gravity_change_ = before.gravity_change_;
  last_v_ = before.last_v_;
}

void ArmDynamics::change_weight(const Eigen::VectorXd& q, const Eigen::VectorXd& v) noexcept {
  state_.update(robot_, q, v);
  gravity_change_ = gravity_;
  model_->gravity(state_, *workspace_, gravity_);
  gravity_change_ = gravity_ - gravity_change_;
  if (observer_) {
    observer_->change_model(gravity_change_);
  }
}

}  // namespace sidestep

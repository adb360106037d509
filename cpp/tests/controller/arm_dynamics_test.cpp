// M q̈ + h = τ + d, alone: by the model, as told, and with the disturbance that is observed.
#include <boost/test/unit_test.hpp>
#include <cmath>

#include "../../src/controller/arm_dynamics.hpp"
#include "support/numbers.hpp"
#include "support/stage_model.hpp"

using namespace sidestep;
using Output = ControllerSettings::Output;

namespace {

/// The stage with an arm of two joints that is moved by torque.
struct Weighing {
  explicit Weighing(ControllerSettings s = test::straight_settings(Output::torque))
      : model(test::stage_model(2, std::move(s))),
        dynamics(model.dynamics, model.arm.robot(), model.settings, true),
        modelled(model.arm.dynamics()),
        workspace(modelled) {}
  Eigen::MatrixXd mass_at(const KinematicState& state) {
    Eigen::MatrixXd M(2, 2);
    modelled.mass_matrix(state, workspace, M);
    return M;
  }
  Eigen::VectorXd bias_at(const KinematicState& state) {
    Eigen::VectorXd h(2);
    modelled.bias(state, workspace, h);
    return h;
  }
  Eigen::VectorXd gravity_at(const KinematicState& state) {
    Eigen::VectorXd g(2);
    modelled.gravity(state, workspace, g);
    return g;
  }

  const ControllerModel model;
  ArmDynamics dynamics;
  const RigidBodyDynamics modelled;
  RigidBodyDynamics::Workspace workspace;
  const KinematicState leaning = test::state_at(model.arm.robot(), Eigen::Vector2d(0.2, 0.7));
};

}  // namespace

BOOST_AUTO_TEST_CASE(mass_and_bias_are_those_of_the_model_unless_they_are_told) {
  Weighing w;
  w.dynamics.update(w.leaning, {});
  BOOST_TEST((w.dynamics.mass() == w.mass_at(w.leaning)));
  BOOST_TEST((w.dynamics.bias() == w.bias_at(w.leaning)));
  const Eigen::MatrixXd mass = Eigen::Vector2d(2.0, 3.0).asDiagonal();
  const Eigen::VectorXd bias = Eigen::Vector2d(-1.0, 1.0);
  const Eigen::Ref<const Eigen::MatrixXd> told_mass(mass);
  const Eigen::Ref<const Eigen::VectorXd> told_bias(bias);
  w.dynamics.update(w.leaning, {&told_mass, &told_bias});
  BOOST_TEST((w.dynamics.mass() == mass));
  BOOST_TEST((w.dynamics.bias() == bias));
  const Eigen::MatrixXd wrong = Eigen::MatrixXd::Identity(3, 3);
  const Eigen::Ref<const Eigen::MatrixXd> told_wrong(wrong);
  w.dynamics.update(w.leaning, {&told_wrong, &told_bias});
  BOOST_TEST(std::isnan(w.dynamics.mass()(0, 0)));  // the program calls that unusable
}

BOOST_AUTO_TEST_CASE(without_a_model_and_without_being_told_there_is_no_mass) {
  Weighing w;
  ArmDynamics dynamics(std::nullopt, w.model.arm.robot(), w.model.settings, true);
  BOOST_TEST(!dynamics.has_model());
  dynamics.update(w.leaning, {});
  BOOST_TEST(dynamics.mass().array().isNaN().all());
}

BOOST_AUTO_TEST_CASE(gravity_changes_from_one_state_to_the_next_and_not_at_the_first) {
  Weighing w;
  const KinematicState upright = test::state_at(w.model.arm.robot(), Eigen::Vector2d::Zero());
  w.dynamics.update_gravity(w.leaning, true);
  BOOST_TEST((w.dynamics.gravity() == w.gravity_at(w.leaning)));
  BOOST_TEST(w.dynamics.gravity_change().isZero(0.0));
  w.dynamics.update_gravity(upright, false);
  // 0.3 kg, 0.15 m from the joint, no longer tilted by 0.7 rad.
  BOOST_TEST(std::abs(std::abs(w.dynamics.gravity_change()[1]) - 0.3 * 9.81 * 0.15 * std::sin(0.7)) < 1e-14);  // rounding
  Eigen::VectorXd bias(2);
  w.dynamics.write_bias(Eigen::Vector2d(0.2, 0.7), Eigen::Vector2d::Zero(), bias);
  BOOST_TEST((bias - w.gravity_at(w.leaning)).norm() < 1e-14);  // at rest it is gravity
}

BOOST_AUTO_TEST_CASE(a_constant_disturbance_is_observed_with_its_time_constant_and_taken_from_the_bias) {
  Weighing w;
  const double period = w.model.settings.period, time = w.model.settings.tracking.observer_time;
  const Eigen::VectorXd d = Eigen::Vector2d(0.5, -0.3);
  Eigen::VectorXd v = Eigen::VectorXd::Zero(2);
  LastOutput last(2);
  last.has_torque = true;
  w.dynamics.update(w.leaning, {});
  const Eigen::MatrixXd mass = w.mass_at(w.leaning);
  const Eigen::VectorXd bias = w.bias_at(w.leaning);
  w.dynamics.observe(true, v, last, Tick::regular(0.001));
  for (int k = 0; k < 50; ++k) {  // one time constant; what is observed holds the arm, what is not yet moves it
    last.torque = w.dynamics.bias();
    last.acceleration.setZero();
    v += period * mass.inverse() * (last.torque + d - bias);
    w.dynamics.observe(false, v, last, Tick::regular(0.001));
    w.dynamics.update(w.leaning, {});
  }
  const double share = 1.0 - std::pow(1.0 - period / time, 50);  // 64 %
  // To 1 %: a discrete filter of first order or its exponential.
  BOOST_TEST((w.dynamics.bias() - (bias - share * d)).norm() < 0.01 * d.norm());
}

BOOST_AUTO_TEST_CASE(without_an_observer_nothing_is_taken_from_the_bias) {
  ControllerSettings settings = test::straight_settings(Output::torque);
  settings.tracking.observer_time = test::infinity;
  Weighing w(settings);
  BOOST_TEST(!w.dynamics.observer().has_value());
  LastOutput last(2);
  w.dynamics.observe(true, Eigen::Vector2d::Zero(), last, Tick::regular(0.001));
  w.dynamics.observe(false, Eigen::Vector2d(0.1, 0.1), last, Tick::regular(0.001));
  w.dynamics.update(w.leaning, {});
  BOOST_TEST((w.dynamics.bias() == w.bias_at(w.leaning)));
}

BOOST_AUTO_TEST_CASE(what_is_held_takes_the_place_of_what_was_observed_within_its_bound) {
  Weighing w;
  const Eigen::VectorXd bound = w.model.settings.tracking.observer_share * w.model.arm.robot().limits().effort;
  w.dynamics.hold(Eigen::Vector2d(0.5, -1e6));
  w.dynamics.update(w.leaning, {});
  const Eigen::VectorXd held = Eigen::Vector2d(0.5, -bound[1]);
  BOOST_TEST((w.dynamics.bias() - (w.bias_at(w.leaning) - held)).norm() < 1e-9 * bound.norm());  // rounding
  BOOST_TEST((w.dynamics.model_bias() == w.bias_at(w.leaning)));
}

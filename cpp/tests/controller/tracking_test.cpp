// The reference that a controller integrates, what it sends, and an arm that is not as its model.
#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <numbers>

#include "sidestep/controller/controller.hpp"
#include "support/covered_arm.hpp"
#include "support/numbers.hpp"
#include "support/random.hpp"
#include "support/repeatable_settings.hpp"

using namespace sidestep;
using test::covered_arm;
using test::nv;
using test::repeatable_settings;

namespace {

const Eigen::VectorXd from = (Eigen::VectorXd(nv) << -0.5, 0.9, 0.0, 0.6, 0.0, 0.3, 0.0).finished();
const Eigen::VectorXd to = (Eigen::VectorXd(nv) << 0.4, 0.5, 0.3, 0.9, -0.2, 0.6, 0.4).finished();

JointLimits limits_with_rates() {
  JointLimits limits = test::arm_limits(nv);
  limits.jerk.setConstant(1000.0);
  limits.effort_rate.setConstant(1000.0);
  return limits;
}

}  // namespace

BOOST_AUTO_TEST_CASE(positions_and_velocities_integrate_the_acceleration_whatever_the_drives_do) {
  for (const double lag : {0.0, 0.02}) {
    Controller controller(covered_arm(limits_with_rates()), repeatable_settings(ControllerSettings::Output::position));
    controller.set_obstacles(Obstacles::none());
    controller.set_goal(to);
    const double period = controller.settings().period;
    Eigen::VectorXd q = from, v = Eigen::VectorXd::Zero(nv), position = q, velocity = v;
    for (int k = 0; k < 4000; ++k) {
      const Command& command = controller.step(q, v);
      BOOST_REQUIRE((command.velocity - velocity - period * command.acceleration).cwiseAbs().maxCoeff() < 1e-14);  // rounding
      BOOST_REQUIRE((command.position - position - period * command.velocity).cwiseAbs().maxCoeff() < 1e-14);
      position = command.position;
      velocity = command.velocity;
      const Eigen::VectorXd before = q;
      q += period / (period + lag) * (position - q);  // a drive of first order
      v = (q - before) / period;
    }
    BOOST_TEST((q - to).cwiseAbs().maxCoeff() < controller.settings().arrival.joint);
    BOOST_TEST((controller.command().activity == Activity::arrived));
  }
}

BOOST_AUTO_TEST_CASE(velocities_lead_the_arm_back_to_the_reference) {
  Controller controller(covered_arm(limits_with_rates()), repeatable_settings(ControllerSettings::Output::velocity));
  controller.set_obstacles(Obstacles::none());
  Eigen::VectorXd q = from;
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(nv);
  BOOST_TEST(controller.step(q, rest).velocity.norm() == 0.0);
  for (int k = 0; k < 2000; ++k) {  // it drifts, and stays there for many times the filter's 50 ms
    q[2] += k < 50 ? 0.001 : 0.0;
    controller.step(q, rest);
  }
  const Command& command = controller.command();
  BOOST_TEST((command.position - from).norm() < 1e-12);
  BOOST_TEST((command.velocity + controller.settings().tracking.drift_gain * 0.05 * Eigen::VectorXd::Unit(nv, 2)).norm() <
             1e-9);
  BOOST_TEST(std::abs(command.tracking_error - 0.05) < 1e-12);
}

BOOST_AUTO_TEST_CASE(an_arm_that_is_flung_at_a_position_limit_is_commanded_to_stay_within_it) {
  // 0.1 rad before it at 2 rad/s, 10 rad/s² would need 0.2 rad. What is commanded begins slower, and feedback brakes the arm.
  for (const auto output : {ControllerSettings::Output::torque, ControllerSettings::Output::acceleration}) {
    const JointLimits limits = limits_with_rates();
    Controller controller(covered_arm(limits), repeatable_settings(output));
    controller.set_obstacles(Obstacles::none());
    const double period = controller.settings().period;
    Eigen::VectorXd q = from, v = Eigen::VectorXd::Zero(nv);
    q[6] = limits.upper[6] - 0.1;
    v[6] = 2.0;
    double farthest = 0.0;
    for (int k = 0; k < 500; ++k) {
      const Command& command = controller.step(q, v);
      BOOST_REQUIRE((command.position.array() <= limits.upper.array()).all());
      BOOST_REQUIRE((command.velocity.cwiseAbs().array() <= limits.velocity.array()).all());
      v += period * command.acceleration;
      q += period * v;
      farthest = std::max(farthest, q[6]);
    }
    // Feedback by torque may exceed the acceleration limit; without torque no arm brakes in less than v²/2A = 0.204 rad.
    BOOST_TEST(farthest < limits.upper[6] + (output == ControllerSettings::Output::torque ? 0.01 : 0.105));
  }
}

BOOST_AUTO_TEST_CASE(jerk_and_torque_rate_keep_their_limits_at_every_sample) {
  JointLimits limits = limits_with_rates();
  limits.jerk.setConstant(200.0);
  const Arm arm = covered_arm(limits);
  Controller controller(arm, repeatable_settings(ControllerSettings::Output::torque));
  controller.set_obstacles(Obstacles::none());
  const double period = controller.settings().period;
  Eigen::VectorXd q = from, v = Eigen::VectorXd::Zero(nv), a = v, held(nv);
  const RigidBodyDynamics dynamics(arm.dynamics());
  RigidBodyDynamics::Workspace workspace(dynamics);
  dynamics.bias(q, v, workspace, held);  // what holds it until now
  Eigen::VectorXd torque = held;
  double most_jerk = 0.0, most_rate = 0.0;
  for (int k = 0; k < 4000; ++k) {
    if (k % 700 == 0) {  // turns round on its way
      controller.set_goal(k % 1400 == 0 ? to : from);
    }
    const Command& command = controller.step(q, v);
    BOOST_REQUIRE(command.status <= SafetyStatus::limited);
    most_jerk = std::max(most_jerk, (command.acceleration - a).cwiseAbs().cwiseQuotient(period * limits.jerk).maxCoeff());
    most_rate = std::max(most_rate, (command.torque - torque).cwiseAbs().cwiseQuotient(period * limits.effort_rate).maxCoeff());
    a = command.acceleration;
    torque = command.torque;
    v += period * a;
    q += period * v;
  }
  BOOST_TEST(most_jerk < 1.0 + 1e-6);
  BOOST_TEST(most_rate < 1.0 + 1e-6);
  BOOST_TEST(std::max(most_jerk, most_rate) > 0.7);  // they are what holds it back
}

BOOST_AUTO_TEST_CASE(an_arm_with_a_payload_arrives_and_the_payload_is_found) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  Controller controller(arm, repeatable_settings(ControllerSettings::Output::torque));
  controller.set_obstacles(Obstacles::none());
  controller.set_goal(to);
  const double period = controller.settings().period;
  const RigidBodyDynamics model(arm.dynamics());
  auto inertials = arm.inertials();
  inertials.back() = {0.5, {0.0, 0.0, 0.2}, Eigen::Vector3d(6e-3, 6e-3, 1e-3).asDiagonal()};  // 0.3 kg and 0.2 kg in its hand
  const RigidBodyDynamics real(arm.robot(), inertials);
  RigidBodyDynamics::Workspace of_model(model), of_real(real);
  Eigen::MatrixXd mass(nv, nv);
  Eigen::VectorXd bias(nv), held(nv), q = from, v = Eigen::VectorXd::Zero(nv);
  double worst = 0.0;
  for (int k = 0; k < 6000; ++k) {
    const Command& command = controller.step(q, v);
    worst = std::max(worst, command.tracking_error);
    real.mass_matrix(q, of_real, mass);
    real.bias(q, v, of_real, bias);
    v += period * mass.ldlt().solve(command.torque - bias);
    q += period * v;
  }
  const Command& command = controller.command();
  BOOST_TEST((command.activity == Activity::arrived));
  BOOST_TEST((q - to).cwiseAbs().maxCoeff() < 1e-3);
  BOOST_TEST(worst < 0.05);  // [rad] on the way, of the first moment without its weight
  real.bias(q, v, of_real, bias);
  model.bias(q, v, of_model, held);
  BOOST_TEST((command.observed.disturbance - (held - bias)).cwiseAbs().maxCoeff() < 0.02);  // [Nm] of some 5
  KinematicState state(arm.robot());
  state.update(arm.robot(), q, v);
  Eigen::VectorXd gravity(nv);
  model.gravity(state, of_model, gravity);
  BOOST_TEST((command.torque - command.torque_without_gravity - gravity).cwiseAbs().maxCoeff() < 0.01);
}

BOOST_AUTO_TEST_CASE(where_the_torque_cannot_hold_the_arm_it_does_not_go) {
  // Stretched out level, gravity takes 1.1 times what the second joint has; folded or upright much less.
  JointLimits limits = test::arm_limits(nv);
  const Arm strong = covered_arm(limits);
  const RigidBodyDynamics of_strong(strong.dynamics());
  RigidBodyDynamics::Workspace w(of_strong);
  Eigen::VectorXd level = Eigen::VectorXd::Zero(nv), bias(nv);
  level[1] = 0.5 * std::numbers::pi;
  of_strong.bias(level, Eigen::VectorXd::Zero(nv), w, bias);
  limits.effort[1] = std::abs(bias[1]) / 1.1;
  const Arm arm = covered_arm(limits);
  Controller controller(arm, repeatable_settings(ControllerSettings::Output::torque));
  controller.set_obstacles(Obstacles::none());
  const double period = controller.settings().period, allowed = 1.0 - controller.settings().effort_margin;
  const RigidBodyDynamics model(arm.dynamics());
  RigidBodyDynamics::Workspace of_model(model);
  Eigen::MatrixXd mass(nv, nv);
  Eigen::VectorXd q = Eigen::VectorXd::Zero(nv), v = q, gravity(nv);
  const Eigen::VectorXd rest = v;
  q[3] = 0.3;
  const auto run = [&](const Eigen::VectorXd& goal, int steps) {
    controller.set_goal(goal);
    double most = 0.0;
    for (int k = 0; k < steps; ++k) {
      const Command& command = controller.step(q, v);
      BOOST_REQUIRE(command.status <= SafetyStatus::relaxed);
      model.mass_matrix(q, of_model, mass);
      model.bias(q, v, of_model, bias);
      v += period * mass.ldlt().solve(command.torque - bias);
      q += period * v;
      model.bias(q, rest, of_model, gravity);
      most = std::max(most, std::abs(gravity[1]) / limits.effort[1]);
    }
    return most;
  };
  BOOST_TEST(run(level, 6000) < allowed);
  BOOST_TEST((controller.command().activity == Activity::blocked));
  BOOST_TEST(controller.explain().find(
                 "joint 'joint2' cannot hold the arm against gravity within its effort limit; set another goal") !=
             std::string::npos);
  BOOST_TEST(q[1] > 0.5);  // as near as it can be held

  Eigen::VectorXd beyond = Eigen::VectorXd::Zero(nv);  // straight there the arm would pass where it cannot be held
  beyond[1] = 2.3;
  beyond[3] = -0.6;
  BOOST_TEST(run(beyond, 6000) < allowed);
  BOOST_TEST((controller.command().activity == Activity::arrived));
}

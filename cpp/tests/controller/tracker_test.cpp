// Feedback that makes the arm follow its reference, alone.
#include <boost/test/unit_test.hpp>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "../../src/controller/tracker.hpp"
#include "support/numbers.hpp"
#include "support/stage_model.hpp"

using namespace sidestep;
using Output = ControllerSettings::Output;

namespace {

constexpr double tracked = 1e-9;  // accuracy of what the program solves exactly
const SpeedLimitNow any_speed;    // no speed limit

/// The stage with an arm of two joints: 10 rad/s² and 1000 rad/s³ less 2 %.
struct Tracking {
  explicit Tracking(Output output, double effort_rate = test::infinity)
      : model(arm(effort_rate), test::straight_settings(output)),
        dynamics(model.dynamics, model.arm.robot(), model.settings, model.torque),
        tracker(model.arm.robot(), model.joints, model.settings, model.torque) {
    dynamics.update(test::state_at(model.arm.robot(), q), {});
  }
  static Arm arm(double effort_rate) {
    JointLimits limits = test::arm_limits(2);
    limits.jerk.setConstant(1000.0);
    limits.effort_rate.setConstant(effort_rate);
    return test::covered_arm(limits);
  }
  ProgramStatus track(const Reference& reference, ProgramStatus decided = ProgramStatus::ok) {
    const double error = (reference.q - q).cwiseAbs().maxCoeff();
    return tracker.track(reference, {q, v, seen, dynamics, last, any_speed}, error, decided, tick);
  }

  const ControllerModel model;
  ArmDynamics dynamics;
  Tracker tracker;
  Eigen::VectorXd q = Eigen::Vector2d(0.2, 0.7), v = Eigen::Vector2d(0.1, -0.1);
  const Clearances seen{2, model.system->num_embedding_coordinates()};
  LastOutput last{2};
  const Tick tick = Tick::regular(model.settings.period);
};

}  // namespace

BOOST_AUTO_TEST_CASE(feedback_is_a_damped_spring_around_the_reference) {
  Tracking t(Output::acceleration);
  Reference reference = test::reference_at(t.q + Eigen::Vector2d(0.001, -0.0005), t.v + Eigen::Vector2d(0.01, 0.02));
  reference.a = Eigen::Vector2d(0.5, -1.0);
  const double w = t.model.settings.tracking.frequency;
  const Eigen::VectorXd expected =  // 5.3 and −0.4 rad/s²
      reference.a + w * w * (reference.q - t.q) + 2.0 * t.model.settings.tracking.damping * w * (reference.v - t.v);
  t.last.acceleration = expected;  // jerk is in no way
  BOOST_TEST((t.track(reference) == ProgramStatus::ok));
  BOOST_TEST((t.tracker.solution().acceleration - expected).norm() < tracked);
  t.last.acceleration.setZero();
  static_cast<void>(t.track(reference));
  BOOST_TEST((t.tracker.solution().acceleration - Eigen::Vector2d(0.98, expected[1])).norm() < tracked);  // jerk
  BOOST_TEST((t.track(reference, ProgramStatus::relaxed) == ProgramStatus::relaxed));  // what was decided stays
}

BOOST_AUTO_TEST_CASE(an_arm_that_cannot_follow_draws_the_reference_to_itself_beyond_what_is_free) {
  Tracking t(Output::acceleration), drives(Output::position);
  const Reference reference = test::reference_at(Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d::Zero());
  Eigen::VectorXd coupling(2);
  // A fifth of the largest error of 0.2 rad is free.
  t.tracker.write_coupling(reference, Eigen::Vector2d(0.05, -0.039), t.tick, coupling);
  BOOST_TEST((coupling - Eigen::Vector2d(3600.0 * 0.01, 0.0)).norm() < 1e-11);  // rounding of 60² times 1e-15
  t.tracker.write_coupling(reference, Eigen::Vector2d(-0.06, 0.0), t.tick, coupling);
  BOOST_TEST((coupling - Eigen::Vector2d(-3600.0 * 0.02, 0.0)).norm() < 1e-11);
  drives.tracker.write_coupling(reference, Eigen::Vector2d(0.5, 0.5), t.tick, coupling);
  BOOST_TEST(coupling.isZero(0.0));  // its drives track the reference
}

BOOST_AUTO_TEST_CASE(a_torque_from_elsewhere_keeps_its_rate_and_the_acceleration_says_what_it_does) {
  Tracking t(Output::torque, 1000.0);  // 1 Nm in a period
  t.last.torque = Eigen::Vector2d(5.0, 5.0);
  Eigen::VectorXd torque = Eigen::Vector2d(8.0, 4.5);
  BOOST_TEST(!t.tracker.keep_torque_rate(t.last, t.dynamics, t.tick, torque));  // there was none before
  t.last.has_torque = true;
  t.tracker.solution().acceleration = Eigen::Vector2d(1.0, 2.0);
  BOOST_TEST(t.tracker.keep_torque_rate(t.last, t.dynamics, t.tick, torque));
  BOOST_TEST((torque == Eigen::Vector2d(6.0, 4.5)));
  const Eigen::VectorXd change = t.dynamics.mass().inverse() * Eigen::Vector2d(-2.0, 0.0);
  const Eigen::VectorXd expected = Eigen::Vector2d(1.0, 2.0) + change;
  BOOST_TEST((t.tracker.solution().acceleration - expected).norm() <
             1e-9 * change.norm());  // of a mass matrix of condition 100
  BOOST_TEST(!t.tracker.keep_torque_rate(t.last, t.dynamics, t.tick, torque));
}

BOOST_AUTO_TEST_CASE(a_torque_changes_by_the_rate_of_a_period_however_late_the_step_is) {
  Tracking t(Output::torque, 1000.0);
  t.last.torque = Eigen::Vector2d(5.0, 5.0);
  t.last.has_torque = true;
  Tick tick = t.tick;
  for (const double elapsed : {0.004, 0.001, 0.0005}) {
    tick.elapsed = tick.period = elapsed;
    Eigen::VectorXd torque = Eigen::Vector2d(80.0, 5.0);
    BOOST_TEST(t.tracker.keep_torque_rate(t.last, t.dynamics, tick, torque));
    BOOST_TEST(std::abs(torque[0] - 5.0 - 1000.0 * std::min(elapsed, 0.001)) < 1e-12);
  }
}

BOOST_AUTO_TEST_CASE(a_velocity_leads_a_drifting_arm_back_no_faster_than_its_limits_allow) {
  Tracking t(Output::velocity);
  Reference reference = test::reference_at(Eigen::Vector2d(0.1, 0.1), Eigen::Vector2d(0.5, 0.0));
  Eigen::VectorXd velocity(2);
  t.tracker.write_velocity(reference, Eigen::Vector2d(0.099, 0.1), true, t.tick, velocity);
  BOOST_TEST((velocity - Eigen::Vector2d(0.50004, 0.0)).norm() < 1e-15);  // gain 2/s times 1 mrad, 1 ms of 50; rounding
  t.tracker.write_velocity(reference, Eigen::Vector2d(-10.0, 0.1), true, t.tick, velocity);
  BOOST_TEST((velocity - Eigen::Vector2d(0.51004, 0.0)).norm() < 1e-15);  // 10 rad/s² for 1 ms more than the last
  t.tracker.write_velocity(reference, Eigen::Vector2d(0.0, 0.1), false, t.tick, velocity);
  BOOST_TEST((velocity - Eigen::Vector2d(0.5 + 0.98 * 0.01004, 0.0)).norm() < 1e-15);  // where the arm is, nobody knows: back
  t.tracker.begin_anew();
  reference = test::reference_at(Eigen::Vector2d(0.1, 0.1), Eigen::Vector2d(2.5, 0.0));
  t.tracker.write_velocity(reference, Eigen::Vector2d(0.0, 0.1), true, t.tick, velocity);
  BOOST_TEST(velocity[0] == 2.5);  // the limit
}

BOOST_AUTO_TEST_CASE(an_impedance_is_a_spring_of_torque_for_arms_that_are_moved_by_it) {
  ControllerSettings settings = test::straight_settings(Output::torque);
  settings.tracking.stiffness = 0.5;
  const ControllerModel model = test::stage_model(2, settings);
  ArmDynamics dynamics(model.dynamics, model.arm.robot(), model.settings, true);
  Tracker tracker(model.arm.robot(), model.joints, model.settings, true);
  const Eigen::VectorXd q = Eigen::Vector2d(0.2, 0.7), rest = Eigen::Vector2d::Zero();
  dynamics.update(test::state_at(model.arm.robot(), q), {});
  const Eigen::VectorXd error = Eigen::Vector2d(0.001, -0.002);
  const Reference reference = test::reference_at(q + error, rest);
  const Clearances seen(2, model.system->num_embedding_coordinates());
  const LastOutput last(2);
  static_cast<void>(
      tracker.track(reference, {q, rest, seen, dynamics, last, any_speed}, 0.002, ProgramStatus::ok, Tick::regular(0.001)));
  // At rest K e + h is sent, K half of the effort limits per rad. The price of torque takes 1e-8 rad/s² of tracking at 1 kg m².
  const Eigen::VectorXd sent = 0.5 * model.arm.robot().limits().effort.cwiseProduct(error) + dynamics.bias();
  BOOST_TEST((tracker.solution().torque - sent).norm() < 1e-6);
  ControllerSettings position = test::straight_settings(Output::position);
  position.tracking.stiffness = 0.5;
  BOOST_CHECK_THROW(Tracker(model.arm.robot(), model.joints, position, false), std::invalid_argument);
}

BOOST_AUTO_TEST_CASE(a_reference_yields_to_where_feedback_pushes_by_a_torque_at_most) {
  Tracking t(Output::torque);
  const Eigen::VectorXd most = Eigen::Vector2d(0.5, 0.2);
  const double w = t.model.settings.tracking.frequency;
  const auto pushes = [&](const Reference& r) { return Eigen::VectorXd(w * w * t.dynamics.mass() * (r.q - t.q)); };
  Reference near = test::reference_at(t.q + Eigen::Vector2d(1e-4, -1e-4), t.v), before = near;
  BOOST_TEST((pushes(near).cwiseAbs().array() < most.array()).all());
  BOOST_TEST(!t.tracker.yield(t.q, t.dynamics.mass(), most, t.tick, near));
  BOOST_TEST((near.q == before.q));
  Reference far = test::reference_at(t.q + Eigen::Vector2d(0.3, -0.1), t.v);
  BOOST_TEST(pushes(far)[0] > 10.0 * most[0]);
  for (int k = 0; k < 100; ++k) {  // joints have inertia in common: one after the other, again in every step
    static_cast<void>(t.tracker.yield(t.q, t.dynamics.mass(), most, t.tick, far));
  }
  BOOST_TEST((pushes(far).cwiseAbs().array() < 1.01 * most.array()).all());
}

BOOST_AUTO_TEST_CASE(a_reference_yields_no_farther_than_to_its_position_limits) {
  Tracking t(Output::torque);
  const Eigen::VectorXd none = Eigen::Vector2d::Zero();
  t.q = Eigen::Vector2d(2.7, 0.7);  // pushed 0.2 rad beyond the limit of 2.5 rad
  t.dynamics.update(test::state_at(t.model.arm.robot(), t.q), {});
  Reference inside = test::reference_at(Eigen::Vector2d(2.4, 0.7), none), outside = inside;
  outside.q[0] = 2.6;
  for (int k = 0; k < 100; ++k) {
    static_cast<void>(t.tracker.yield(t.q, t.dynamics.mass(), none, t.tick, inside));
    static_cast<void>(t.tracker.yield(t.q, t.dynamics.mass(), none, t.tick, outside));
  }
  BOOST_TEST(inside.q[0] == 2.5);
  BOOST_TEST(outside.q[0] <= 2.6);
}

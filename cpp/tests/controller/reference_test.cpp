// The motion that is integrated, alone.
#include <boost/test/unit_test.hpp>

#include "../../src/controller/reference.hpp"
#include "support/numbers.hpp"
#include "support/stage_model.hpp"

using namespace sidestep;

namespace {

constexpr double reference_period = 0.002;  // [s]
const Eigen::Vector2d reference_jerk(100.0, 100.0);

}  // namespace

BOOST_AUTO_TEST_CASE(a_reference_integrates_velocity_first_and_then_position) {
  Reference reference(2);
  reference.q = Eigen::Vector2d(0.1, -0.2);
  reference.v = Eigen::Vector2d(0.5, 1.0);
  reference.advance(Eigen::Vector2d(10.0, -5.0), false, reference_jerk, reference_period);
  const Eigen::Vector2d v(0.52, 0.99), q(0.10104, -0.19802);         // v + T a, q + T v⁺
  BOOST_TEST((reference.next_v - v).cwiseAbs().maxCoeff() < 1e-15);  // rounding of numbers below 1
  BOOST_TEST((reference.next_q - q).cwiseAbs().maxCoeff() < 1e-15);
  BOOST_TEST((reference.q == Eigen::Vector2d(0.1, -0.2)));  // this period's
  reference.go_on();
  BOOST_TEST((reference.q == reference.next_q));
  BOOST_TEST((reference.v == reference.next_v));
}

BOOST_AUTO_TEST_CASE(what_was_commanded_is_held_until_the_next_step_comes) {
  using Output = ControllerSettings::Output;
  Reference on_time(2);
  on_time.q = Eigen::Vector2d(0.1, -0.2);
  on_time.v = Eigen::Vector2d(0.5, 1.0);
  on_time.advance(Eigen::Vector2d(10.0, -5.0), false, reference_jerk, reference_period);
  Tick tick = Tick::regular(reference_period);
  const auto held = [&](Output output) {
    Reference reference = on_time;
    reference.hold(output, tick);
    return reference;
  };
  BOOST_TEST((held(Output::acceleration).next_q == on_time.next_q));
  tick.held = 2.0 * reference_period;  // as two steps with the same acceleration
  Reference twice = on_time;
  twice.go_on();
  twice.advance(on_time.a, false, reference_jerk, reference_period);
  for (const Output output : {Output::acceleration, Output::torque}) {
    BOOST_TEST((held(output).next_v - twice.next_v).norm() < 1e-15);
    BOOST_TEST((held(output).next_q - twice.next_q).norm() < 1e-15);
  }
  const Reference by_velocity = held(Output::velocity), by_position = held(Output::position);
  BOOST_TEST((by_velocity.next_v == on_time.next_v));
  BOOST_TEST((by_velocity.next_q - (on_time.next_q + reference_period * on_time.next_v)).norm() < 1e-15);
  BOOST_TEST((by_position.next_q == on_time.next_q));
}

BOOST_AUTO_TEST_CASE(an_acceleration_that_is_not_finite_leaves_the_one_before) {
  Reference reference(2);
  reference.advance(Eigen::Vector2d(1.0, 2.0), false, reference_jerk, reference_period);
  reference.go_on();
  reference.advance(Eigen::Vector2d(test::not_a_number, 0.0), false, reference_jerk, reference_period);
  BOOST_TEST((reference.a == Eigen::Vector2d(1.0, 2.0)));
  BOOST_TEST((reference.next_v - Eigen::Vector2d(0.004, 0.008)).cwiseAbs().maxCoeff() < 1e-17);  // rounding
}

BOOST_AUTO_TEST_CASE(a_rise_beyond_jerk_leaves_what_jerk_goes_on_from_within_it) {
  Reference reference(2);
  reference.advance(Eigen::Vector2d(50.0, -0.1), true, reference_jerk, reference_period);
  BOOST_TEST((reference.a == Eigen::Vector2d(50.0, -0.1)));
  BOOST_TEST((reference.smooth_a == Eigen::Vector2d(0.2, -0.1)));  // by J T at most
  reference.advance(Eigen::Vector2d(50.0, -0.1), false, reference_jerk, reference_period);
  BOOST_TEST((reference.smooth_a == reference.a));
}

BOOST_AUTO_TEST_CASE(a_motion_that_begins_takes_small_velocities_for_rest_and_drives_on_the_way_back_stop) {
  Reference reference(2);
  reference.a.setConstant(3.0);
  reference.smooth_a.setConstant(3.0);
  reference.next_q = Eigen::Vector2d(0.5, 0.5);
  const Eigen::Vector2d at(0.2, 0.8), velocity(0.4, 0.09);  // the first on its way to the old command, the second jitters
  reference.begin(at, velocity, false);
  BOOST_TEST((reference.next_q == at));
  BOOST_TEST((reference.next_v == Eigen::Vector2d(0.4, 0.0)));
  BOOST_TEST(reference.a.isZero(0.0));
  BOOST_TEST(reference.smooth_a.isZero(0.0));
  reference.next_q = Eigen::Vector2d(0.5, 0.5);
  reference.begin(at, Eigen::Vector2d(0.4, 0.4), true);
  BOOST_TEST((reference.next_v == Eigen::Vector2d(0.0, 0.4)));  // the second joint moves away from the old command
}

BOOST_AUTO_TEST_CASE(what_begins_too_fast_to_brake_begins_as_fast_as_can_be_braked) {
  JointLimits limits = test::arm_limits(2);  // 2.5 rad, 2.5 rad/s, 10 rad/s²
  ControllerSettings settings;
  settings.limit_margin = 0.0;
  settings.position_margin = 0.1;
  Reference reference = test::reference_at(Eigen::Vector2d(2.35, -1.0), Eigen::Vector2d(5.0, -4.0));
  reference.keep_viable(limits, settings, reference_period);
  BOOST_TEST((reference.q == Eigen::Vector2d(2.35, -1.0)));
  BOOST_TEST((reference.v - Eigen::Vector2d(1.0, -2.5)).norm() < 1e-12);  // v²/2A = 50 mrad; the velocity limit
  const Eigen::Vector2d slow(0.9, 2.4);
  reference.v = slow;
  reference.keep_viable(limits, settings, reference_period);
  BOOST_TEST((reference.v == slow));
}

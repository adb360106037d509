// The state of the arm, as far as its measurement can be believed: alone, sample by sample.
#include <boost/test/unit_test.hpp>
#include <numbers>

#include "../../src/controller/measured_state.hpp"
#include "support/numbers.hpp"
#include "support/repeatable_settings.hpp"
#include "support/serial_arm.hpp"

using namespace sidestep;
using Output = ControllerSettings::Output;

namespace {

constexpr double measured_period = 0.001;    // [s]
constexpr double measured_rounding = 1e-15;  // of sums of a few numbers below 1

/// The stage with an arm of two joints, velocity limits of 2.5 rad/s.
struct Measuring {
  explicit Measuring(Output output, JointLimits limits = test::arm_limits(2))
      : settings(test::repeatable_settings(output)),
        robot(test::serial_arm(std::move(limits))),
        joints(robot),
        plausible(robot, Eigen::Vector2d::Ones()),
        state(robot, joints, plausible, settings, output == Output::position) {}

  /// A step whose sample is q, v, of an arm that was commanded to be at `commanded` now.
  bool step(const Eigen::Vector2d& q, const Eigen::Vector2d& v, const Eigen::Vector2d& commanded,
            const Eigen::Vector2d& acceleration = Eigen::Vector2d::Zero()) {
    if (!state.take(q, v)) {
      state.end_without_state(false);
      return false;
    }
    time += measured_period;
    tick.time = time;
    state.judge(commanded, acceleration, tick);
    began = state.begins();
    state.begun();
    state.compare(commanded);
    state.end_step();
    return true;
  }
  bool is_at(const Eigen::Vector2d& q, const Eigen::Vector2d& v) const {
    return (state.position() - q).norm() < measured_rounding && (state.velocity() - v).norm() < measured_rounding;
  }

  ControllerSettings settings;
  Robot robot;
  JointKinds joints;
  Plausibility plausible;
  MeasuredState state;
  double time = 0.0;
  Tick tick = Tick::regular(measured_period);
  bool began = false;
};

const Eigen::Vector2d here(0.0, 0.0), elsewhere(0.3, 0.0), rests(0.0, 0.0);

}  // namespace

BOOST_AUTO_TEST_CASE(a_sample_that_no_motion_explains_is_bridged_by_the_prediction) {
  Measuring m(Output::acceleration);
  const Eigen::Vector2d v(0.5, 0.2), a(1.0, -1.0);
  BOOST_TEST(m.step(here, v, here));
  BOOST_TEST(m.began);
  BOOST_TEST(m.step(elsewhere, v, 0.001 * v, a));
  BOOST_TEST(m.state.bridges_sample());
  BOOST_TEST(!m.state.agrees_with_reference());
  BOOST_TEST(!m.began);
  const Eigen::Vector2d next = v + 0.001 * a;
  BOOST_TEST(m.is_at(0.001 * next, next));  // q + T q̇⁺, q̇⁺ = q̇ + T q̈
  BOOST_TEST((m.state.sample_q() == elsewhere));
  BOOST_TEST(m.state.is_far_from_command());
  BOOST_TEST(
      m.state.explain(here, m.time).starts_with("the arm is not where it was commanded: joint 'joint1' is 0.30 rad off"));
  // Within the measuring error of 0.01 rad and twice the velocity limit it is taken as it is.
  const Eigen::Vector2d near = 0.002 * v + Eigen::Vector2d(0.012, 0.0);
  BOOST_TEST(m.step(near, v, 0.002 * v));
  BOOST_TEST(m.is_at(near, v));
  BOOST_TEST(m.state.agrees_with_reference());
}

BOOST_AUTO_TEST_CASE(a_late_sample_is_compared_with_what_the_arm_did_meanwhile) {
  Measuring late(Output::acceleration), on_time(Output::acceleration);
  const Eigen::Vector2d v(2.0, 0.0), a(1.0, 0.0);
  late.step(here, v, here);
  late.tick.elapsed = late.tick.moved = 0.02;
  const Eigen::Vector2d moved = 0.02 * v;
  late.step(moved, v, moved);
  BOOST_TEST(!late.state.bridges_sample());
  BOOST_TEST(late.is_at(moved, v));
  late.step(elsewhere, v, 2.0 * moved, a);
  BOOST_TEST(late.state.bridges_sample());
  const Eigen::Vector2d next = v + 0.02 * a;
  BOOST_TEST(late.is_at(moved + 0.02 * next, next));
  on_time.step(here, v, here);
  on_time.step(moved, v, 0.001 * v);  // 38 mrad in a millisecond
  BOOST_TEST(on_time.state.bridges_sample());
}

BOOST_AUTO_TEST_CASE(five_samples_in_a_row_that_disagree_begin_the_motion_anew_and_fewer_do_not) {
  Measuring m(Output::acceleration);
  m.step(here, rests, here);
  for (int k = 0; k < 9; ++k) {
    m.step(k == 4 ? here : elsewhere, rests, here);  // four, and four more
    BOOST_TEST(!m.began);
    BOOST_TEST(m.is_at(here, rests));
  }
  m.step(elsewhere, rests, here);
  BOOST_TEST(m.began);
  BOOST_TEST(m.state.agrees_with_reference());
  BOOST_TEST(m.is_at(elsewhere, rests));
  m.step(elsewhere, rests, elsewhere);
  BOOST_TEST(m.state.explain(elsewhere, m.time) == "the arm was moved by something else: continuing from where it is; ");
  BOOST_TEST(m.state.explain(elsewhere, m.time + 1.0) == "");
}

BOOST_AUTO_TEST_CASE(one_sample_that_disagrees_is_enough_after_a_pause_or_a_sample_without_numbers) {
  Measuring m(Output::acceleration);
  m.step(here, rests, here);
  m.tick.pauses = true;
  m.step(elsewhere, rests, here);
  BOOST_TEST(m.began);
  m.tick.pauses = false;
  BOOST_TEST(!m.step({test::not_a_number, 0.0}, rests, elsewhere));
  m.step(here, rests, elsewhere);
  BOOST_TEST(m.began);
  BOOST_TEST(m.is_at(here, rests));
  BOOST_TEST(!m.state.take(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()));
}

BOOST_AUTO_TEST_CASE(the_same_sample_again_of_an_arm_that_moves_is_an_old_one) {
  Measuring m(Output::acceleration);
  const Eigen::Vector2d v(1.0, 0.0);
  m.step(here, v, here);
  for (int k = 1; k <= 11; ++k) {
    m.step(here, v, 0.001 * k * v);
    BOOST_TEST(m.state.bridges_sample());
    BOOST_TEST((m.state.position() - 0.001 * k * v).norm() < measured_rounding);
    // It counts as agreeing while it is within the measuring error of 0.01 rad from the prediction, at k = 10.
    if (k != 10) {
      BOOST_TEST(m.state.agrees_with_reference() == (k < 10));
    }
  }
  Measuring still(Output::acceleration);
  const Eigen::Vector2d jitter(0.09, 0.0);  // of an arm at rest
  still.step(here, jitter, here);
  still.step(here, jitter, here);
  BOOST_TEST(!still.state.bridges_sample());
}

BOOST_AUTO_TEST_CASE(the_same_sample_again_of_a_slow_arm_that_is_accelerated_is_an_old_one_too) {
  Measuring m(Output::torque);
  const Eigen::Vector2d slow(0.05, 0.0), accelerated(20.0, 0.0);
  m.step(here, slow, here);
  m.step(here + measured_period * slow, slow, here + measured_period * slow);
  const Eigen::Vector2d frozen = here + measured_period * slow;
  int first = -1;
  for (int k = 0; k < 30; ++k) {
    m.step(frozen, slow, frozen, accelerated);
    first = first < 0 && m.state.bridges_sample() ? k : first;
  }
  BOOST_TEST(first == 2);                   // the third, after which 0.06 rad/s are missing
  BOOST_TEST(m.state.velocity()[0] > 0.5);  // 27 ms of 20 rad/s²
  Measuring held(Output::torque);           // an arm that is held is measured at rest again and again
  for (int k = 0; k < 30; ++k) {
    held.step(here, rests, here, accelerated);
    BOOST_TEST(!held.state.bridges_sample());
  }
}

BOOST_AUTO_TEST_CASE(a_velocity_that_leaps_alone_is_replaced_until_it_has_stayed_for_five_samples) {
  Measuring m(Output::acceleration);
  m.step(here, rests, here);
  for (int k = 1; k <= 4; ++k) {
    m.step(here, {0.5 + 0.01 * k, 0.0}, here);  // never the same sample again
    BOOST_TEST(m.is_at(here, rests));
  }
  BOOST_TEST(m.state.take(here, Eigen::Vector2d(0.55, 0.0)));
  m.state.judge(here, rests, m.tick);
  BOOST_TEST(m.is_at(here, {0.55, 0.0}));
  m.state.filter_velocity(rests, m.tick);
  BOOST_TEST(m.is_at(here, {0.55, 0.0}));  // once more it is taken as it is
}

BOOST_AUTO_TEST_CASE(the_filter_takes_a_share_of_what_a_measured_velocity_differs_by) {
  Measuring m(Output::acceleration);
  m.step(here, {0.1, 0.0}, here);
  BOOST_TEST(m.state.take(here, Eigen::Vector2d(0.13, 0.0)));
  const Eigen::Vector2d a(10.0, 0.0);
  m.state.judge(here, a, m.tick);
  m.state.filter_velocity(a, m.tick);
  const double share = measured_period / m.settings.tracking.velocity_filter;  // a quarter
  BOOST_TEST(m.is_at(here, {0.11 + share * 0.02, 0.0}));                       // predicted: 0.1 + T 10
}

BOOST_AUTO_TEST_CASE(an_encoder_that_wraps_is_counted_on_and_a_sample_that_is_bridged_turns_nothing) {
  JointLimits limits = test::arm_limits(2);
  limits.lower[0] = -test::infinity;
  limits.upper[0] = test::infinity;
  Measuring m(Output::acceleration, limits);
  const double turn = 2.0 * std::numbers::pi;
  m.step({3.14, 0.0}, {2.0, 0.0}, {3.14, 0.0});
  m.step({3.142 - turn, 0.0}, {2.0, 0.0}, {3.142, 0.0});
  BOOST_TEST(m.state.turn(0) == turn);
  BOOST_TEST(m.is_at({3.142, 0.0}, {2.0, 0.0}));
  m.step({9.0, 0.0}, {2.0, 0.0}, {3.144, 0.0});
  BOOST_TEST(m.state.bridges_sample());
  BOOST_TEST(m.state.turn(0) == turn);
  BOOST_TEST(m.state.turn(1) == 0.0);
}

BOOST_AUTO_TEST_CASE(degrees_are_no_first_sample_and_do_not_become_one_by_staying) {
  Measuring m(Output::acceleration);
  BOOST_TEST(!m.step({90.0, 0.0}, rests, here));
  BOOST_TEST(m.state.what_is_impossible().joint == 0);
  BOOST_TEST(m.state.what_is_impossible().value == 90.0);
  BOOST_TEST(m.step(here, rests, here));
  for (int k = 0; k < 5; ++k) {
    BOOST_TEST(m.step({90.0, 0.0}, rests, here));
    BOOST_TEST(m.state.bridges_sample());
    BOOST_TEST(!m.began);
  }
  BOOST_TEST(!m.step({90.0, 0.0}, rests, here));  // from the sixth on it is no state at all
}

BOOST_AUTO_TEST_CASE(an_arm_that_rests_away_from_what_its_drives_were_told_begins_anew_after_half_a_second) {
  Measuring m(Output::position);
  const Eigen::Vector2d commanded(0.26, 0.0);  // more than 0.1 s at 2.5 rad/s from the arm
  double began_after = 0.0;
  m.step(here, rests, here);
  for (int k = 0; k < 600 && began_after == 0.0; ++k) {
    m.step(here, rests, commanded);
    BOOST_TEST(!m.state.bridges_sample());
    began_after = m.began ? m.time : 0.0;
  }
  BOOST_TEST(std::abs(began_after - 0.502) < 0.0015);  // it is away from the second step on, to a period of rounding
}

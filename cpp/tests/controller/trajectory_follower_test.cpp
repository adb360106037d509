// A trajectory that is followed by a clock, alone: a reference is led and integrated, no controller.
#include <boost/test/unit_test.hpp>
#include <numbers>

#include "../../src/controller/trajectory_follower.hpp"
#include "support/planar_arm.hpp"
#include "support/stage_model.hpp"

using namespace sidestep;

namespace {

constexpr double slow_path = 0.2, fast_path = 0.5;  // speed of the first joint [rad/s]

/// The stage with an arm in the plane, 0.6 m long, whose first joint turns from 0 to 1.2 rad.
struct Tracing {
  explicit Tracing(double speed, TrajectoryBehaviour behaviour = TrajectoryBehaviour::keep_path)
      : request{turn(speed), behaviour, nullptr} {
    follower.begin(request, reference);
  }
  JointTrajectory turn(double speed) const {
    const Eigen::VectorXd times = Eigen::VectorXd::LinSpaced(13, 0.0, 1.2 / speed);
    Eigen::MatrixXd q = Eigen::MatrixXd::Zero(2, 13);
    q.row(0) = speed * times.transpose();
    return JointTrajectory(robot, q, times, usable.velocity, usable.acceleration);
  }
  /// A period, in which the reference does what is asked.
  bool step(const Obstacles& obstacles = Obstacles::none(), double pace = 1.0) {
    const bool goes_on = follower.follow(request, age, pace, reference, obstacles, Tick::regular(settings.period), target);
    reference.advance(target.desired_acceleration(), false, Eigen::Vector2d::Ones(), settings.period);
    reference.go_on();
    age += settings.period;
    return goes_on;
  }
  void go_on_until(double end, const Obstacles& obstacles = Obstacles::none()) {
    while (age < end) {
      step(obstacles);
    }
  }

  const ControllerSettings settings = test::straight_settings(ControllerSettings::Output::position);
  const Robot robot = test::planar_arm();
  const ClearanceQuery body = test::planar_arm_body();
  const JointKinds joints{robot};
  const UsableLimits usable{Eigen::Vector2d(2.0, 2.0), Eigen::Vector2d(9.0, 9.0)};
  TrajectoryFollower follower{body, robot.limits(), joints, settings, usable};
  InputTarget target{robot.limits(), settings};
  Reference reference{2};
  TrajectoryRequest request;
  double age = 0.0;
};

/// In the way of the second link at a turn of 1 rad.
const Obstacles in_the_way = test::ball({0.5 * std::cos(1.0), 0.5 * std::sin(1.0), 0.0}, 0.05);

}  // namespace

BOOST_AUTO_TEST_CASE(the_clock_of_a_slow_path_runs_as_time_does) {
  Tracing t(slow_path);
  t.go_on_until(2.0);
  BOOST_TEST(std::abs(t.follower.rate() - 1.0) < 1e-9);  // it halves what is left in every period
  const double delay = t.follower.delay();
  BOOST_TEST(delay < 0.05);  // from rest to 0.2 rad/s with 9 rad/s² takes 22 ms
  BOOST_TEST(std::abs(t.follower.time() + delay - (t.age - t.settings.period)) < 1e-9);  // rounding of 2,000 sums
  BOOST_TEST(!t.follower.is_slowed());
  t.go_on_until(4.0);
  BOOST_TEST(std::abs(t.follower.delay() - delay) < 1e-9);  // it gets no more
  // The reference is integrated by velocities, half a period behind them: 0.2 rad/s × 0.5 ms.
  BOOST_TEST(std::abs(t.reference.q[0] - slow_path * (t.follower.time() + t.settings.period)) < 2e-4);
  BOOST_TEST(t.follower.judge_deviation(t.request, t.reference.q) < 1e-9);  // a straight line
}

BOOST_AUTO_TEST_CASE(a_reference_beside_its_path_is_led_back_critically) {
  Tracing t(slow_path);
  t.go_on_until(1.0);
  t.reference.q += Eigen::Vector2d(0.01, -0.05);
  t.follower.follow(t.request, t.age, 1.0, t.reference, Obstacles::none(), Tick::regular(t.settings.period), t.target);
  const JointGoal& motion = t.target.joint_motion();
  const double w = t.settings.inputs.frequency;
  for (Eigen::Index j = 0; j < 2; ++j) {
    const double e = motion.position[j] - t.reference.q[j];
    const double back = std::min(0.5 * w * std::abs(e), std::sqrt(9.0 * std::abs(e)));
    const double velocity = motion.velocity[j] - 0.5 * t.settings.period * motion.acceleration[j] + std::copysign(back, e);
    const double expected = motion.acceleration[j] + 2.0 * w * (velocity - t.reference.v[j]);
    BOOST_TEST(std::abs(t.target.desired_acceleration()[j] - expected) < 1e-13);  // rounding of numbers near 10
  }
  BOOST_TEST(std::abs(motion.velocity[0] - slow_path) < 1e-9);  // at full rate, as above
  BOOST_TEST(t.follower.is_off(t.follower.judge_deviation(t.request, t.reference.q)));
}

BOOST_AUTO_TEST_CASE(a_path_that_is_kept_waits_before_an_obstacle_and_goes_on_when_it_is_gone) {
  Tracing t(fast_path);
  t.go_on_until(3.0, in_the_way);
  BOOST_TEST(t.target.waits());
  BOOST_TEST(t.follower.rate() < 1e-3);  // it comes to rest as √(distance left)
  ClearanceQuery::Workspace workspace(t.body);
  const double clearance = t.body.nearest(t.reference.q, in_the_way, 1.0, workspace).clearance;
  BOOST_TEST(clearance >= t.settings.safety.margin);
  BOOST_TEST(clearance < t.settings.safety.margin + 0.005);  // a station of 0.01 s is 2.5 mm there, and it stops one before
  BOOST_TEST(t.follower.explain(t.follower.delay(), 0.0, true, in_the_way).ends_with("blocked by obstacle point 0"));
  const double time = t.follower.time();
  t.go_on_until(3.5, in_the_way);
  BOOST_TEST(t.follower.time() - time < 0.01);  // a station
  t.go_on_until(6.0);
  BOOST_TEST(!t.target.waits());
  BOOST_TEST(t.follower.has_ended(t.request));
  BOOST_TEST(std::abs(t.reference.q[0] - 1.2) < 1e-3);  // ω = 10: e^(−10 t) of 0.2 s or more
}

BOOST_AUTO_TEST_CASE(a_slow_path_that_is_kept_waits_as_well_and_is_not_left) {
  for (const double speed : {0.02, 0.05, 0.1, 0.2}) {
    Tracing t(speed);
    ClearanceQuery::Workspace workspace(t.body);
    t.go_on_until(1.2 / speed, in_the_way);
    const double clearance = t.body.nearest(t.reference.q, in_the_way, 1.0, workspace).clearance;
    BOOST_TEST_CONTEXT("speed " << speed << " clearance " << clearance) {
      BOOST_TEST(clearance > t.settings.safety.margin - 0.002);  // once on the way it may be 1 mm less
      BOOST_TEST(t.follower.rate() < 1e-6);
      const double waits_at = t.follower.time();
      t.go_on_until(1.2 / speed + 5.0, in_the_way);
      BOOST_TEST(std::abs(t.follower.time() - waits_at) * speed < 1e-4);
    }
  }
}

BOOST_AUTO_TEST_CASE(a_motion_that_begins_anew_goes_on_from_where_its_clock_is) {
  Tracing t(slow_path);
  t.go_on_until(2.0);
  const double time = t.follower.time();
  t.follower.begin_anew();
  BOOST_TEST(t.follower.time() == time);
  BOOST_TEST(t.follower.rate() == 0.0);
  Tracing other(slow_path);
  t.go_on_until(3.0);
  other.follower.go_on_from(t.follower);
  BOOST_TEST(other.follower.time() == t.follower.time());
  BOOST_TEST(other.follower.rate() == t.follower.rate());
  BOOST_TEST(std::abs(t.follower.rate() - 1.0) < 1e-9);
}

BOOST_AUTO_TEST_CASE(a_trajectory_that_steers_ends_and_one_that_keeps_its_path_stays_at_its_end) {
  Tracing steered(slow_path, TrajectoryBehaviour::steer), kept(slow_path);
  steered.go_on_until(6.5, in_the_way);  // it does not wait: barriers lead around
  kept.go_on_until(6.5);
  BOOST_TEST(!steered.step(in_the_way));
  BOOST_TEST(kept.step());
  BOOST_TEST(steered.target.joint_motion().velocity.isZero(0.0));
  BOOST_TEST(std::abs(kept.target.joint_motion().position[0] - 1.2) < 1e-15);  // rounding of the last sample
  Tracing slow(slow_path);
  for (int k = 0; k < 1000; ++k) {
    slow.step(Obstacles::none(), 0.5);
  }
  BOOST_TEST(std::abs(slow.follower.rate() - 0.5) < 1e-9);  // the pace
}

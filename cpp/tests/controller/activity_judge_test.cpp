// What a controller says it is doing, alone: by what a step ended with.
#include <boost/test/unit_test.hpp>

#include "../../src/controller/activity_judge.hpp"
#include "support/stage_model.hpp"

using namespace sidestep;
using Output = ControllerSettings::Output;

namespace {

constexpr double judged_period = 0.001;  // [s]

/// The stage with an arm of two joints at rest, and a goal at rest that nothing is in the way of.
struct Judging {
  Judging() {
    set({1, Goal(JointGoal(Eigen::Vector2d(0.5, 0.5)))});
    Goal goal = *request.goal();
    follower.leave(true);
    follower.begin(goal, false, {reference, reference.q, obstacles, tick, 1});
    measure({0.0, 0.0}, {0.0, 0.0});
  }
  void set(NumberedRequest newest) {
    buffer.put(std::move(newest));
    request.update(judged_period);
  }
  void measure(const Eigen::Vector2d& q, const Eigen::Vector2d& v) {
    BOOST_REQUIRE(arm.take(q, v));
    kinematics.update(model.arm.robot(), q, v);
  }
  ActivityJudge::Evidence evidence() {
    tick.time += judged_period;
    const Goal& destination = request.goal() != nullptr ? *request.goal() : resting;
    ActivityJudge::Evidence now{request, destination, follower, follower.led_goal(), arm, kinematics, StepStatus::ok, tick};
    now.target_blocked = blocked;
    return now;
  }
  Activity judge() { return judge_.judge(evidence()).activity; }
  /// Steps until that is said; -1: not within a second.
  int steps_until(Activity activity) {
    for (int k = 1; k <= 1000; ++k) {
      if (judge() == activity) {
        return k;
      }
    }
    return -1;
  }

  const ControllerModel model = test::stage_model(2, test::straight_settings(Output::position));
  const Obstacles obstacles = Obstacles::none();
  const Goal resting = JointGoal(Eigen::Vector2d::Zero());
  TripleBuffer<NumberedRequest> buffer{NumberedRequest{}};
  CurrentRequest request{buffer};
  RequestBoard board{2};
  Reference reference{2};
  GoalFollower follower{model.body, model.settings, model.joints, model.dynamics, board, false};
  MeasuredState arm{model.arm.robot(), model.joints, model.plausible, model.settings, true};
  KinematicState kinematics{model.arm.robot()};
  ActivityJudge judge_{model.settings, model.joints, model.look_period};
  Tick tick = Tick::regular(judged_period);
  bool blocked = false;  // the target
};

}  // namespace

BOOST_AUTO_TEST_CASE(an_arm_on_its_way_moves_and_within_the_tolerance_at_low_speed_has_arrived) {
  Judging j;
  BOOST_TEST((j.judge() == Activity::moving));
  j.measure({0.5099, 0.4901}, {0.049, 0.0});  // 0.01 rad, 0.05 rad/s
  BOOST_TEST((j.judge() == Activity::arrived));
  j.measure({0.5101, 0.5}, {0.0, 0.0});
  BOOST_TEST((j.judge() == Activity::moving));
  j.measure({0.5, 0.5}, {0.051, 0.0});
  BOOST_TEST((j.judge() == Activity::moving));
  ActivityJudge::Evidence under_way = j.evidence();
  j.measure({0.5, 0.5}, {0.0, 0.0});
  under_way.under_way = true;  // a trajectory that comes by its end
  BOOST_TEST((j.judge_.judge(under_way).activity == Activity::moving));
}

BOOST_AUTO_TEST_CASE(a_pose_is_reached_where_its_frame_is) {
  Judging j;
  const Robot& robot = j.model.arm.robot();
  j.set({2, Goal(test::pose_of(robot, Eigen::Vector2d(0.5, 0.5)))});
  j.measure({0.5, 0.5}, {0.0, 0.0});
  BOOST_TEST((j.judge() == Activity::arrived));
  j.measure({0.5, 0.5 + 0.004}, {0.0, 0.0});  // 0.3 m × 4 mrad are more than 1 mm
  BOOST_TEST((j.judge() != Activity::arrived));
}

BOOST_AUTO_TEST_CASE(no_way_has_to_stay_for_a_fifth_of_a_second_before_the_arm_is_blocked_and_half_as_long_to_be_free) {
  Judging j;
  j.judge();
  j.blocked = true;
  // A period of rounding; the first of them begins the time.
  BOOST_TEST(std::abs(j.steps_until(Activity::blocked) - 201) <= 1);
  j.blocked = false;
  BOOST_TEST(std::abs(j.steps_until(Activity::moving) - 101) <= 1);
  j.blocked = true;
  for (int k = 0; k < 150; ++k) {
    BOOST_TEST((j.judge() == Activity::moving));
  }
  j.blocked = false;  // a look that says otherwise: the time begins anew
  j.judge();
  j.blocked = true;
  BOOST_TEST(j.steps_until(Activity::blocked) >= 200);
  j.judge_.forget(j.tick.time);  // another goal
  BOOST_TEST((j.judge() == Activity::moving));
}

BOOST_AUTO_TEST_CASE(rest_short_of_a_goal_is_said_only_of_an_arm_on_its_way) {
  Judging j;
  BOOST_TEST((j.judge_.judge(j.evidence()).rests == true));
  j.measure({0.0, 0.0}, {0.06, 0.0});
  BOOST_TEST((j.judge_.judge(j.evidence()).rests == false));
  j.measure({0.5, 0.5}, {0.0, 0.0});
  BOOST_TEST(!j.judge_.judge(j.evidence()).rests.has_value());
}

BOOST_AUTO_TEST_CASE(what_is_old_or_not_asked_for_comes_first) {
  Judging j;
  ActivityJudge::Evidence stale = j.evidence();
  stale.stale = true;
  BOOST_TEST((j.judge_.judge(stale).activity == Activity::stale));
  ActivityJudge::Evidence waits = j.evidence();
  waits.waits = true;
  BOOST_TEST((j.judge_.judge(waits).activity == Activity::waiting));
  ActivityJudge::Evidence invalid = j.evidence();
  invalid.attraction = StepStatus::invalid_goal;
  BOOST_TEST((j.judge_.judge(invalid).activity == Activity::blocked));
  j.set({2, VelocityRequest{Eigen::Vector2d(0.1, 0.0)}});
  BOOST_TEST((j.judge() == Activity::no_goal));
  ActivityJudge::Evidence fresh = j.evidence();
  fresh.fresh = true;
  BOOST_TEST((j.judge_.judge(fresh).activity == Activity::moving));
  j.set({3, Request()});
  BOOST_TEST((j.judge() == Activity::no_goal));
  BOOST_TEST((ActivityJudge::without_state(true, true) == Activity::stale));
  BOOST_TEST((ActivityJudge::without_state(false, true) == Activity::waiting));
  BOOST_TEST((ActivityJudge::without_state(false, false) == Activity::no_goal));
}

// What leads the reference to a goal at rest, alone: without a step, and without the planner's path.
#include <boost/test/unit_test.hpp>
#include <numbers>

#include "../../src/controller/goal_follower.hpp"
#include "support/numbers.hpp"
#include "support/stage_model.hpp"

using namespace sidestep;
using test::nv;
using Output = ControllerSettings::Output;

namespace {

/// The stage with an arm of seven joints, among nothing.
struct Leading {
  explicit Leading(JointLimits limits = test::arm_limits(nv))
      : model(test::covered_arm(std::move(limits)), test::straight_settings(Output::position)) {}
  GoalFollower::Moment now(double time = 0.0) {
    tick.time = time;
    return {reference, reference.q, obstacles, tick, 1};
  }

  const ControllerModel model;
  const Obstacles obstacles = Obstacles::none();
  RequestBoard board{nv};
  GoalFollower follower{model.body, model.settings, model.joints, model.dynamics, board, false};
  Reference reference{nv};
  TargetFindings findings;
  Tick tick = Tick::regular(0.001);
};

const Eigen::VectorXd led_to = (Eigen::VectorXd(nv) << 0.4, 0.5, 0.3, 0.9, -0.2, 0.6, 0.4).finished();

}  // namespace

BOOST_AUTO_TEST_CASE(a_joint_goal_is_led_to_straight_and_the_same_again_is_no_other) {
  Leading l;
  Goal goal = JointGoal(led_to);
  l.follower.leave(true);
  BOOST_TEST(l.follower.begins_goal());
  BOOST_TEST((l.follower.way(0.0, nullptr, false) == Way::unknown));
  BOOST_TEST(l.follower.begin(goal, false, l.now()));
  BOOST_TEST(!l.follower.begins_goal());
  BOOST_TEST(!l.follower.begin(goal, false, l.now()));
  const Goal& led = l.follower.lead(nullptr, l.now(), false, l.findings);
  BOOST_TEST((&led == l.follower.led_goal()));
  BOOST_TEST((std::get<JointGoal>(led).position == led_to));
  BOOST_TEST(std::get<JointGoal>(led).velocity.isZero(0.0));
  BOOST_TEST(l.follower.is_led_to_target());
  BOOST_TEST(l.follower.reaches_goal());
  BOOST_TEST((l.follower.way(0.0, &led, false) == Way::open));
  BOOST_TEST(l.follower.stops_short(&led, true));
  BOOST_TEST((l.follower.way(0.0, &led, true) == Way::none));
  Places places(nv);
  l.follower.write_places(places);
  BOOST_TEST(places.num == 1);
  BOOST_TEST((places.q.col(0) == led_to));
  l.follower.leave(false);
  l.follower.write_places(places);
  BOOST_TEST(places.num == 0);
}

BOOST_AUTO_TEST_CASE(a_joint_without_limits_goes_to_the_nearest_turn) {
  JointLimits limits = test::arm_limits(nv);
  limits.lower[0] = -test::infinity;
  limits.upper[0] = test::infinity;
  Leading l(limits);
  Eigen::VectorXd asked = led_to;
  asked[0] = 6.0;
  Goal goal = JointGoal(asked);
  l.follower.begin(goal, false, l.now());
  asked[0] -= 2.0 * std::numbers::pi;                                 // the reference is at zero
  BOOST_TEST((l.follower.target_position() - asked).norm() < 1e-14);  // rounding near 6
}

BOOST_AUTO_TEST_CASE(a_pose_is_led_to_by_a_posture_and_by_another_one_where_that_is_blocked) {
  Leading l;
  const Robot& robot = l.model.arm.robot();
  const PoseGoal pose = test::pose_of(robot, led_to);
  Goal goal = pose;
  BOOST_TEST(l.follower.begin(goal, false, l.now()));
  BOOST_TEST(l.follower.reaches_goal());
  const auto error = [&] { return pose_error(pose, test::state_at(robot, l.follower.target_position())); };
  BOOST_TEST(error().position < 1e-7);  // as Posture::found promises
  BOOST_TEST(error().rotation < 1e-7);
  BOOST_TEST((l.board.fault() == ""));
  const Eigen::VectorXd first = l.follower.target_position();
  l.follower.lead(&pose, l.now(0.1), false, l.findings);
  BOOST_TEST(l.follower.attempt() == 0u);
  l.findings = {.blocked = true, .rests = true};
  const Goal& led = l.follower.lead(&pose, l.now(0.2), false, l.findings);
  BOOST_TEST((!l.findings.blocked && !l.findings.rests));
  BOOST_TEST(l.follower.attempt() == 1u);
  BOOST_TEST((l.follower.target_position() - first).cwiseAbs().maxCoeff() > 0.1);  // another one, not the same by rounding
  BOOST_TEST(error().position < 1e-7);
  BOOST_TEST((std::get<JointGoal>(led).position == l.follower.target_position()));
}

BOOST_AUTO_TEST_CASE(a_worker_is_asked_once_for_a_posture_and_its_answer_to_another_question_does_not_count) {
  ControllerSettings settings = test::straight_settings(Output::position);
  settings.synchronous = false;
  const ControllerModel model = test::stage_model(nv, settings);
  RequestBoard board(nv);
  GoalFollower follower(model.body, model.settings, model.joints, model.dynamics, board, false);
  const Reference reference(nv);
  const Obstacles obstacles = Obstacles::none();
  const Tick tick = Tick::regular(0.001);
  const GoalFollower::Moment now{reference, reference.q, obstacles, tick, 1};
  const PoseGoal pose = test::pose_of(model.arm.robot(), led_to);
  Goal goal = pose;
  TargetFindings findings;
  follower.begin(goal, false, now);
  BOOST_TEST(follower.asks());
  BOOST_TEST(follower.take_question());
  BOOST_TEST(!follower.take_question());
  follower.found_postures().put({0, 0, {led_to, 0.0, 0.0}});
  BOOST_TEST((std::get<JointGoal>(follower.lead(&pose, now, false, findings)).position == reference.q));  // it waits
  BOOST_TEST((follower.taken().posture != nullptr));
  follower.found_postures().put({1, 0, {led_to, 0.0, 0.0}});
  BOOST_TEST((std::get<JointGoal>(follower.lead(&pose, now, false, findings)).position == led_to));
  BOOST_TEST(follower.reaches_goal());
}

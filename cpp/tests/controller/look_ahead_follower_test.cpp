// Trajectories out of the way that another thread found, alone: from when on they are followed, and what their age costs.
#include <boost/test/unit_test.hpp>

#include "../../src/controller/look_ahead_follower.hpp"
#include "support/stage_model.hpp"

using namespace sidestep;
using Output = ControllerSettings::Output;

namespace {

/// The stage with an arm of two joints; a look-ahead is followed 0.1 s after the state that it began with.
struct Avoiding {
  static ControllerSettings with_look_ahead() {
    ControllerSettings settings = test::straight_settings(Output::position);
    settings.synchronous = false;
    settings.look_ahead = LookAheadSettings{};
    return settings;
  }
  FoundTrajectory found(double time, bool avoid, double duration = 0.0) const { return {time, 1, avoid, aside, duration}; }

  const ControllerModel model = test::stage_model(2, with_look_ahead());
  const Eigen::VectorXd begin = Eigen::Vector2d(0.1, 0.2), rest = Eigen::Vector2d::Zero(), end = Eigen::Vector2d(1.0, -0.5);
  const AvoidanceTrajectory aside{model.arm.robot().limits(), begin, rest, end};
  LookAheadFollower follower{model.system, model.settings, model.dynamics};
};

}  // namespace

BOOST_AUTO_TEST_CASE(a_trajectory_that_was_found_is_followed_from_its_delay_on_moved_on_by_what_it_is_late) {
  Avoiding a;
  BOOST_TEST(a.follower.is_on());
  BOOST_TEST((a.follower.follow(Tick::regular(0.001, 0.05)) == nullptr));
  a.follower.buffer().put(a.found(0.05, true));
  BOOST_TEST((a.follower.follow(Tick::regular(0.001, 0.06)) != nullptr));
  BOOST_TEST(!a.follower.is_followed());
  BOOST_TEST((a.follower.follow(Tick::regular(0.001, 0.153)) == nullptr));  // 3 periods late
  BOOST_TEST(a.follower.is_followed());
  BOOST_TEST((std::get<JointGoal>(a.follower.target()).position == a.end));
  AvoidanceTrajectory expected = a.aside;
  for (int k = 0; k < 3; ++k) {
    expected.advance(a.model.settings.period);
  }
  BOOST_TEST((a.follower.followed().position() == expected.position()));
  a.follower.follow(Tick::regular(0.001, 0.154));
  expected.advance(a.model.settings.period);
  BOOST_TEST((a.follower.followed().position() == expected.position()));
  a.follower.buffer().put(a.found(0.1, false));  // the goal's own way is free again
  a.follower.follow(Tick::regular(0.001, 0.199));
  BOOST_TEST(a.follower.is_followed());
  a.follower.follow(Tick::regular(0.001, 0.2));
  BOOST_TEST(!a.follower.is_followed());
}

BOOST_AUTO_TEST_CASE(the_age_of_a_look_slows_the_arm_beside_what_moves_and_nowhere_else) {
  Avoiding a;
  const LookAheadSettings& look = *a.model.settings.look_ahead;
  a.follower.buffer().put(a.found(1.0, false, 0.25));
  a.follower.follow(Tick::regular(0.001, 1.1));  // it took 0.15 s more by the machine's clock than the steps since
  a.follower.judge_age(1.5, true);
  BOOST_TEST(std::abs(a.follower.age() - 0.65) < 1e-14);          // rounding near 1
  BOOST_TEST(std::abs(a.follower.current_pace() - 0.5) < 1e-14);  // half way from 3 delays to 10
  BOOST_TEST(a.follower.current_pace() == look.pace(a.follower.age()));
  BOOST_TEST(a.follower.slows(true));
  BOOST_TEST(!a.follower.slows(false));
  a.follower.judge_age(1.5, false);
  BOOST_TEST(a.follower.current_pace() == 1.0);
  a.follower.buffer().put(a.found(1.5, true));
  a.follower.follow(Tick::regular(0.001, 1.6));
  a.follower.judge_age(2.5, true);  // the way out of the way is not slowed
  BOOST_TEST(a.follower.current_pace() == 1.0);
  a.follower.begin_anew();
  BOOST_TEST(!a.follower.is_followed());
}

BOOST_AUTO_TEST_CASE(without_a_look_ahead_nothing_ages) {
  const ControllerModel model = test::stage_model(2, test::straight_settings(Output::position));
  LookAheadFollower follower(model.system, model.settings, model.dynamics);
  BOOST_TEST(!follower.is_on());
  follower.judge_age(100.0, true);
  BOOST_TEST(follower.age() == 0.0);
  BOOST_TEST(follower.current_pace() == 1.0);
}

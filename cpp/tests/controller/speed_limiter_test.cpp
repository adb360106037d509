// Limits of Cartesian speed by distance, alone.
#include <boost/test/unit_test.hpp>

#include "../../src/controller/speed_limiter.hpp"
#include "support/numbers.hpp"
#include "support/stage_model.hpp"

using namespace sidestep;
using Output = ControllerSettings::Output;

namespace {

/// The stage with an arm of two links along z, upright, whose second joint turns with 1 rad/s: the tip moves with 0.3 m/s.
struct Limiting {
  explicit Limiting(bool limits = true) : model(test::stage_model(2, settings(limits))) {
    moving.update(model.arm.robot(), upright, Eigen::Vector2d(0.0, 1.0));
  }
  static ControllerSettings settings(bool limits) {
    ControllerSettings s = test::straight_settings(Output::position);
    if (limits) {
      s.speed_limits = SpeedLimitSettings{};
    }
    return s;
  }
  std::optional<double> update(double distance, bool known_before) {
    const Obstacles ball = test::ball({0.04 + distance + 0.1, 0.0, 0.75}, 0.1);  // the link's half width is 0.04 m
    return limiter.update(resting, moving, upright, ball, known_before, Tick::regular(0.001), command);
  }

  const ControllerModel model;
  const Eigen::VectorXd upright = Eigen::VectorXd::Zero(2);
  const KinematicState resting = test::state_at(model.arm.robot(), upright);
  KinematicState moving{model.arm.robot()};
  SpeedLimiter limiter{model.body, model.settings};
  Command command{2};
};

}  // namespace

BOOST_AUTO_TEST_CASE(without_limits_the_speed_is_reported_and_nothing_slowed) {
  Limiting l(false);
  BOOST_TEST(!l.update(0.2, false).has_value());
  BOOST_TEST(std::abs(l.command.speed - 0.3) < 1e-15);  // rounding
  BOOST_TEST(l.command.speed_limit == test::infinity);
  BOOST_TEST((l.limiter.at_reference().state == nullptr));
  BOOST_TEST((l.limiter.at_arm().state == nullptr));
}

BOOST_AUTO_TEST_CASE(the_limit_is_that_of_the_distance_now_and_the_path_slows_ahead_of_what_closes) {
  Limiting l;
  const SpeedLimitSettings& limits = *l.model.settings.speed_limits;
  const double rounding = 1e-7;  // distances of points are found in single precision
  const std::optional<double> first = l.update(0.3, false);
  BOOST_TEST(std::abs(l.command.distance - 0.3) < rounding);
  BOOST_TEST(std::abs(l.command.speed_limit - limits.allowed(0.3)) < rounding);
  // Nothing was known before: it counts as coming from afar as fast as a person walks, 1.6 m/s, and the arm moves, 0.3 m/s.
  BOOST_TEST(std::abs(*first - limits.allowed(0.3 - 1.9 * 0.1)) < rounding);
  const std::optional<double> closing = l.update(0.2995, true);                // 0.5 m/s
  BOOST_TEST(std::abs(*closing - limits.allowed(0.2995 - 0.5 * 0.1)) < 1e-5);  // 0.1 s / 1 ms times the rounding
  const std::optional<double> leaving = l.update(0.31, true);
  BOOST_TEST(std::abs(*leaving - limits.allowed(0.31)) < rounding);
  l.update(1.5, true);
  BOOST_TEST(l.command.distance == test::infinity);
  BOOST_TEST(std::abs(l.command.speed_limit - limits.far_speed) < rounding);
}

BOOST_AUTO_TEST_CASE(reference_and_arm_have_the_same_limit_and_the_words_name_what_is_slowed) {
  Limiting l;
  l.update(0.3, false);
  l.update(0.299, true);
  const SpeedLimitNow &reference = l.limiter.at_reference(), &arm = l.limiter.at_arm();
  BOOST_TEST((reference.state == &l.resting));
  BOOST_TEST((arm.state == &l.moving));
  BOOST_TEST(reference.limit == l.command.speed_limit);
  BOOST_TEST(arm.limit == reference.limit);
  const double next = l.model.settings.speed_limits->allowed(0.298);  // it closes by 1 mm in a period
  BOOST_TEST(std::abs(reference.next_limit - next) < 1e-7);           // in single precision, as above
  BOOST_TEST(arm.next_limit == reference.next_limit);
  MotionSolution solution(2);
  const Obstacles named = test::ball({0.5, 0.0, 0.75}, 0.1).named({"person"}, {1});
  BOOST_TEST(l.limiter.explain(l.command, solution, named) == "");
  solution.speed_frame = l.model.arm.robot().frame_index("tip");
  BOOST_TEST(l.limiter.explain(l.command, solution, named).starts_with("slowed by the speed limit: 'tip' may move at "));
  BOOST_TEST(l.limiter.explain(l.command, solution, named).ends_with(" m/s, 0.30 m from 'person'; "));
}

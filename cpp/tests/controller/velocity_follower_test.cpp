// A velocity that is followed, alone: q̈ = k (v_w − q̇) within limits, and what counts as less than asked.
#include <boost/test/unit_test.hpp>

#include "../../src/controller/velocity_follower.hpp"
#include "support/stage_model.hpp"

using namespace sidestep;
using Output = ControllerSettings::Output;

namespace {

constexpr double follower_rounding = 1e-14;  // of accelerations near 10

/// The stage with an arm of two joints among nothing: 2.5 rad/s and 10 rad/s², of which 98 % and 90 % are usable.
struct Following {
  Following() : closing(test::no_closing(model)), target(model.arm.robot().limits(), model.settings) {}

  /// Follows a velocity, and gives the acceleration that the target asks for.
  Eigen::VectorXd follow(const Eigen::Vector2d& velocity, const Reference& reference, bool fresh = true, double pace = 1.0) {
    follower.follow(VelocityRequest{velocity}, fresh, pace, reference, {seen, rest, closing},
                    Tick::regular(model.settings.period), target);
    const JointGoal& goal = std::get<JointGoal>(target.attraction());
    return model.settings.barriers.damping * (goal.velocity - reference.v);
  }

  const ControllerModel model = test::stage_model(2, test::straight_settings(Output::position));
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(2);
  ClosingEstimate closing;
  const Clearances seen{2, model.system->num_embedding_coordinates()};
  InputTarget target;
  VelocityFollower follower{model.arm.robot(), model.joints, model.settings, model.usable, model.clearances};
  const Reference at_rest = test::reference_at(rest, rest);
};

}  // namespace

BOOST_AUTO_TEST_CASE(the_response_to_a_velocity_is_its_difference_times_a_rate) {
  Following f;
  const Reference moving = test::reference_at(f.rest, Eigen::Vector2d(0.1, 0.2));
  const Eigen::VectorXd asked = f.follow({0.3, 0.1}, moving);
  BOOST_TEST((asked - 20.0 * Eigen::Vector2d(0.2, -0.1)).norm() < follower_rounding);
  BOOST_TEST((f.target.joint_motion().velocity == Eigen::Vector2d(0.3, 0.1)));
  BOOST_TEST(f.target.is_followed());
  BOOST_TEST((f.follow({0.3, 0.1}, moving, true, 0.5) - 20.0 * Eigen::Vector2d(0.05, -0.15)).norm() < follower_rounding);
  BOOST_TEST((f.follow({0.3, 0.1}, moving, false) + 20.0 * moving.v).norm() < follower_rounding);  // an old one: rest
}

BOOST_AUTO_TEST_CASE(limits_scale_a_velocity_and_its_response_as_a_whole) {
  Following f;
  const Eigen::VectorXd asked = f.follow({5.0, 2.5}, f.at_rest);
  BOOST_TEST((asked - Eigen::Vector2d(9.0, 4.5)).norm() < follower_rounding);
  BOOST_TEST((f.follower.wanted_velocity() - Eigen::Vector2d(2.45, 1.225)).norm() < follower_rounding);
  BOOST_TEST((f.follower.what_reduces().by == Reduction::By::speed));
  BOOST_TEST(f.follower.what_reduces().joint == 0);
  BOOST_TEST(!f.follower.follows(VelocityRequest{Eigen::Vector2d(5.0, 2.5)}, f.follower.wanted_velocity()));
  BOOST_TEST(f.follower.follows(VelocityRequest{Eigen::Vector2d(5.0, 2.5)}, Eigen::Vector2d(4.76, 2.5)));  // 5 %
}

BOOST_AUTO_TEST_CASE(a_reference_that_stays_behind_its_response_is_missed_after_four_time_constants) {
  Following f;
  const Eigen::Vector2d velocity(0.05, 0.0);
  const VelocityRequest request{velocity};
  int steps = 0;
  while (steps < 1000 && !f.follower.misses_for_long()) {
    f.follow(velocity, f.at_rest);
    static_cast<void>(f.follower.judge(request, f.at_rest, f.rest, Tick::regular(f.model.settings.period)));
    ++steps;
  }
  // After 3 periods the response alone would be off by the tolerance of 3.5 mrad/s; then 4 / (20 /s) are 200 periods.
  BOOST_TEST(std::abs(steps - 204) <= 1);  // a period of rounding
  BOOST_TEST(f.follower.bends());          // the wanted acceleration was none
  f.follower.rest();
  BOOST_TEST(!f.follower.misses());
}

BOOST_AUTO_TEST_CASE(a_reference_that_responds_misses_nothing_on_its_way) {
  Following f;
  const Eigen::Vector2d velocity(0.4, -0.2);
  const VelocityRequest request{velocity};
  Reference reference = f.at_rest;
  const Eigen::VectorXd jerk = Eigen::VectorXd::Constant(2, 1e3);
  for (int k = 0; k < 600; ++k) {
    const Eigen::VectorXd wanted = f.follow(velocity, reference);
    reference.advance(wanted, false, jerk, f.model.settings.period);
    BOOST_TEST(!f.follower.judge(request, reference, wanted, Tick::regular(f.model.settings.period)));
    reference.go_on();
  }
  // 600 periods: (1 − 0.02)^600 of the difference is left.
  BOOST_TEST((reference.v - velocity).norm() < std::pow(0.98, 550));  // the limit of acceleration costs 50 of them at most
  Eigen::VectorXd change = f.rest;
  f.follower.write_change(request, Eigen::Vector2d(0.3, 0.0), change);
  BOOST_TEST((change - Eigen::Vector2d(-0.1, 0.2)).norm() < follower_rounding);
}

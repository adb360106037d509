// What joint limits and clearances leave of a velocity, alone.
#include <boost/test/unit_test.hpp>

#include "../../src/controller/velocity_bounds.hpp"
#include "support/stage_model.hpp"

using namespace sidestep;
using Output = ControllerSettings::Output;

namespace {

constexpr double bounds_rounding = 1e-14;  // of velocities near 1

/// The stage with an arm of two joints, position limits of ±2.5 rad, and one clearance that is written here.
struct Bounding {
  Bounding() : closing(test::no_closing(model)), seen(2, 1) {
    seen.nearest[0] = -1;
    seen.rates[0] = 0.0;
  }
  /// A clearance of h [m] with its gradient, and how fast it changes while the arm rests.
  void see(double h, const Eigen::Vector2d& gradient, double rate = 0.0) {
    seen.nearest[0] = 0;
    seen.values[0] = h;
    seen.gradients.col(0) = gradient;
    seen.rates[0] = rate;
  }
  Eigen::Vector2d keep(const Eigen::Vector2d& velocity, const Eigen::Vector2d& q) {
    Eigen::VectorXd wanted = Eigen::VectorXd::Zero(2);
    FrameJacobian projected = FrameJacobian::Zero(2, 6);
    projected.col(0) = Eigen::Vector2d(1.0, 2.0);
    bounds.begin();
    bounds.keep(velocity, q, {seen, rest, closing}, wanted, projected);
    left = projected.col(0);
    return wanted;
  }

  const ControllerModel model = test::stage_model(2, test::straight_settings(Output::position));
  const std::vector<Eigen::Index> clearances{0};
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(2);
  const double margin = model.settings.safety.margin;
  VelocityBounds bounds{model.arm.robot(), model.joints, model.settings, clearances};
  ClosingEstimate closing;
  Clearances seen;
  Eigen::Vector2d left;  // of a column of a Jacobian
};

const Eigen::Vector2d bounds_middle(0.0, 0.0);

}  // namespace

BOOST_AUTO_TEST_CASE(a_joint_may_move_on_by_three_times_its_distance_to_where_it_rests) {
  Bounding b;
  // Rest is 0.03 rad before the limit of 2.5.
  BOOST_TEST(std::abs(b.bounds.largest_speed(0, 2.37, true) - 0.3) < bounds_rounding);
  BOOST_TEST(std::abs(b.bounds.largest_speed(0, 2.37, false) - 3.0 * 4.84) < bounds_rounding * 10.0);  // near 15
  BOOST_TEST(b.bounds.largest_speed(0, 2.48, true) == 0.0);
  BOOST_TEST(b.bounds.largest_speed(1, -2.6, false) == 0.0);
}

BOOST_AUTO_TEST_CASE(a_joint_near_its_limit_is_held_and_the_others_go_on) {
  Bounding b;
  const Eigen::Vector2d kept = b.keep({1.0, 0.7}, {2.37, 0.0});
  BOOST_TEST((kept - Eigen::Vector2d(0.3, 0.7)).norm() < bounds_rounding);
  BOOST_TEST(b.bounds.first().joint == 0);
  BOOST_TEST(b.bounds.first().upper);
  BOOST_TEST((b.left == Eigen::Vector2d(0.0, 2.0)));  // what the held joint does is taken out
  BOOST_TEST((b.keep({-1.0, 0.7}, {2.37, 0.0}) == Eigen::Vector2d(-1.0, 0.7)));
  BOOST_TEST(b.bounds.first().joint == -1);
}

BOOST_AUTO_TEST_CASE(a_clearance_comes_to_its_margin_with_six_times_what_is_left_and_what_goes_along_it_stays) {
  Bounding b;
  BOOST_TEST((b.keep({-1.0, 0.7}, bounds_middle) == Eigen::Vector2d(-1.0, 0.7)));  // nothing is within reach
  b.see(b.margin + 0.02, {0.6, 0.8});
  const Eigen::Vector2d normal(0.6, 0.8), along(-0.8, 0.6), towards = -normal + 0.5 * along;
  BOOST_TEST((b.keep(towards, bounds_middle) + 0.12 * normal - 0.5 * along).norm() < bounds_rounding);
  BOOST_TEST(b.bounds.first().clearance == 0);
  BOOST_TEST(b.bounds.first().joint == -1);
  BOOST_TEST(std::abs(normal.dot(b.left)) < bounds_rounding);
  BOOST_TEST((b.keep(0.5 * along, bounds_middle) == 0.5 * along));
  // Of a gradient of half the length, twice the speed.
  b.see(b.margin + 0.02, 0.5 * normal);
  BOOST_TEST((b.keep(towards, bounds_middle) + 0.24 * normal - 0.5 * along).norm() < bounds_rounding);
}

BOOST_AUTO_TEST_CASE(what_comes_nearer_is_given_way_to_and_what_goes_away_is_not_followed) {
  Bounding b;
  b.see(b.margin, {1.0, 0.0}, -0.2);
  BOOST_TEST((b.keep({0.0, 0.0}, bounds_middle) - Eigen::Vector2d(0.2, 0.0)).norm() < bounds_rounding);
  b.see(b.margin, {1.0, 0.0}, 0.2);
  BOOST_TEST((b.keep({-0.5, 0.1}, bounds_middle) - Eigen::Vector2d(0.0, 0.1)).norm() < bounds_rounding);
}

BOOST_AUTO_TEST_CASE(a_joint_and_a_clearance_are_kept_at_once_and_a_direction_is_held_once) {
  Bounding b;
  b.see(b.margin + 0.02, {0.0, 1.0});
  BOOST_TEST((b.keep({1.0, -1.0}, {2.37, 0.0}) - Eigen::Vector2d(0.3, -0.12)).norm() < bounds_rounding);
  BOOST_TEST(b.bounds.first().clearance == 0);  // the worst: 0.88 too fast, the joint 0.7
  BOOST_TEST(b.left.norm() < bounds_rounding);
  FrameJacobian projected = FrameJacobian::Zero(2, 6);
  b.bounds.release_all();
  VelocityBounds::Bound same;
  same.joint = 0;
  same.least = 0.3;
  BOOST_TEST(b.bounds.hold(same, {b.seen, b.rest, b.closing}, 0, projected));
  BOOST_TEST(!b.bounds.hold(same, {b.seen, b.rest, b.closing}, 1, projected));
  BOOST_TEST((b.bounds.held_velocity() == Eigen::Vector2d(0.3, 0.0)));
}

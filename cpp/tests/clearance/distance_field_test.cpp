// Bounds against a plain scan of all points.
#include "sidestep/clearance/distance_field.hpp"

#include <boost/test/unit_test.hpp>
#include <limits>

#include "support/allocations.hpp"
#include "support/random_scene.hpp"

using namespace sidestep;
using test::Random;

namespace {

constexpr double coarsest = 0.07;  // [m] diagonal of a fine cell, 4 cm wide
constexpr double rounding = 3e-5;  // [m] of distances of some metres in single precision

double scanned(const Obstacles& obstacles, const Eigen::Vector3d& x) {
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index n = 0; n < obstacles.size(); ++n) {
    least = std::min(least, (obstacles.points().col(n) - x).norm() - obstacles.radii()[n]);
  }
  return least;
}

}  // namespace

BOOST_AUTO_TEST_CASE(bounds_are_below_the_distance_and_near_it_or_enough) {
  Random random(1);
  DistanceField field;
  for (int scene = 0; scene < 5; ++scene) {
    const Obstacles obstacles = test::random_obstacles(random, 200);
    field.follow(obstacles);
    for (int k = 0; k < 400; ++k) {
      const Eigen::Vector3d x = 2.0 * random.matrix(3, 1);
      const double distance = scanned(obstacles, x), enough = 0.3;
      BOOST_TEST(std::abs(distance_to_obstacles(x, obstacles, 100.0) - distance) < rounding);
      for (const double asked : {enough, std::numeric_limits<double>::infinity(), enough}) {
        const double bound = field.bound(x, asked, obstacles);
        BOOST_TEST(bound <= distance);
        BOOST_TEST(bound >= std::min(asked, distance - coarsest - rounding));
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(forgets_what_has_moved) {
  DistanceField field;
  Obstacles obstacles(Eigen::Vector3d(0.5, 0.0, 0.0), Eigen::VectorXd::Zero(1), Eigen::Vector3d(-1.0, 0.0, 0.0));
  const Eigen::Vector3d x = Eigen::Vector3d::Zero();
  constexpr double all = std::numeric_limits<double>::infinity();
  field.follow(obstacles);
  BOOST_TEST(std::abs(field.bound(x, all, obstacles) - 0.5) < coarsest + rounding);
  const Obstacles copy = obstacles;
  BOOST_TEST(copy.version() == obstacles.version());
  obstacles.advance(0.3);
  BOOST_TEST(copy.version() != obstacles.version());
  field.follow(obstacles);
  BOOST_TEST(std::abs(field.bound(x, all, obstacles) - 0.2) < coarsest + rounding);
  const Obstacles other(Eigen::Vector3d(0.0, 2.0, 0.0), Eigen::VectorXd::Zero(1), Eigen::Vector3d::Zero());
  field.follow(other);
  BOOST_TEST(std::abs(field.bound(x, all, other) - 2.0) < coarsest + rounding);
  field.follow(Obstacles::none());
  BOOST_TEST(field.bound(x, all, Obstacles::none()) > 1e6);
}

BOOST_AUTO_TEST_CASE(more_places_than_it_holds_and_places_far_away_are_measured) {
  const Obstacles obstacles(Eigen::Vector3d::Zero(), Eigen::VectorXd::Zero(1), Eigen::Vector3d::Zero());
  DistanceField field;
  field.follow(obstacles);
  constexpr double all = std::numeric_limits<double>::infinity();
  const std::size_t allocations = test::allocations_of([&] {
    for (int i = 1; i < 6000; ++i) {
      const double away = 0.2 * i;
      const double bound = field.bound(Eigen::Vector3d(0.0, away, 0.0), all, obstacles);
      BOOST_REQUIRE(bound <= away);
      BOOST_REQUIRE(bound > away * (1.0 - 3e-6) - coarsest - rounding);
    }
  });
  BOOST_TEST(allocations == 0);
  BOOST_TEST(std::abs(field.bound(Eigen::Vector3d(3e5, 0.0, 0.0), all, obstacles) - 3e5) < 1.0);
}

BOOST_AUTO_TEST_CASE(a_point_far_away_hides_none_that_is_near) {
  for (const double far : {1e4, 1e10, 1e300}) {
    Random random(2);
    Eigen::Matrix3Xd points = 0.3 * random.matrix(3, 300);
    points.col(7).setConstant(far);
    const Obstacles obstacles(points, Eigen::VectorXd::Zero(300), Eigen::Matrix3Xd::Zero(3, 300));
    for (int k = 0; k < 100; ++k) {
      const Eigen::Vector3d x = random.matrix(3, 1);
      BOOST_TEST(std::abs(distance_to_obstacles(x, obstacles, 100.0) - scanned(obstacles, x)) < rounding);
    }
  }
}

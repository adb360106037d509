// Places around which clearances are known: values against queries, and what makes a place old.
#include "../../src/guard/checked_places.hpp"

#include <boost/test/unit_test.hpp>

#include "support/allocations.hpp"
#include "support/planar_arm.hpp"
#include "support/random.hpp"

using namespace sidestep;
using test::Random;

namespace {

constexpr double spacing = 0.001;
constexpr double all = 1.0;  // The cap of CheckedPlaces [m], as exact as it is.

Obstacles point_at(double x, double y) {
  return Obstacles(Eigen::Vector3d(x, y, 0.0), Eigen::VectorXd::Constant(1, 0.02), Eigen::Vector3d::Zero());
}

struct Checked {
  ClearanceQuery body = test::planar_arm_body();
  ClearanceQuery::Workspace workspace{body};
  CheckedPlaces places{body, spacing};
  Eigen::VectorXd floors = Eigen::VectorXd::Constant(body.num_items(), 0.001);

  double left_at(const Eigen::Vector2d& q, const Obstacles& obstacles) {
    return places.distance_left_at(q, obstacles, floors, workspace);
  }
  double exact(const Eigen::Vector2d& q, const Obstacles& obstacles) {
    return body.distance_left(q, obstacles, floors, all, all, workspace);
  }
};

}  // namespace

BOOST_AUTO_TEST_CASE(a_place_serves_its_neighbours_by_the_reach) {
  Checked checked;
  const Obstacles obstacles = point_at(0.3, 0.3);
  checked.places.begin_step();
  const Eigen::Vector2d q(0.0, 0.0), near(0.01, -0.02);
  const double there = checked.left_at(q, obstacles);
  BOOST_TEST(there > 0.1);
  BOOST_TEST(there <= checked.exact(q, obstacles));  // a lower bound
  const std::int64_t checks = checked.workspace.checks();
  const Eigen::VectorXd& reach = checked.body.reach();
  BOOST_TEST(std::abs(checked.left_at(near, obstacles) - (there - 0.01 * reach[0] - 0.02 * reach[1])) < 1e-12);
  BOOST_TEST(checked.workspace.checks() == checks);  // without a query
}

BOOST_AUTO_TEST_CASE(what_the_places_say_is_never_more_than_there_is) {
  Checked checked;
  Random random(3);
  const Obstacles obstacles = point_at(0.35, 0.1);
  for (int trial = 0; trial < 2000; ++trial) {
    checked.places.begin_step();
    const Eigen::Vector2d q(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0));
    const double left = checked.left_at(q, obstacles), truth = checked.exact(q, obstacles);
    BOOST_REQUIRE(left <= std::max(truth, 0.0) + spacing + 1e-9);  // a place serves for the spacing at least
    BOOST_REQUIRE((truth >= 0.0 || left < spacing));
  }
}

BOOST_AUTO_TEST_CASE(stale_places_are_checked_again_a_few_in_a_step) {
  Checked checked;
  const Obstacles far = point_at(5.0, 0.0), in_the_way = point_at(0.3, 0.0);
  const Eigen::Vector2d q(0.0, 0.0);
  checked.places.begin_step();
  const auto rounding = boost::test_tools::tolerance(1e-12);  // of a floor that is added and subtracted
  BOOST_TEST(checked.left_at(q, far) == all, rounding);
  BOOST_TEST(checked.left_at(q, in_the_way) == all, rounding);  // not told that anything moved
  checked.places.invalidate();
  checked.places.begin_step();
  BOOST_TEST(checked.left_at(q, in_the_way) < 0.0);
  checked.places.invalidate();
  BOOST_TEST(checked.left_at(q, far) > 0.0);  // where it was not free there is no place
  checked.places.clear();
  BOOST_TEST(checked.left_at(q, in_the_way) < 0.0);
}

BOOST_AUTO_TEST_CASE(asking_allocates_nothing) {
  Checked checked;
  const Obstacles obstacles = point_at(0.3, 0.3);
  Eigen::VectorXd q = Eigen::VectorXd::Zero(2);
  static_cast<void>(checked.places.distance_left_at(q, obstacles, checked.floors, checked.workspace));
  BOOST_TEST(test::allocations_of([&] {
               for (int n = 0; n < 2 * CheckedPlaces::capacity; ++n) {
                 q[0] = 0.001 * n;
                 static_cast<void>(checked.places.distance_left_at(q, obstacles, checked.floors, checked.workspace));
               }
             }) == 0u);
}

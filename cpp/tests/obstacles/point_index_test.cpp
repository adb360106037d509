// The index against a plain scan of all points.
#include "sidestep/obstacles/point_index.hpp"

#include <boost/test/unit_test.hpp>
#include <set>

#include "support/allocations.hpp"
#include "support/random_scene.hpp"

using namespace sidestep;
using test::Random;

namespace {

std::set<int> scanned(const Obstacles& obstacles, const Eigen::Vector3d& centre, double distance) {
  std::set<int> found;
  for (Eigen::Index k = 0; k < obstacles.size(); ++k) {
    if ((obstacles.points().col(k) - centre).norm() <= distance + obstacles.radii()[k]) {
      found.insert(static_cast<int>(k));
    }
  }
  return found;
}

}  // namespace

BOOST_AUTO_TEST_CASE(finds_exactly_the_points_of_a_plain_scan) {
  Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const Obstacles obstacles = test::random_obstacles(random, random.integer(1, 300));
    const PointIndex index(obstacles, trial % 3 == 0 ? random.magnitude(0.005, 5.0) : 0.0);
    BOOST_TEST(index.size() == obstacles.size());
    for (int query = 0; query < 20; ++query) {
      const Eigen::Vector3d centre = 0.6 * random.matrix(3, 1);
      const double distance = query == 0 ? -0.01 : random.magnitude(1e-3, 2.0);
      const std::set<int> expected = scanned(obstacles, centre, distance);
      std::set<int> found;
      int visits = 0;
      index.for_each_within(centre, distance, [&](const PointIndex::Point& p) {
        ++visits;
        found.insert(p.index);
        BOOST_TEST(p.x == obstacles.points()(0, p.index));
        BOOST_TEST(p.radius == obstacles.radii()[p.index]);
        return false;
      });
      BOOST_TEST(found == expected);
      BOOST_TEST(visits == static_cast<int>(expected.size()));  // each once
      BOOST_TEST(index.any_within(centre, distance) == !expected.empty());
    }
  }
}

BOOST_AUTO_TEST_CASE(a_plane_a_line_and_one_point_have_an_index) {
  for (const int dimensions : {0, 1, 2}) {
    Random random(2);
    Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 50);
    points.topRows(dimensions) = random.matrix(dimensions, 50);
    const Obstacles obstacles(points, Eigen::VectorXd::Zero(50), Eigen::Matrix3Xd::Zero(3, 50));
    const PointIndex index(obstacles);
    int visits = 0;
    index.for_each_within(Eigen::Vector3d::Zero(), 100.0, [&](const PointIndex::Point&) { return ++visits, false; });
    BOOST_TEST(visits == 50);
    BOOST_TEST(!index.any_within(Eigen::Vector3d(0.0, 0.0, 2.0), 1.5));
    BOOST_TEST(!index.any_within(Eigen::Vector3d::Constant(1e300), 1.5));  // far beyond what an int holds
  }
}

BOOST_AUTO_TEST_CASE(a_free_workspace_has_nothing_near) {
  const PointIndex index(Obstacles::none());
  BOOST_TEST(index.size() == 0);
  BOOST_TEST(!index.any_within(Eigen::Vector3d::Zero(), 1e6));
}

BOOST_AUTO_TEST_CASE(a_place_that_is_not_a_number_finds_nothing) {
  Random random(3);
  const PointIndex index(test::random_obstacles(random, 10));
  BOOST_TEST(!index.any_within(Eigen::Vector3d::Constant(std::nan("")), 1.0));
}

BOOST_AUTO_TEST_CASE(cells_are_bounded_in_number) {
  Eigen::Matrix3Xd points(3, 2);
  points << 0.0, 1e4, 0.0, 1e4, 0.0, 1e4;
  const PointIndex index(Obstacles(points, Eigen::VectorXd::Zero(2), Eigen::Matrix3Xd::Zero(3, 2)), 0.01);
  BOOST_TEST(index.cell() > 0.01);
  BOOST_TEST(index.any_within(Eigen::Vector3d::Constant(1e4), 0.0));
  BOOST_CHECK_THROW(PointIndex(Obstacles::none(), -1.0), std::invalid_argument);
}

BOOST_AUTO_TEST_CASE(queries_allocate_nothing) {
  Random random(4);
  const PointIndex index(test::random_obstacles(random, 500));
  bool near = false;
  const std::size_t allocations =
      test::allocations_of([&] { near = index.any_within(Eigen::Vector3d::Zero(), 0.5); });
  BOOST_TEST(near);
  BOOST_TEST(allocations == 0);
}

// The nearest point against a plain scan of all points.
#include "sidestep/scene/point_tree.hpp"

#include <boost/test/unit_test.hpp>

#include "support/allocations.hpp"
#include "support/random_scene.hpp"

using namespace sidestep;
using test::Random;

namespace {

constexpr double single = 1e-6;  // [m] rounding of distances of some metres

double scanned(const Obstacles& obstacles, const Eigen::Vector3d& place, double limit) {
  for (Eigen::Index n = 0; n < obstacles.size(); ++n) {
    limit = std::min(limit, (obstacles.points().col(n) - place).norm() - obstacles.radii()[n]);
  }
  return limit;
}

/// Distance of a place from what is in a box, or a ball.
double measured(const Boxes& boxes, int n, const Eigen::Vector3d& place) {
  const Eigen::Vector3d offset = place - Eigen::Vector3d(boxes.x[n], boxes.y[n], boxes.z[n]);
  const Eigen::Vector3d half(boxes.half_x[n], boxes.half_y[n], boxes.half_z[n]);
  return (offset.cwiseAbs() - half).cwiseMax(0.0).norm() - boxes.radius[n];
}
double measured(const Balls& balls, int n, const Eigen::Vector3d& place) {
  return (Eigen::Vector3d(balls.x[n], balls.y[n], balls.z[n]) - place).norm() - balls.radius[n];
}

/// Nearest to a place; `looked` counts the balls and boxes that were measured.
PointTree::Nearest nearest(const PointTree& tree, const Eigen::Vector3d& place, double limit, double stop, int& looked) {
  return tree.nearest(limit, stop, [&](const auto& nodes, int first, int count, double least, float* values) {
    unsigned near = 0;
    for (int i = 0; i < count; ++i) {
      values[i] = static_cast<float>(measured(nodes, first + i, place));
      near |= (values[i] < least ? 1u : 0u) << i;
    }
    looked += count;
    return near;
  });
}

}  // namespace

BOOST_AUTO_TEST_CASE(finds_the_nearest_point_of_a_plain_scan) {
  Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    Obstacles obstacles = test::random_obstacles(random, random.integer(1, 3000));
    if (trial % 2 == 1) {
      obstacles.advance(random.uniform(0.0, 2.0));
    }
    const PointTree& tree = obstacles.tree();
    BOOST_TEST(tree.size() == obstacles.size());
    for (int query = 0; query < 20; ++query) {
      const Eigen::Vector3d place = 0.6 * random.matrix(3, 1);
      const double limit = query == 0 ? -0.01 : random.magnitude(1e-3, 10.0);
      int looked = 0;
      const PointTree::Nearest found = nearest(tree, place, limit, -10.0, looked);
      BOOST_TEST(std::abs(found.distance - scanned(obstacles, place, limit)) < single);
      BOOST_TEST((found.point >= 0) == (found.distance < limit));
      if (found.point >= 0) {
        const int n = tree.order()[static_cast<std::size_t>(found.point)];
        BOOST_TEST(std::abs((obstacles.points().col(n) - place).norm() - obstacles.radii()[n] - found.distance) < single);
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(looks_at_few_points_and_stops_when_told) {
  Random random(2);
  const Obstacles obstacles(random.matrix(3, 20000), Eigen::VectorXd::Zero(20000), Eigen::Matrix3Xd::Zero(3, 20000));
  int looked = 0;
  nearest(obstacles.tree(), Eigen::Vector3d(0.3, 0.2, 0.1), 10.0, -10.0, looked);
  BOOST_TEST(looked < 2000);  // a tenth of a scan
  int stopped = 0;
  BOOST_TEST(nearest(obstacles.tree(), Eigen::Vector3d(0.3, 0.2, 0.1), 10.0, 10.0, stopped).distance < 10.0);
  BOOST_TEST(stopped < looked);
}

BOOST_AUTO_TEST_CASE(a_plane_a_line_and_one_point_have_a_tree) {
  for (const int dimensions : {0, 1, 2}) {
    Random random(2);
    Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 50);
    points.topRows(dimensions) = random.matrix(dimensions, 50);
    const Obstacles obstacles(points, Eigen::VectorXd::Zero(50), Eigen::Matrix3Xd::Zero(3, 50));
    int looked = 0;
    for (const Eigen::Vector3d& place : {Eigen::Vector3d(0.0, 0.0, 2.0), Eigen::Vector3d(1e300, 0.0, 0.0)}) {
      BOOST_TEST(nearest(obstacles.tree(), place, 1e6, -1.0, looked).distance ==
                 static_cast<float>(scanned(obstacles, place, 1e6)));
    }
  }
}

BOOST_AUTO_TEST_CASE(no_points_and_no_place_find_nothing) {
  int looked = 0;
  BOOST_TEST(nearest(Obstacles::none().tree(), Eigen::Vector3d::Zero(), 1e6, 0.0, looked).point == -1);
  Random random(3);
  const Obstacles obstacles = test::random_obstacles(random, 10);
  BOOST_TEST(nearest(obstacles.tree(), Eigen::Vector3d::Constant(std::nan("")), 1.0, 0.0, looked).point == -1);
}

BOOST_AUTO_TEST_CASE(queries_allocate_nothing) {
  Random random(4);
  const Obstacles obstacles = test::random_obstacles(random, 500);
  int looked = 0, found = -1;
  const std::size_t allocations =
      test::allocations_of([&] { found = nearest(obstacles.tree(), Eigen::Vector3d::Zero(), 1.0, -1.0, looked).point; });
  BOOST_TEST(found >= 0);
  BOOST_TEST(allocations == 0);
}

BOOST_AUTO_TEST_CASE(joined_sets_are_one_tree_whose_parts_move_by_themselves) {
  Random random(5);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<Obstacles> sets;
    for (int k = 0; k < 4; ++k) {
      sets.push_back(k == 1 ? Obstacles::none() : test::random_obstacles(random, random.integer(1, 1200)));
    }
    Obstacles joined = Obstacles::join({&sets[0], &sets[1], &sets[2], &sets[3]});
    BOOST_REQUIRE(joined.num_parts() == 4u);
    joined.advance(2, 0.3);
    sets[2].advance(0.3);
    joined.freeze(3);
    sets[3] = sets[3].frozen();
    joined.advance(0.2);
    for (Obstacles& set : sets) {
      set.advance(0.2);
    }
    if (trial % 2 == 1) {
      joined.hide(0);
      sets[0] = Obstacles::none();
    }
    for (int query = 0; query < 20; ++query) {
      const Eigen::Vector3d place = 0.6 * random.matrix(3, 1);
      double least = 10.0;
      for (const Obstacles& set : sets) {
        least = scanned(set, place, least);
      }
      int looked = 0;
      const PointTree::Nearest found = nearest(joined.tree(), place, 10.0, -10.0, looked);
      BOOST_TEST(std::abs(found.distance - least) < single);
      if (found.point >= 0) {
        const int n = joined.tree().order()[static_cast<std::size_t>(found.point)];
        BOOST_TEST(std::abs((joined.points().col(n) - place).norm() - joined.radii()[n] - found.distance) < single);
        BOOST_TEST(joined.part_begin(joined.part_of(n)) <= n);
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(the_order_is_said_to_be_the_usual_one_only_where_it_is) {
  Random random(12);
  const Eigen::Index num = 500;
  Eigen::Matrix3Xd points(3, num), some = Eigen::Matrix3Xd::Zero(3, num), others = some;
  for (Eigen::Index n = 0; n < num; ++n) {
    points.col(n) = random.vector(3);
    some.col(n) = n % 3 == 0 ? Eigen::Vector3d(random.vector(3)) : Eigen::Vector3d::Zero();
    others.col(n) = n % 7 == 0 ? Eigen::Vector3d(random.vector(3)) : Eigen::Vector3d::Zero();
  }
  const Eigen::VectorXd radii = Eigen::VectorXd::Constant(num, 0.01), uncertainty = Eigen::VectorXd::Constant(num, 0.1);
  const Obstacles rest(points, radii, Eigen::Matrix3Xd::Zero(3, num)), moving(points, radii, some);
  BOOST_TEST(rest.tree().is_in_usual_order());
  BOOST_TEST(moving.tree().is_in_usual_order());
  BOOST_TEST((moving.tree().order() != rest.tree().order()));
  const Obstacles found = rest.moving(some, uncertainty);
  BOOST_TEST(found.tree().is_in_usual_order());
  BOOST_TEST((found.tree().order() == moving.tree().order()));
  BOOST_TEST(moving.moving(some, uncertainty).tree().is_in_usual_order());
  const Obstacles other = moving.moving(others, uncertainty);  // those that moved before stand behind
  BOOST_TEST(!other.tree().is_in_usual_order());
  BOOST_TEST((other.tree().order() != Obstacles(points, radii, others).tree().order()));
  Obstacles moved = moving;
  BOOST_TEST(moved.advance(0.5));
  BOOST_TEST(!moved.tree().is_in_usual_order());
  BOOST_TEST(!moving.frozen().tree().is_in_usual_order());
  BOOST_TEST(rest.frozen().tree().is_in_usual_order());
  Obstacles still = rest;
  BOOST_TEST(still.advance(0.5));
  BOOST_TEST(still.tree().is_in_usual_order());
  BOOST_TEST(!Obstacles::join({&rest, &moving}).tree().is_in_usual_order());
  still.hide(0);
  BOOST_TEST(!still.tree().is_in_usual_order());
}

BOOST_AUTO_TEST_CASE(points_get_other_velocities_and_say_how_uncertain_they_are) {
  const Obstacles ball(Eigen::Vector3d::Zero(), Eigen::VectorXd::Constant(1, 0.1), Eigen::Vector3d::Zero());
  Obstacles moving = ball.moving(Eigen::Vector3d(1.0, 0.0, 0.0), Eigen::VectorXd::Constant(1, 0.5));
  BOOST_TEST(moving.uncertainty()[0] == 0.5);
  BOOST_TEST(ball.uncertainty()[0] == 0.0);
  BOOST_TEST(moving.advance(0.2));
  int looked = 0;
  BOOST_TEST(std::abs(nearest(moving.tree(), Eigen::Vector3d(1.2, 0.0, 0.0), 10.0, -1.0, looked).distance - 0.9) < single);
  BOOST_CHECK_THROW(ball.moving(Eigen::Vector3d::Zero(), Eigen::VectorXd::Constant(1, -0.1)), std::invalid_argument);
  BOOST_CHECK_THROW(ball.moving(Eigen::Matrix3Xd::Zero(3, 2), Eigen::VectorXd::Zero(1)), std::invalid_argument);
}

// What velocity estimates are made of: lines, rigid motions, registrations, and the memory of what rests.
#include <Eigen/Geometry>
#include <boost/test/unit_test.hpp>

#include "../../src/scene/line_fit.hpp"
#include "../../src/scene/registration.hpp"
#include "../../src/scene/rest_memory.hpp"
#include "../../src/scene/rigid_motion.hpp"
#include "support/random.hpp"

using namespace sidestep;
using test::Random;

BOOST_AUTO_TEST_CASE(a_line_fit_has_the_slope_of_least_squares_and_its_scatter) {
  LineFit<3>::Positions positions = LineFit<3>::Positions::Zero();
  positions.row(0) << 3.0, 2.0, 1.0, 0.0, 0.0, 0.0;
  positions.row(1) << 0.1, -0.1, -0.1, 0.1, 0.0, 0.0;  // across the line, without a slope
  const LineFit<3> line(positions, {0.0, -1.0, -2.0, -3.0}, 4);
  BOOST_TEST((line.velocity - Eigen::Vector3d::UnitX()).norm() < 1e-12);
  BOOST_TEST(std::abs(line.spread - std::sqrt(5.0)) < 1e-12);
  BOOST_TEST(std::abs(line.scatter - std::sqrt(0.04 / 6.0)) < 1e-12);  // 3 · (4 − 2) degrees of freedom
  BOOST_TEST((line.at(1.0) - Eigen::Vector3d(4.0, 0.0, 0.0)).norm() < 1e-12);
  BOOST_TEST(is_motion(line, 4, 0.0, false));
  BOOST_TEST(!is_motion(line, 4, 0.6, false));  // 5 m² are less than 16.3 · 0.6² m²
}

BOOST_AUTO_TEST_CASE(scatter_is_a_motion_as_seldom_as_the_test_says) {
  Random random(1);
  int strict = 0, easy = 0;
  constexpr int trials = 20000;
  for (int k = 0; k < trials; ++k) {
    const LineFit<3> line(random.matrix(3, most_sets), {0.0, -1.0, -2.0, -3.0, -4.0, -5.0}, 5);
    strict += is_motion(line, 5, 0.0, false);
    easy += is_motion(line, 5, 0.0, true);
  }
  BOOST_TEST(std::abs(strict / double(trials) - 0.005) < 0.002);  // four standard deviations of the count
  BOOST_TEST(std::abs(easy / double(trials) - 0.025) < 0.005);
}

BOOST_AUTO_TEST_CASE(a_rigid_motion_is_found_again) {
  Random random(2);
  for (const int num : {1, 2, 3, 20}) {
    const Eigen::Matrix3Xd from = random.matrix(3, num);
    const Eigen::AngleAxisd turn(0.3, Eigen::Vector3d(random.vector(3)).normalized());
    const Eigen::Vector3d middle = from.rowwise().mean(), shift = random.vector(3);
    const Eigen::Matrix3Xd to = (turn.toRotationMatrix() * (from.colwise() - middle)).colwise() + (middle + shift);
    const RigidMotion motion(from, to);
    BOOST_TEST((motion.translation - shift).norm() < 1e-12);
    BOOST_TEST(motion.residual.maxCoeff() < 1e-7);
    if (num > 2) {
      BOOST_TEST((motion.rotation - 0.3 * turn.axis()).norm() < 1e-7);
    } else {
      BOOST_TEST(motion.rotation.norm() < 0.3 + 1e-9);  // the smallest that does it
    }
  }
}

BOOST_AUTO_TEST_CASE(a_registration_finds_the_shift_of_other_points_of_the_same_ball) {
  Random random(3);
  const auto ball = [&] { return Eigen::Matrix3Xd(0.1 * Eigen::Matrix3Xd(random.matrix(3, 800)).colwise().normalized()); };
  const Eigen::Vector3d shift(0.015, -0.01, 0.005);
  const PointGrid earlier(ball().colwise() + shift);
  const Registration found = register_points(ball(), earlier, Eigen::Vector3d::Zero(), 12);
  BOOST_TEST((found.shift - shift).norm() < 0.002);  // points of 800 on a ball are 1.2 cm apart
  BOOST_TEST(found.found == 1.0);
  const Registration away = register_points(ball(), earlier, Eigen::Vector3d(0.5, 0.0, 0.0), 3);
  BOOST_TEST(!away.is_known());
  BOOST_TEST(away.cost == 1.0);
}

BOOST_AUTO_TEST_CASE(points_farther_apart_than_two_cells_are_two_clusters) {
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 4);
  points.row(0) << 0.0, 0.02, 0.5, 0.51;
  const PointGrid grid(points);
  BOOST_TEST(grid.clusters({0, 0, 0, 0}).size() == 2u);
  BOOST_TEST(grid.clusters({0, 0, 1, 1}).size() == 1u);
  BOOST_TEST(grid.nearest({0.49, 0.0, 0.0}).point == 2);
  BOOST_TEST(grid.nearest({0.25, 0.0, 0.0}).point == -1);
  BOOST_TEST(grid.nearest({1e300, 0.0, 0.0}).point == -1);
}

BOOST_AUTO_TEST_CASE(a_place_is_remembered_as_long_as_something_rests_there) {
  RestMemory memory;
  const Eigen::Vector3d place(0.31, 0.11, 0.01);
  for (int k = 0; k < 5; ++k) {
    memory.begin(0.1 * k, 0.35, 10);
    BOOST_TEST(memory.at(place).sets == k);
    BOOST_TEST(memory.at(place + Eigen::Vector3d(0.0, 0.0, 0.05)).sets == 0);
    memory.rests(place, true);
  }
  BOOST_TEST(std::abs(memory.at(place).age - 0.4) < 1e-12);
  memory.begin(0.5, 0.35, 10);
  memory.moves(place);
  BOOST_TEST(memory.at(place).sets == 0);
  memory.rests(place, false);
  memory.begin(0.6, 0.35, 10);
  memory.rests(place, false);  // not certain: not seen again
  memory.begin(0.9, 0.35, 10);
  BOOST_TEST(memory.at(place).sets == 0);
}

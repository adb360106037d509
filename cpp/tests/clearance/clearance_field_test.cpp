// The field, with every instruction set of this machine, against the plain sum over all points one by one.
#include "sidestep/clearance/clearance_field.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "sidestep/clearance/boltzmann_mean.hpp"
#include "sidestep/math/instruction_set.hpp"
#include "support/every_instruction_set.hpp"
#include "support/numbers.hpp"
#include "support/random_scene.hpp"
#include "support/serial_arm.hpp"

using namespace sidestep;
using test::Random;

namespace {

constexpr double temperature = 0.002;

/// Gradient, and what of the second derivative the motion's velocity makes.
struct Distance {
  double value, bend;
  Eigen::Vector3d gradient;
};

/// The distance to the ellipsoid y S⁻¹ y ≤ 1, by halving the interval of its multiplier t.
Distance outside(const Eigen::Matrix3d& S, const Eigen::Vector3d& e, const Eigen::Vector3d& v) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(S);
  const Eigen::Vector3d A = principal.eigenvalues(), along = principal.eigenvectors().transpose() * e;
  const auto excess = [&](double t) {
    double sum = -1.0;
    for (int i = 0; i < 3; ++i) {
      sum += A[i] * (along[i] / (A[i] + t)) * (along[i] / (A[i] + t));
    }
    return sum;
  };
  double low = 0.0, high = 1.0;
  while (excess(high) > 0.0) {
    high *= 2.0;
  }
  while (low < 0.5 * (low + high) && 0.5 * (low + high) < high) {
    (excess(0.5 * (low + high)) > 0.0 ? low : high) = 0.5 * (low + high);
  }
  const Eigen::Matrix3d M = S + low * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d w = M.ldlt().solve(e), n = w.normalized();
  const Eigen::Vector3d slope = M.ldlt().solve(S * w);
  const Eigen::Vector3d w_dot = M.ldlt().solve(v - w * (slope.dot(v) / slope.dot(w)));
  return {low * w.norm(), v.dot(w_dot - n * n.dot(w_dot)) / w.norm(), n};
}

/// h = (m − √m)/|u|, differentiated term by term.
Distance inside(const Eigen::Matrix3d& S, const Eigen::Vector3d& e, const Eigen::Vector3d& v) {
  const Eigen::Matrix3d precision = S.inverse();
  const Eigen::Vector3d u = precision * e, u_dot = precision * v;
  const double root = std::sqrt(e.dot(u)), norm = u.norm();
  const double value = root * (root - 1.0) / norm;
  const Eigen::Vector3d gradient = (u * (2.0 - 1.0 / root) - (value / norm) * (precision * u)) / norm;
  const double m_dot = 2.0 * u.dot(v), m_ddot = 2.0 * v.dot(u_dot);
  const double root_dot = m_dot / (2.0 * root), root_ddot = (m_ddot - 2.0 * root_dot * root_dot) / (2.0 * root);
  const double norm_dot = u.dot(u_dot) / norm, norm_ddot = (u_dot.squaredNorm() - norm_dot * norm_dot) / norm;
  return {value, (m_ddot - root_ddot - 2.0 * gradient.dot(v) * norm_dot - value * norm_ddot) / norm, gradient};
}

/// The clearance of a point with its derivatives along the motion of point and link.
ClearanceSample sample(const BodyEllipsoid& ellipsoid, const KinematicState::Link& link, const Eigen::Vector3d& x,
                       const Eigen::Vector3d& x_dot, double radius) {
  const Eigen::Vector3d slip = x_dot - link.velocity.linear - link.velocity.angular.cross(x);
  const Eigen::Vector3d slip_dot =
      -link.bias.linear - link.bias.angular.cross(x) - link.velocity.angular.cross(x_dot) - link.velocity.angular.cross(slip);
  const Eigen::Matrix3d R_LW = link.R_WL.transpose();
  const Eigen::Vector3d e = R_LW * (x - link.p_WL) - ellipsoid.mean;
  const Eigen::Vector3d e_dot = R_LW * slip, e_ddot = R_LW * slip_dot;
  const bool is_outside = e.dot(ellipsoid.shape.ldlt().solve(e)) >= 1.0;
  const Distance h = is_outside ? outside(ellipsoid.shape, e, e_dot) : inside(ellipsoid.shape, e, e_dot);
  const Eigen::Vector3d f = link.R_WL * h.gradient;
  return {h.value - radius, h.gradient.dot(e_dot), h.gradient.dot(e_ddot) + h.bend, {{-x.cross(f), -f}, {}}};
}

Body calibrated(const Body& body, Random& random) {
  Eigen::VectorXd levels(body.num_components());
  for (Eigen::Index k = 0; k < levels.size(); ++k) {
    levels[k] = random.uniform(0.01, 0.1);
  }
  return Body(body.links, body.weights, body.means, body.covariances, levels);
}

void compare(const Robot& robot, const Body& body, const KinematicState& state, const Obstacles& obstacles, double reach,
             double horizon, double window = ClearanceField::default_window) {
  const ClearanceField field(robot, body, temperature, window);
  Clearances found(robot.num_coordinates(), field.size());
  // Beyond what can be closed within the horizon by as much as is looked at anyway: all that is within reach is found.
  field.evaluate(state, obstacles, reach, {horizon, reach}, found.view(0, field.size()));
  int k = 0;
  for (const BodyEllipsoid& ellipsoid : body_ellipsoids(robot, body, "test")) {
    if (ellipsoid.joint < 0) {
      continue;
    }
    const KinematicState::Link& link = state.link(ellipsoid.joint);
    std::vector<ClearanceSample> samples;
    const auto after = [horizon](const ClearanceSample& at) { return at.value + horizon * at.rate; };
    double least = test::infinity, least_after = test::infinity;
    for (int n = 0; n < obstacles.size(); ++n) {
      samples.push_back(
          sample(ellipsoid, link, obstacles.points().col(n), obstacles.velocities().col(n), obstacles.radii()[n]));
      least = std::min(least, samples.back().value);
      least_after = std::min(least_after, after(samples.back()));
    }
    BoltzmannMean mean(temperature), of_all(temperature);
    StoppingClearance ahead(temperature, horizon);
    int nearest = -1;
    for (int n = 0; n < obstacles.size(); ++n) {
      const ClearanceSample& at = samples[static_cast<std::size_t>(n)];
      of_all.add(at);
      if (after(at) < least_after + ClearanceField::window_ahead * temperature) {
        ahead.add(at);
      }
      if (at.value < least + window * temperature && mean.add(at)) {
        nearest = n;
      }
    }
    const ClearanceSample expected = mean.result();
    // Every point beyond the window would change the mean by x e^-x temperatures, where x is at least the window.
    const double all_beyond = static_cast<double>(obstacles.size()) * window * std::exp(-window) * temperature;
    BOOST_TEST(std::abs(expected.value - of_all.result().value) <= all_beyond + 1e-12 * (1.0 + std::abs(expected.value)));
    // 1e-12 of what is summed: clearances of up to 1 m, whose rates and curvatures are divided by the temperature.
    constexpr double tolerance = 1e-12;
    if (horizon == 0.0 || expected.value < reach) {  // else it may be found, with a link that moves
      BOOST_REQUIRE_EQUAL(found.nearest[k], expected.value < reach ? nearest : -1);
    }
    if (expected.value < reach) {
      Eigen::VectorXd gradient = Eigen::VectorXd::Zero(robot.num_coordinates());
      accumulate_generalised_force(state, ellipsoid.joint, expected.gradient.first, gradient);
      BOOST_TEST(std::abs(found.values[k] - expected.value) <= tolerance * (1.0 + std::abs(expected.value)));
      BOOST_TEST(std::abs(found.rates[k] - expected.rate) <= tolerance / temperature * (1.0 + std::abs(expected.rate)));
      BOOST_TEST(std::abs(found.curvatures[k] - expected.curvature) <=
                 tolerance / temperature * (1.0 / temperature + std::abs(expected.curvature)));
      BOOST_TEST((found.gradients.col(k) - gradient).norm() <= tolerance / temperature * (1.0 + gradient.norm()));
    }
    // Of samples whose clearance after a stop is below the reach, all that weigh are looked at.
    const ClearanceSample approach = ahead.result();
    if (after(approach) + ClearanceField::window_ahead * temperature < reach) {
      Eigen::VectorXd turned = Eigen::VectorXd::Zero(robot.num_coordinates());
      accumulate_generalised_force(state, ellipsoid.joint, approach.gradient.first, turned);
      // Weights feel rates, which are summed with more terms than clearances; curvatures go with their squares.
      const double scale = 1.0 + horizon * std::abs(approach.rate) + std::abs(approach.value);
      BOOST_TEST(std::abs(found.approach.values[k] - approach.value) <= tolerance / temperature * scale);
      BOOST_TEST(std::abs(found.approach.rates[k] - approach.rate) <=
                 tolerance / temperature * scale * (1.0 + std::abs(approach.rate)));
      BOOST_TEST(std::abs(found.approach.curvatures[k] - approach.curvature) <=
                 tolerance / temperature * scale * (1.0 / temperature + std::abs(approach.curvature)));
      BOOST_TEST((found.approach.gradients.col(k) - turned).norm() <= tolerance / temperature * scale * (1.0 + turned.norm()));
    }
    ++k;
  }
}

}  // namespace

BOOST_AUTO_TEST_CASE(every_instruction_set_agrees_with_the_plain_sum) {
  for (const InstructionSet set : test::EveryInstructionSet()) {
    BOOST_TEST_CONTEXT(name(set)) {
      Random random(3);
      for (const int num_points : {1, 7, 16, 17, 150, 1500}) {
        for (int trial = 0; trial < (num_points < 100 ? 5 : 1); ++trial) {
          const Robot robot = test::random_tree(random, 7);
          const Body body = calibrated(test::random_body(random, robot), random);
          KinematicState state(robot);
          state.update(robot, random.vector(robot.num_coordinates()), random.vector(robot.num_coordinates()));
          const Obstacles obstacles = test::random_obstacles(random, num_points);
          for (const double reach : {-0.01, 0.1, 0.5}) {
            compare(robot, body, state, obstacles, reach, 0.0);
            compare(robot, body, state, obstacles, reach, 0.2);
            compare(robot, body, state, obstacles, reach, 0.2, 24.0);
            compare(robot, body, state, obstacles.frozen(), reach, 0.1);
          }
          Obstacles moved = obstacles;
          moved.advance(0.3);
          compare(robot, body, state, moved, 0.3, 0.05);
        }
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(what_touches_is_found_by_balls_inside) {
  Random random(4);
  int touching = 0;
  constexpr int trials = 300;
  for (int trial = 0; trial < trials; ++trial) {
    const Robot robot = test::random_tree(random, 7);
    const Body body = calibrated(test::random_body(random, robot), random);
    const ClearanceField field(robot, body, temperature);
    KinematicState state(robot);
    state.update(robot, random.vector(robot.num_coordinates()), Eigen::VectorXd::Zero(robot.num_coordinates()));
    const Obstacles obstacles = test::random_obstacles(random, 1 + trial % 40);
    const double depth = random.uniform(-0.05, 0.05);
    bool expected = false;
    for (const BodyEllipsoid& ellipsoid : body_ellipsoids(robot, body, "test")) {
      if (ellipsoid.joint < 0) {
        continue;
      }
      const KinematicState::Link& link = state.link(ellipsoid.joint);
      const double inside = std::sqrt(ellipsoid.shape.eigenvalues().real().minCoeff());
      for (int n = 0; n < obstacles.size(); ++n) {
        const double distance = (obstacles.points().col(n) - link.p_WL - link.R_WL * ellipsoid.mean).norm();
        expected = expected || distance < inside + obstacles.radii()[n] - depth;
      }
    }
    BOOST_TEST(field.touches(state, obstacles, depth) == expected);
    touching += expected;
  }
  BOOST_TEST(touching > trials / 10);
  BOOST_TEST(touching < trials - trials / 10);
}

// One leaf holds what is near and what is far away, as where a camera sees through a window.
BOOST_AUTO_TEST_CASE(points_far_away_do_not_blur_those_nearby) {
  for (const InstructionSet set : test::EveryInstructionSet()) {
    BOOST_TEST_CONTEXT(name(set)) {
      Random random(4);
      for (const double far : {1e3, 1e5, 1e7}) {
        for (int trial = 0; trial < 5; ++trial) {
          const Robot robot = test::random_tree(random, 5);
          const Body body = calibrated(test::random_body(random, robot), random);
          KinematicState state(robot);
          state.update(robot, random.vector(robot.num_coordinates()), random.vector(robot.num_coordinates()));
          const Obstacles nearby = test::random_obstacles(random, 15);
          Eigen::Matrix3Xd points(3, 16), velocities(3, 16);
          points << nearby.points(), far * Eigen::Vector3d(0.6, -0.5, 0.7);
          velocities << nearby.velocities(), Eigen::Vector3d::Zero();
          Eigen::VectorXd radii(16);
          radii << nearby.radii(), 0.01;
          compare(robot, body, state, Obstacles(points, radii, velocities), 0.3, 0.1);
        }
      }
    }
  }
}

// Cameras mark what they do not see by the largest number, of which squares overflow in bounds of its node.
BOOST_AUTO_TEST_CASE(points_beyond_single_precision_hide_none_nearby) {
  for (const InstructionSet set : test::EveryInstructionSet()) {
    BOOST_TEST_CONTEXT(name(set)) {
      Random random(11);
      int near = 0;
      for (int trial = 0; trial < 20; ++trial) {
        const Robot robot = test::random_tree(random, 5);
        const ClearanceField field(robot, calibrated(test::random_body(random, robot), random));
        KinematicState state(robot);
        state.update(robot, random.vector(robot.num_coordinates()), random.vector(robot.num_coordinates()));
        const Obstacles nearby = test::random_obstacles(random, 15);
        Eigen::Matrix3Xd points(3, 16), velocities(3, 16);
        points << nearby.points(), Eigen::Vector3d(3.4e38, 0.0, 0.0);
        velocities << nearby.velocities(), Eigen::Vector3d::Zero();
        Eigen::VectorXd radii(16);
        radii << nearby.radii(), 0.0;
        Clearances found(robot.num_coordinates(), field.size()), expected = found;
        found.clear(), expected.clear();
        field.evaluate(state, Obstacles(points, radii, velocities), 0.3, {}, found.view(0, field.size()));
        field.evaluate(state, nearby, 0.3, {}, expected.view(0, field.size()));
        for (int k = 0; k < field.size(); ++k) {
          near += expected.nearest[k] >= 0 ? 1 : 0;
          BOOST_TEST(found.nearest[k] == expected.nearest[k]);
          BOOST_TEST((found.values[k] == expected.values[k] || std::abs(found.values[k] - expected.values[k]) < 1e-13));
        }
      }
      BOOST_TEST(near > 20);
    }
  }
}

// Inside, gradients are longer than one: a point may close faster than any bound of a distance says, beside one that is
// deeper by more than the window.
BOOST_AUTO_TEST_CASE(what_approaches_is_known_deep_inside) {
  Joint slide;
  slide.name = "slide";
  slide.type = JointType::prismatic;
  slide.axis = Eigen::Vector3d::UnitY();
  const Robot robot("slider", {slide}, {{"link", 0, Eigen::Isometry3d::Identity()}}, {"slide"}, JointLimits::unlimited(1));
  const Body body({"link"}, Eigen::VectorXd::Ones(1), Eigen::Matrix3Xd::Zero(3, 1),
                  {Eigen::Vector3d(0.0225, 0.0025, 0.0025).asDiagonal().toDenseMatrix()}, Eigen::VectorXd::Ones(1));
  KinematicState state(robot);
  state.update(robot, Eigen::VectorXd::Zero(1), Eigen::VectorXd::Constant(1, 0.5));
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Constant(3, 9, 5.0);
  points.col(0) << 0.06, 0.008, 0.0;
  points.col(8) << 0.005, 1e-9, 0.0;
  const Obstacles obstacles(points, Eigen::VectorXd::Zero(9), Eigen::Matrix3Xd::Zero(3, 9));
  for (const InstructionSet set : test::EveryInstructionSet()) {
    BOOST_TEST_CONTEXT(name(set)) {
      compare(robot, body, state, obstacles, 0.1, 0.25);
      const ClearanceField field(robot, body, temperature);
      Clearances found(1, 1);
      field.evaluate(state, obstacles, 0.1, {0.25, 0.1}, found.view(0, 1));
      BOOST_TEST(found.approach.rates[0] < -2.0);
      BOOST_TEST(found.approach.values[0] > found.values[0] + 0.08);
    }
  }
}

BOOST_AUTO_TEST_CASE(what_recedes_is_minded_where_nothing_comes_within_reach) {
  // Of eleven points that recede and one beyond the window that comes closer than they will be, but not within reach of
  // the horizon: the nearest is what is left to be minded.
  const Robot robot = test::serial_arm(test::arm_limits(1));
  const std::string link = robot.frames().back().name;
  const Body body({link}, Eigen::VectorXd::Ones(1), Eigen::Matrix3Xd::Zero(3, 1), {0.01 * Eigen::Matrix3d::Identity()},
                  Eigen::VectorXd::Ones(1));
  constexpr double window = 24.0;
  const ClearanceField field(robot, body, temperature, window);
  KinematicState state(robot);
  state.update(robot, Eigen::VectorXd::Zero(1), Eigen::VectorXd::Zero(1));
  const Eigen::Isometry3d X = frame_pose(robot, state, robot.frame_index(link));
  constexpr double tau = 0.05, h = 0.05, beyond = h + window * temperature + 0.002;
  Eigen::Matrix3Xd points(3, 12), velocities(3, 12);
  for (int n = 0; n < 12; ++n) {
    const Eigen::Vector3d away = X.linear() * Eigen::Vector3d(std::cos(0.1 * n), std::sin(0.1 * n), 0.0);
    points.col(n) = X.translation() + (0.1 + (n == 11 ? beyond : h)) * away;
    velocities.col(n) = (n == 11 ? -0.5 : 1.0) * away;
  }
  for (const InstructionSet set : test::EveryInstructionSet()) {
    BOOST_TEST_INFO_SCOPE(name(set));
    Clearances found(1, 1);
    field.evaluate(state, Obstacles(points, Eigen::VectorXd::Zero(12), velocities), 0.08, {tau, 0.06}, found.view(0, 1));
    BOOST_TEST(std::abs(found.values[0] - h) < 1e-9);
    BOOST_TEST(std::abs(found.approach.values[0] - h) < 1e-9);
    BOOST_TEST(std::abs(found.approach.rates[0] - 1.0) < 1e-9);
    BOOST_TEST(std::isfinite(found.approach.curvatures[0]));
  }
}

// A plane that touches a flat ellipsoid says little of what is deep inside, where clearances are lower; of leaves that
// lie across its surface as well.
BOOST_AUTO_TEST_CASE(clouds_that_an_ellipsoid_is_deep_in) {
  const Robot robot = test::serial_arm(test::arm_limits(2));
  const std::string link = robot.frames().back().name;
  const Eigen::Matrix3d S = Eigen::Vector3d(0.0225, 0.0004, 0.0025).asDiagonal();
  const Body body({link}, Eigen::VectorXd::Ones(1), Eigen::Matrix3Xd::Zero(3, 1), {S}, Eigen::VectorXd::Ones(1));
  for (const InstructionSet set : test::EveryInstructionSet()) {
    BOOST_TEST_CONTEXT(name(set)) {
      Random random(8);
      for (int trial = 0; trial < 20; ++trial) {
        KinematicState state(robot);
        state.update(robot, random.vector(2), random.vector(2));
        const Eigen::Isometry3d X = frame_pose(robot, state, robot.frame_index(link));
        const int num = trial % 4 < 2 ? 1500 : 300;
        const double side = random.uniform(0.05, 0.2);
        const Eigen::Vector3d at = 0.15 * random.vector(3);
        Eigen::Matrix3Xd points(3, num), velocities(3, num);
        for (int n = 0; n < num; ++n) {
          // Along the longest axis clearances are lowest by far.
          const bool along = n % 2 == 0 && trial % 4 < 2;
          points.col(n) = X * (along ? Eigen::Vector3d(random.uniform(-0.2, 0.2), random.uniform(-1e-4, 1e-4), 0.0)
                                     : Eigen::Vector3d(at + side * random.vector(3)));
          velocities.col(n) = 0.1 * random.vector(3);
        }
        const Eigen::VectorXd radii = Eigen::VectorXd::Constant(num, trial % 2 == 0 ? 0.0 : 0.01);
        const Obstacles moving(points, radii, velocities);
        compare(robot, body, state, moving, 0.1, 0.1);
        compare(robot, body, state, moving.frozen(), 0.1, 0.2);
      }
    }
  }
}

// More points than fit, before a point within reach is found beside which they weigh.
BOOST_AUTO_TEST_CASE(walls_just_beyond_the_reach_count_beside_what_is_within) {
  const Robot robot = test::serial_arm(test::arm_limits(1));
  const std::string link = robot.frames().back().name;
  const Body body({link}, Eigen::VectorXd::Ones(1), Eigen::Matrix3Xd::Zero(3, 1), {0.01 * Eigen::Matrix3d::Identity()},
                  Eigen::VectorXd::Ones(1));
  KinematicState state(robot);
  state.update(robot, Eigen::VectorXd::Zero(1), Eigen::VectorXd::Ones(1));
  const Eigen::Isometry3d X = frame_pose(robot, state, robot.frame_index(link));
  constexpr double reach = 0.05;
  for (const InstructionSet set : test::EveryInstructionSet()) {
    BOOST_TEST_CONTEXT(name(set)) {
      Random random(9);
      for (const int num : {100, 1000, 3000}) {
        Eigen::Matrix3Xd points(3, num);
        for (int n = 0; n < num; ++n) {
          const double h = n == num / 2 ? reach - 10.0 * temperature : reach + random.uniform(1e-5, 2.0 * temperature);
          points.col(n) = X * ((0.1 + h) * Eigen::Vector3d(1.0, 0.4 * random.uniform(-1.0, 1.0), 0.4).normalized());
        }
        const Obstacles wall(points, Eigen::VectorXd::Zero(num), Eigen::Matrix3Xd::Zero(3, num));
        for (const double horizon : {0.0, 0.05}) {
          compare(robot, body, state, wall, reach, horizon);
        }
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(points_on_an_axis_are_outside) {
  // There the iteration begins at its end, where S is 1 but for rounding. A foot that stays on an axis a of curvature
  // radius b²/a bends the distance h by v²/(b²/a + h) for a speed v across.
  const Robot robot = test::serial_arm(test::arm_limits(1));
  const std::string link = robot.frames().back().name;
  for (const InstructionSet set : test::EveryInstructionSet()) {
    BOOST_TEST_INFO_SCOPE(name(set));
    Random random(4);
    for (int trial = 0; trial < 200; ++trial) {
      const double a = random.uniform(0.05, 0.3), b = random.uniform(0.03, 0.3), h = random.uniform(0.01, 0.3), v = 0.7;
      const Eigen::Matrix3d S = Eigen::Vector3d(a * a, b * b, b * b).asDiagonal();
      const Body body({link}, Eigen::VectorXd::Ones(1), Eigen::Matrix3Xd::Zero(3, 1), {S}, Eigen::VectorXd::Ones(1));
      const ClearanceField field(robot, body, temperature);
      KinematicState state(robot);
      state.update(robot, Eigen::VectorXd::Zero(1), Eigen::VectorXd::Zero(1));
      const Eigen::Isometry3d X = frame_pose(robot, state, robot.frame_index(link));
      const Eigen::Matrix3Xd at = X * Eigen::Vector3d(a + h, 0.0, 0.0), slip = X.linear() * Eigen::Vector3d(0.0, v, 0.0);
      Clearances found(1, 1);
      field.evaluate(state, Obstacles(at, Eigen::VectorXd::Zero(1), slip), 1.0, {}, found.view(0, 1));
      BOOST_TEST(std::abs(found.values[0] - h) < 1e-12);
      BOOST_TEST(std::abs(found.curvatures[0] - v * v / (b * b / a + h)) < 1e-9);
    }
  }
}

BOOST_AUTO_TEST_CASE(a_point_at_the_centre_is_as_deep_as_the_shortest_axis) {
  const Robot robot = test::serial_arm(test::arm_limits(1));
  const std::string link = robot.frames().back().name;
  const Eigen::Matrix3d S = Eigen::Vector3d(0.04, 0.01, 0.02).asDiagonal();
  const Body body({link}, Eigen::VectorXd::Ones(1), Eigen::Matrix3Xd::Zero(3, 1), {S}, Eigen::VectorXd::Ones(1));
  constexpr double window = 24.0;
  const ClearanceField field(robot, body, temperature, window);
  KinematicState state(robot);
  state.update(robot, Eigen::VectorXd::Zero(1), Eigen::VectorXd::Zero(1));
  const Eigen::Isometry3d X = frame_pose(robot, state, robot.frame_index(link));
  for (const InstructionSet set : test::EveryInstructionSet()) {
    BOOST_TEST_INFO_SCOPE(name(set));
    for (const double offset : {0.0, 1e-300, 1e-30, 1e-15, 1e-9}) {
      const Eigen::Matrix3Xd at = X * Eigen::Vector3d(0.0, offset, 0.0);
      Clearances found(1, 1);
      field.evaluate(state, Obstacles(at, Eigen::VectorXd::Zero(1), Eigen::Matrix3Xd::Zero(3, 1)), 0.1, {}, found.view(0, 1));
      BOOST_TEST(std::abs(found.values[0] + 0.1) < 1e-7);
      BOOST_TEST(found.nearest[0] == 0);
    }
  }
}

// Without a look ahead nothing else asks for what lies deep inside: a large ball at the surface is found first, and
// along the longest axis clearances are much lower than at its depth.
BOOST_AUTO_TEST_CASE(balls_at_the_surface_hide_no_points_deep_inside) {
  const Robot robot = test::serial_arm(test::arm_limits(1));
  const std::string link = robot.frames().back().name;
  const Eigen::Matrix3d S = Eigen::Vector3d(0.04, 0.0025, 0.0025).asDiagonal();
  const Body body({link}, Eigen::VectorXd::Ones(1), Eigen::Matrix3Xd::Zero(3, 1), {S}, Eigen::VectorXd::Ones(1));
  const ClearanceField field(robot, body, temperature);
  KinematicState state(robot);
  state.update(robot, Eigen::VectorXd::Zero(1), Eigen::VectorXd::Zero(1));
  const Eigen::Isometry3d X = frame_pose(robot, state, robot.frame_index(link));
  // A leaf deep inside, and one so wide that its points are looked at first, one of them the ball.
  Eigen::Matrix3Xd points(3, 32);
  Eigen::VectorXd radii = Eigen::VectorXd::Zero(32);
  for (int n = 0; n < 16; ++n) {
    points.col(n) = X * Eigen::Vector3d(n < 8 ? 0.01 : -0.01, 0.0, 1e-4);
    points.col(16 + n) = X * Eigen::Vector3d(5.0 + n, 0.0, 0.0);
  }
  points.col(16) = X * Eigen::Vector3d(0.02, 0.05 * std::sqrt(0.99), 0.0);
  radii[16] = 0.1;
  const double m = 0.01 * 0.01 / 0.04 + 1e-8 / 0.0025;
  const double deep = (m - std::sqrt(m)) / std::hypot(0.01 / 0.04, 1e-4 / 0.0025);
  for (const InstructionSet set : test::EveryInstructionSet()) {
    BOOST_TEST_CONTEXT(name(set)) {
      Clearances found(1, 1);
      field.evaluate(state, Obstacles(points, radii, Eigen::Matrix3Xd::Zero(3, 32)), 0.1, {}, found.view(0, 1));
      BOOST_TEST(std::abs(found.values[0] - deep) < 1e-9);
      BOOST_TEST(found.nearest[0] < 16);
    }
  }
}

BOOST_AUTO_TEST_CASE(unknown_instruction_sets_are_refused) {
  // No processor has all three of two architectures; on one that has, there is nothing to refuse.
  const std::vector<InstructionSet> sets = instruction_sets();
  for (const InstructionSet set : {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512}) {
    if (std::find(sets.begin(), sets.end(), set) == sets.end()) {
      BOOST_CHECK_THROW(use(set), std::invalid_argument);
    }
  }
  BOOST_TEST((sets.front() == InstructionSet::baseline));
}

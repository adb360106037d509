// The density, with every instruction set of this machine, against the plain sum over points and Gaussians one by one.
#include "sidestep/thesis/collision_density.hpp"

#include <Eigen/LU>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <numbers>

#include "sidestep/math/instruction_set.hpp"
#include "support/every_instruction_set.hpp"
#include "support/random_scene.hpp"

using namespace sidestep;
using test::Random;

namespace {

struct Sums {
  double value = 0.0, curvature = 0.0, size = 0.0;  // size: of the terms that cancel in the curvature
  Eigen::VectorXd gradient;
};

Sums plain_sum(const Robot& robot, const Body& body, const KinematicState& state, const Obstacles& obstacles) {
  Sums sums{0.0, 0.0, 0.0, Eigen::VectorXd::Zero(robot.num_coordinates())};
  for (int k = 0; k < body.num_components(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Frame& frame = robot.frames()[static_cast<std::size_t>(robot.frame_index(body.links[i]))];
    const KinematicState::Link& link = state.link(frame.joint);
    const Eigen::Matrix3d R = link.R_WL * frame.X_JF.linear();
    const Eigen::Vector3d mean = link.p_WL + link.R_WL * (frame.X_JF * body.means.col(k));
    for (int n = 0; n < obstacles.size(); ++n) {
      const double r = obstacles.radii()[n];
      const Eigen::Matrix3d S = R * body.covariances[i] * R.transpose() + r * r * Eigen::Matrix3d::Identity();
      const Eigen::Matrix3d P = S.inverse();
      const Eigen::Vector3d x = obstacles.points().col(n), x_dot = obstacles.velocities().col(n);
      const Eigen::Vector3d slip = x_dot - link.velocity.linear - link.velocity.angular.cross(x);
      const Eigen::Vector3d slip_dot = -link.bias.linear - link.bias.angular.cross(x) - link.velocity.angular.cross(x_dot) -
                                       link.velocity.angular.cross(slip);
      const Eigen::Vector3d e = x - mean, t = P * e;
      const double two_pi = 2.0 * std::numbers::pi;
      const double density =
          body.weights[k] * std::exp(-0.5 * e.dot(t)) / std::sqrt(two_pi * two_pi * two_pi * S.determinant());
      const double slope = t.dot(slip), bend = slip.dot(P * slip), pull = t.dot(slip_dot);
      sums.value += density;
      sums.curvature += density * (slope * slope - bend - pull);
      sums.size += density * (slope * slope + bend + std::abs(pull));
      accumulate_generalised_force(state, frame.joint, {density * x.cross(t), density * t}, sums.gradient);
    }
  }
  return sums;
}

}  // namespace

BOOST_AUTO_TEST_CASE(every_instruction_set_agrees_with_the_plain_sum_of_densities) {
  for (const InstructionSet set : test::EveryInstructionSet()) {
    BOOST_TEST_CONTEXT(name(set)) {
      Random random(11);
      for (int trial = 0; trial < 50; ++trial) {
        const Robot robot = test::random_tree(random, random.integer(1, 9));
        const Body body = test::random_body(random, robot);
        const int num = random.integer(1, 20);
        const Obstacles moving = test::random_obstacles(random, num);
        const Eigen::VectorXd q = random.vector(robot.num_coordinates()), v = random.vector(robot.num_coordinates());
        KinematicState state(robot);
        state.update(robot, q, v);
        for (const Obstacles& obstacles : {moving, moving.frozen()}) {
          const Sums expected = plain_sum(robot, body, state, obstacles);
          for (const bool average : {false, true}) {
            const double share = average ? 1.0 / num : 1.0;
            const EmbeddingEvaluation found = evaluate(CollisionDensity(robot, body, average), q, v, obstacles);
            constexpr double tolerance = 1e-12;  // rounding, of precisions of a condition of up to 100 too
            BOOST_TEST(std::abs(found.values[0] - share * expected.value) <= tolerance * share * expected.value);
            BOOST_TEST((found.jacobian.row(0).transpose() - share * expected.gradient).norm() <=
                       tolerance * share * (expected.gradient.norm() + expected.value));
            BOOST_TEST(std::abs(found.curvatures[0] - share * expected.curvature) <= tolerance * share * expected.size);
          }
        }
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(points_far_away_have_no_density) {
  Random random(12);
  const Robot robot = test::random_tree(random, 3);
  const Eigen::VectorXd q = random.vector(robot.num_coordinates());
  const Obstacles far(Eigen::Vector3d(1e6, 0.0, 0.0), Eigen::VectorXd::Zero(1), Eigen::Vector3d(0.0, 1e3, 0.0));
  const EmbeddingEvaluation found = evaluate(CollisionDensity(robot, test::random_body(random, robot)), q, q, far);
  BOOST_TEST(found.values[0] == 0.0);
  BOOST_TEST(found.jacobian.norm() == 0.0);
  BOOST_TEST(found.curvatures[0] == 0.0);
}

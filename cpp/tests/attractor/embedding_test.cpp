// Embeddings of random trees against finite differences of their own values.
#include "sidestep/attractor/embedding.hpp"

#include <boost/test/unit_test.hpp>
#include <memory>

#include "sidestep/clearance/stopping_clearance.hpp"
#include "sidestep/clearance/boltzmann_mean.hpp"
#include "sidestep/thesis/collision_density.hpp"
#include "sidestep/thesis/joint_limit_potential.hpp"
#include "sidestep/thesis/sum.hpp"
#include "support/random_scene.hpp"

using namespace sidestep;
using test::Random;

namespace {

void check_derivatives(const Embedding& embedding, Random& random) {
  const int nv = embedding.robot().num_coordinates();
  const Eigen::VectorXd q = random.vector(nv), v = random.vector(nv);
  const Obstacles obstacles = test::random_obstacles(random, 3);
  const EmbeddingEvaluation result = evaluate(embedding, q, v, obstacles);
  const Eigen::MatrixXd hessian = hessians(embedding, q, obstacles).front();

  // Central differences over 1e-5 rad, deviations above 5 cm: truncation 1e-7 of the largest entry at most.
  constexpr double h = 1e-5;
  constexpr double tolerance = 1e-6;
  Eigen::RowVectorXd gradient(nv);
  Eigen::MatrixXd second(nv, nv);
  for (int i = 0; i < nv; ++i) {
    const Eigen::VectorXd shift = h * Eigen::VectorXd::Unit(nv, i);
    const EmbeddingEvaluation after = evaluate(embedding, q + shift, v, obstacles);
    const EmbeddingEvaluation before = evaluate(embedding, q - shift, v, obstacles);
    gradient[i] = (after.values[0] - before.values[0]) / (2.0 * h);
    second.row(i) = (after.jacobian.row(0) - before.jacobian.row(0)) / (2.0 * h);
  }
  BOOST_TEST((result.jacobian - gradient).norm() <= tolerance * gradient.norm());
  BOOST_TEST((hessian - second).norm() <= tolerance * second.norm());
  BOOST_TEST((hessian - hessian.transpose()).norm() == 0.0);

  // d²ψ/dt² with the obstacles moving along; 1 ms: truncation 1e-6, rounding 1e-10 of the size of its terms.
  constexpr double dt = 1e-3;
  const auto value_at = [&](double time) {
    Obstacles moved = obstacles;
    moved.advance(time);
    return evaluate(embedding, q + time * v, v, moved).values[0];
  };
  const double curvature =
      (16.0 * (value_at(dt) + value_at(-dt)) - value_at(2.0 * dt) - value_at(-2.0 * dt) - 30.0 * value_at(0.0)) /
      (12.0 * dt * dt);
  const double scale = second.norm() * v.squaredNorm() + std::abs(curvature);
  BOOST_TEST(std::abs(result.curvatures[0] - curvature) <= tolerance * scale);
}

}  // namespace

BOOST_AUTO_TEST_CASE(derivatives_of_random_trees) {
  Random random(1);
  for (int trial = 0; trial < 100; ++trial) {
    const Robot robot = test::random_tree(random, 7);
    const Body body = test::random_body(random, robot);
    const auto density = std::make_shared<CollisionDensity>(robot, body, random.chance(0.5));
    const auto limits = std::make_shared<JointLimitPotential>(robot, 2.0, 3.0);
    check_derivatives(*density, random);
    check_derivatives(*limits, random);
    check_derivatives(Sum({density, limits}), random);
  }
}

BOOST_AUTO_TEST_CASE(wrong_arguments_are_named) {
  Random random(2);
  const Robot robot = test::random_tree(random, 3);
  Body body = test::random_body(random, robot);
  body.links[0] = "tail";
  BOOST_CHECK_EXCEPTION(CollisionDensity(robot, body), std::invalid_argument, [](const std::exception& e) {
    return std::string(e.what()).find("no link 'tail'; its links are: link0, link1") != std::string::npos;
  });
  BOOST_CHECK_THROW(JointLimitPotential(robot, 0.0), std::invalid_argument);
  BOOST_CHECK_THROW(Sum({}), std::invalid_argument);
}

BOOST_AUTO_TEST_CASE(the_mean_goes_over_from_sample_to_sample) {
  // h = t / (1 + exp(t/T)) + const, of two samples that are equal at t = 0, one at rest: h'' = -1/(2T), and 4 of
  // theirs.
  constexpr double T = 0.002;
  BoltzmannMean mean(T);
  mean.add({0.1, 0.0, 3.0, {}});
  mean.add({0.1, 1.0, 5.0, {}});
  const ClearanceSample result = mean.result();
  BOOST_TEST(result.rate == 0.5, boost::test_tools::tolerance(1e-14));
  BOOST_TEST(result.curvature == 4.0 - 1.0 / (2.0 * T), boost::test_tools::tolerance(1e-12));
}

BOOST_AUTO_TEST_CASE(what_is_ahead_comes_before_what_is_beside) {
  constexpr double T = 0.002;
  const ClearanceSample beside{0.05, 0.0, 1.0, {{}, {{}, Eigen::Vector3d::UnitX()}}};
  const ClearanceSample ahead{0.3, -1.0, 2.0, {{}, {{}, Eigen::Vector3d::UnitY()}}};
  const auto mean_of = [](double horizon, const ClearanceSample& first, const ClearanceSample& second) {
    StoppingClearance mean(T, horizon);
    mean.add(first);
    mean.add(second);
    return mean.result();
  };
  for (const ClearanceSample& found : {mean_of(0.32, beside, ahead), mean_of(0.32, ahead, beside)}) {
    // 0.05 against -0.02, 35 T apart: the other weighs e^-35.
    BOOST_TEST(found.value == 0.3, boost::test_tools::tolerance(1e-13));
    BOOST_TEST(found.rate == -1.0, boost::test_tools::tolerance(1e-13));
    BOOST_TEST(found.curvature == 2.0, boost::test_tools::tolerance(1e-13));
    BOOST_TEST((found.gradient.second.linear - Eigen::Vector3d::UnitY()).norm() < 1e-13);
  }
  BOOST_TEST(mean_of(0.1, beside, ahead).value == 0.05);
  // Two that are equal after a stop, halves of either; without the speed at which weights change.
  const ClearanceSample between = mean_of(0.25, beside, ahead);
  BOOST_TEST(between.value == 0.175, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(between.rate == -0.5, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(between.curvature == 1.5, boost::test_tools::tolerance(1e-12));
}

BOOST_AUTO_TEST_CASE(the_horizon_is_half_the_time_in_which_the_slowest_joint_stops) {
  JointLimits limits = JointLimits::unlimited(2);
  limits.acceleration << 10.0, 5.0;
  BOOST_TEST(Horizon::of_stop(Eigen::Vector2d(-2.0, 0.5), limits) == 0.1);
  BOOST_TEST(Horizon::of_stop(Eigen::Vector2d(1.0, -1.5), limits) == 0.15);
  BOOST_TEST(Horizon::of_stop(Eigen::Vector2d(0.0, 0.0), limits) == 0.0);
  BOOST_TEST(Horizon::of_stop(Eigen::Vector2d(0.0, 1e6), limits) == Horizon::longest);
  BOOST_TEST(Horizon::of_stop(Eigen::Vector2d(5.0, 5.0), JointLimits::unlimited(2)) == 0.0);
}

BOOST_AUTO_TEST_CASE(nothing_in_a_ball_closes_faster_than_the_bound) {
  Random random(5);
  double closest = 1.0;  // of bound to what was found, relative
  for (int trial = 0; trial < 300; ++trial) {
    const Eigen::Vector3d x = random.uniform(0.05, 0.5) * random.vector(3).normalized(), v = random.vector(3);
    const double radius = random.uniform(0.0, 0.3);
    const double bound = Horizon::closing_speed(x.dot(v), x.norm(), radius, v.norm());
    double fastest = -v.norm();
    for (int sample = 0; sample < 3000; ++sample) {
      fastest = std::max(fastest, v.dot((x - radius * random.vector(3).normalized()).normalized()));
    }
    BOOST_TEST(fastest <= bound + 1e-14);
    closest = std::min(closest, (bound - fastest) / v.norm());
  }
  BOOST_TEST(closest < 1e-3);  // and it is no larger than it must be
}

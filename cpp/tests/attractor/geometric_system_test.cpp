// The system's step: its formula, its statuses, and that it allocates nothing on any path.
#include "sidestep/attractor/geometric_system.hpp"

#include <Eigen/LU>
#include <boost/test/unit_test.hpp>
#include <limits>
#include <memory>

#include "sidestep/thesis/collision_density.hpp"
#include "sidestep/thesis/joint_limit_potential.hpp"
#include "support/allocations.hpp"
#include "support/random_scene.hpp"

using namespace sidestep;
using test::Random;

namespace {

using Embeddings = std::vector<std::shared_ptr<const Embedding>>;

/// None, one, and two stacked.
std::vector<Embeddings> lists_of_embeddings(Random& random, const Robot& robot) {
  const auto density = std::make_shared<CollisionDensity>(robot, test::random_body(random, robot));
  const auto limits = std::make_shared<JointLimitPotential>(robot, 2.0, 3.0);
  return {{}, {density}, {density, limits}};
}

GeometricSystemSettings settings_of(int nv, DampingForm form, Switch combination) {
  return {2.0 * Eigen::MatrixXd::Identity(nv, nv), 1.5 * Eigen::MatrixXd::Identity(nv, nv), form, std::move(combination)};
}

std::vector<Switch> switches(int nv, bool with_distances) {
  std::vector<Switch> all = {Unswitched{}, HarmonicOnly{}, GeodesicOnly{}, BinarySwitch{1.0}, SigmoidSwitch{1.0, 2.0}};
  if (with_distances) {
    all.push_back(DistanceSwitch{Eigen::VectorXd::Constant(nv, 0.2), 10.0});
  }
  return all;
}

}  // namespace

BOOST_AUTO_TEST_CASE(unswitched_is_the_dense_formula) {
  Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    const Robot robot = test::random_tree(random, 7);
    const int nv = robot.num_coordinates();
    for (const Embeddings& embeddings : lists_of_embeddings(random, robot)) {
      for (const DampingForm form : {DampingForm::plain, DampingForm::metric}) {
        const GeometricSystem system(robot, embeddings, settings_of(nv, form, Unswitched{}));
        GeometricSystem::Workspace w(system);
        const Eigen::VectorXd q = random.vector(nv).cwiseMax(-2.9).cwiseMin(2.9), v = random.vector(nv);
        const Eigen::VectorXd goal = Eigen::VectorXd::Zero(nv);
        const Obstacles obstacles = test::random_obstacles(random, 3);
        BOOST_TEST((system.acceleration(q, v, goal, obstacles, w) == StepStatus::ok));

        const Eigen::MatrixXd& J_T = w.jacobian_transposed;
        const Eigen::MatrixXd G = Eigen::MatrixXd::Identity(nv, nv) + J_T * J_T.transpose();
        const Eigen::MatrixXd inverse = G.inverse();
        const Eigen::VectorXd damping = 1.5 * v;
        const Eigen::VectorXd bent = 2.0 * q + J_T * w.curvatures;
        const Eigen::VectorXd expected =
            form == DampingForm::plain ? Eigen::VectorXd(-inverse * bent - damping) : -inverse * (bent + damping);
        // the dense inverse loses |J|² times rounding, relative to what it is applied to
        const double scale = 1.0 + bent.norm() + damping.norm();
        BOOST_TEST((w.acceleration - expected).norm() < 1e-14 * (10.0 + J_T.squaredNorm()) * scale);
        BOOST_TEST((w.metric.matrix() - G).norm() < 1e-13 * G.norm());  // rounding
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(no_step_allocates) {
  Random random(2);
  const Robot robot = test::random_tree(random, 7);
  const int nv = robot.num_coordinates();
  const Eigen::VectorXd q = 0.5 * random.vector(nv), v = random.vector(nv), goal = Eigen::VectorXd::Zero(nv);
  Eigen::VectorXd nan = goal, far = goal, fast = goal;
  nan[1] = std::numeric_limits<double>::quiet_NaN();
  far[2] = 4.0;
  fast.setConstant(1e200);
  const Obstacles obstacles = test::random_obstacles(random, 5);
  const Obstacles free = Obstacles::none();

  for (const Embeddings& embeddings : lists_of_embeddings(random, robot)) {
    for (const Switch& combination : switches(nv, !embeddings.empty())) {
      for (const DampingForm form : {DampingForm::plain, DampingForm::metric}) {
        const GeometricSystem system(robot, embeddings, settings_of(nv, form, combination));
        GeometricSystem::Workspace w(system);
        StepStatus status{};
        const auto check = [&](const Eigen::VectorXd& at, const Eigen::VectorXd& velocity, const Eigen::VectorXd& target,
                               const Obstacles& around, StepStatus expected) {
          const auto count = test::allocations_of([&] { status = system.acceleration(at, velocity, target, around, w); });
          BOOST_TEST(count == 0u);
          BOOST_TEST((status == expected));
          BOOST_TEST(w.acceleration.allFinite());
        };
        check(q, v, goal, obstacles, StepStatus::ok);
        check(q, v, goal, free, StepStatus::ok);
        check(far, v, goal, obstacles, StepStatus::outside_limits);
        check(q, v, far, obstacles, StepStatus::goal_outside_limits);
        check(nan, v, goal, obstacles, StepStatus::invalid_state);
        check(q, nan, goal, obstacles, StepStatus::invalid_state);
        check(q, v, nan, obstacles, StepStatus::invalid_goal);
      }
    }
    if (!embeddings.empty()) {  // the square of this velocity overflows
      const GeometricSystem system(robot, embeddings, settings_of(nv, DampingForm::plain, Unswitched{}));
      GeometricSystem::Workspace w(system);
      StepStatus status{};
      BOOST_TEST(test::allocations_of([&] { status = system.acceleration(q, fast, goal, obstacles, w); }) == 0u);
      BOOST_TEST((status == StepStatus::not_finite));
      BOOST_TEST((w.acceleration.array() == -10.0).all());
    }
  }
}

BOOST_AUTO_TEST_CASE(the_guard_would_see_a_step_that_allocates) {
  Random random(3);
  const Robot robot = test::random_tree(random, 4);
  const int nv = robot.num_coordinates();
  const GeometricSystem system(robot, lists_of_embeddings(random, robot)[1], settings_of(nv, DampingForm::plain, Unswitched{}));
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(nv);
  // a workspace made inside the loop is the mistake that the guard is for
  const auto careless = [&] {
    GeometricSystem::Workspace w(system);
    static_cast<void>(system.acceleration(zero, zero, zero, Obstacles::none(), w));
  };
  BOOST_TEST(test::allocations_of(careless) > 0u);
}

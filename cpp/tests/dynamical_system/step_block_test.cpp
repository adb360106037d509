// Steps of states side by side, with every instruction set of this machine, against the step of each.
#include "sidestep/dynamical_system/step_block.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <limits>
#include <memory>

#include "sidestep/dynamical_system/batch.hpp"
#include "sidestep/embedding/collision_density.hpp"
#include "sidestep/embedding/joint_limit_potential.hpp"
#include "sidestep/embedding/sum.hpp"
#include "sidestep/kinematics/instruction_set.hpp"
#include "support/allocations.hpp"
#include "support/every_instruction_set.hpp"
#include "support/random_scene.hpp"

using namespace sidestep;
using test::Random;

namespace {

using Embeddings = std::vector<std::shared_ptr<const Embedding>>;

std::vector<GeometricSystemSettings> all_settings(Random& random, int nv) {
  std::vector<GeometricSystemSettings> all;
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(nv, nv);
  for (const DampingForm form : {DampingForm::plain, DampingForm::metric}) {
    for (const Switch& combination :
         {Switch{Unswitched{}}, Switch{HarmonicOnly{}}, Switch{GeodesicOnly{}}, Switch{BinarySwitch{1.0}},
          Switch{SigmoidSwitch{1.0, 2.0}}}) {
      all.push_back({2.0 * identity, 1.5 * identity, form, combination});
    }
    all.push_back({random.positive_definite(nv, 0.5), random.positive_definite(nv, 0.5), form, Unswitched{}});
  }
  return all;
}

/// Rounding, of what cancels in curvatures too; relative to the largest of the two accelerations that are added.
constexpr double tolerance = 1e-12;

}  // namespace

BOOST_AUTO_TEST_CASE(states_side_by_side_take_the_step_of_each) {
  for (const InstructionSet set : test::EveryInstructionSet()) {
    BOOST_TEST_CONTEXT(name(set)) {
      Random random(31);
      int fallbacks = 0, outside = 0, regular = 0;
      for (int trial = 0; trial < 20; ++trial) {
        const Robot robot = test::random_tree(random, random.integer(1, 9));
        const int nv = robot.num_coordinates();
        const auto density = std::make_shared<CollisionDensity>(robot, test::random_body(random, robot));
        const auto limits = std::make_shared<JointLimitPotential>(robot, 2.0, 3.0);
        const auto sum = std::make_shared<Sum>(Embeddings{density, limits});
        const Obstacles obstacles = test::random_obstacles(random, random.integer(1, 6));
        for (const GeometricSystemSettings& settings : all_settings(random, nv)) {
          for (const Embeddings& embeddings : {Embeddings{density}, Embeddings{sum}}) {
            const GeometricSystem system(robot, embeddings, settings);
            BOOST_TEST_REQUIRE(StepBlock::takes(system));
            StepBlock block(system);
            Eigen::MatrixXd q = random.matrix(nv, block_states), v = random.matrix(nv, block_states),
                            goal = 0.5 * random.matrix(nv, block_states);
            q(0, 1) = 3.5;                                         // outside the limits
            v(0, 2) = std::numeric_limits<double>::quiet_NaN();    // what a single step refuses
            goal(nv - 1, 3) = -4.0;                                // goals that do not pull
            goal(0, 4) = std::numeric_limits<double>::infinity();
            for (int k = 0; k < block_states; ++k) {
              StepBlock::set(block.q, k, q.col(k));
              StepBlock::set(block.v, k, v.col(k));
              StepBlock::set(block.goal, k, goal.col(k));
            }
            BOOST_TEST(test::allocations_of([&] { block.update(obstacles); }) == 0);
            GeometricSystem::Workspace alone(system);
            for (int k = 0; k < block_states; ++k) {
              const StepStatus status = system.acceleration(q.col(k), v.col(k), goal.col(k), obstacles, alone);
              BOOST_TEST((block.statuses[static_cast<std::size_t>(k)] == status));
              Eigen::VectorXd found(nv);
              StepBlock::get(block.acceleration, k, found);
              if (is_fallback(status)) {
                ++fallbacks;
                BOOST_TEST((found == alone.acceleration));
                BOOST_TEST(std::isnan(block.value.of[k]));
                BOOST_TEST(std::isnan(block.switch_weight.of[k]));
                continue;
              }
              (status == StepStatus::ok ? regular : outside) += 1;
              const double size = alone.harmonic.norm() + alone.geodesic.norm();
              BOOST_TEST((found - alone.acceleration).norm() <= tolerance * size);
              BOOST_TEST(std::abs(block.value.of[k] - alone.values[0]) <= tolerance * alone.values[0]);
              BOOST_TEST(std::abs(block.switch_weight.of[k] - alone.switch_weights[0]) <= tolerance * 10.0);
            }
          }
        }
      }
      BOOST_TEST(regular > 1000);
      BOOST_TEST(fallbacks >= 20 * 24);    // the velocity
      BOOST_TEST(outside >= 20 * 24 * 3);  // the state outside, and two goals without a pull
    }
  }
}

BOOST_AUTO_TEST_CASE(a_batch_is_the_same_wherever_a_state_stands_in_it) {
  Random random(32);
  const Robot robot = test::random_tree(random, 7);
  const int nv = robot.num_coordinates();
  const GeometricSystem system(robot, {std::make_shared<CollisionDensity>(robot, test::random_body(random, robot))},
                               all_settings(random, nv).front());
  const Obstacles obstacles = test::random_obstacles(random, 3);
  const Eigen::MatrixXd q = random.matrix(21, nv), v = random.matrix(21, nv), goals = 0.5 * random.matrix(21, nv);
  const BatchEvaluation all = evaluate_batch(system, q, v, goals, obstacles, 2);
  for (int num = 1; num <= 21; ++num) {
    const BatchEvaluation last = evaluate_batch(system, q.bottomRows(num), v.bottomRows(num), goals.bottomRows(num), obstacles, 1);
    BOOST_TEST((last.accelerations == all.accelerations.bottomRows(num)));
    BOOST_TEST((last.values == all.values.bottomRows(num)));
  }
  BOOST_TEST(evaluate_batch(system, q.topRows(0), v.topRows(0), goals.topRows(0), obstacles, 1).statuses.empty());
}

BOOST_AUTO_TEST_CASE(motions_side_by_side_are_those_of_each) {
  Random random(34);
  constexpr int num = 11, steps = 200;
  for (const Integrator integrator : {Integrator::semi_implicit_euler, Integrator::second_order, Integrator::runge_kutta_4}) {
    const Robot robot = test::random_tree(random, 6);
    const int nv = robot.num_coordinates();
    const GeometricSystem system(robot, {std::make_shared<CollisionDensity>(robot, test::random_body(random, robot))},
                                 all_settings(random, nv).front());
    const Obstacles obstacles = test::random_obstacles(random, 3);
    Eigen::MatrixXd q = 0.5 * random.matrix(num, nv), v = random.matrix(num, nv), goals = 0.5 * random.matrix(num, nv);
    goals(9, 0) = 5.0;  // outside the limits: it brakes
    v(10, 0) = std::numeric_limits<double>::quiet_NaN();
    RolloutSettings settings;
    settings.steps = steps;
    settings.integrator = integrator;
    const std::vector<Rollout> motions = rollout_batch(system, q, v, goals, obstacles, settings, 2);
    BOOST_TEST_REQUIRE(motions.size() == static_cast<std::size_t>(num));
    for (int k = 0; k < num; ++k) {
      const Rollout& found = motions[static_cast<std::size_t>(k)];
      const Rollout alone = rollout(system, q.row(k).transpose(), v.row(k).transpose(),
                                    Eigen::VectorXd(goals.row(k).transpose()), obstacles, settings);
      BOOST_TEST((found.statuses == alone.statuses));
      BOOST_TEST((found.time == alone.time));
      if (k == 10) {
        BOOST_TEST(found.values.array().isNaN().all());
        BOOST_TEST((found.acceleration == alone.acceleration));
        continue;
      }
      // Rounding of every step, which 200 of them amplify.
      constexpr double amplified = 1e-9;
      BOOST_TEST((found.q - alone.q).cwiseAbs().maxCoeff() < amplified);
      BOOST_TEST((found.v - alone.v).cwiseAbs().maxCoeff() < amplified * (1.0 + alone.v.cwiseAbs().maxCoeff()));
      BOOST_TEST((found.acceleration - alone.acceleration).cwiseAbs().maxCoeff() <
                 amplified * (1.0 + alone.acceleration.cwiseAbs().maxCoeff()));
      BOOST_TEST((found.values.array().isNaN() == alone.values.array().isNaN()).all());
      BOOST_TEST((found.switch_weights.array().isNaN() == alone.switch_weights.array().isNaN()).all());
      if (k != 9) {
        BOOST_TEST((found.values - alone.values).cwiseAbs().maxCoeff() < amplified * (1.0 + alone.values.maxCoeff()));
        BOOST_TEST((found.switch_weights == alone.switch_weights));
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(systems_that_need_more_than_a_number_are_not_taken) {
  Random random(33);
  const Robot robot = test::random_tree(random, 4);
  const int nv = robot.num_coordinates();
  const Body body = test::random_body(random, robot);
  const auto density = std::make_shared<CollisionDensity>(robot, body);
  const auto limits = std::make_shared<JointLimitPotential>(robot);
  GeometricSystemSettings settings = all_settings(random, nv).front();
  const auto taken = [&](Embeddings embeddings) { return StepBlock::takes(GeometricSystem(robot, embeddings, settings)); };
  BOOST_TEST(taken({density}));
  BOOST_TEST(!taken({}));
  BOOST_TEST(!taken({density, limits}));
  settings.combination = DistanceSwitch{Eigen::VectorXd::Constant(nv, 0.2), 10.0};
  BOOST_TEST(!taken({density}));
  settings.combination = Unswitched{};
  settings.pull_form = PullForm::one_sided;
  BOOST_TEST(!taken({density}));
  settings.pull_form = PullForm::metric;
  settings.speed = SpeedRegulator{};
  BOOST_TEST(!taken({density}));
}

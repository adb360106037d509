// What an arm can hold, against its dynamics and differences.
#include "sidestep/clearance/gravity_torque_limit.hpp"

#include <boost/test/unit_test.hpp>
#include <memory>

#include "sidestep/attractor/clearance_barrier.hpp"
#include "sidestep/clearance/clearance_query.hpp"
#include "support/allocations.hpp"
#include "support/random_scene.hpp"

using namespace sidestep;
using test::Random;

namespace {

RigidBodyDynamics random_dynamics(Random& random, const Robot& robot) {
  std::vector<Inertial> inertials;
  for (int i = 0; i < robot.num_joints(); ++i) {
    const double mass = random.uniform(0.2, 3.0);
    inertials.push_back({mass, 0.1 * random.vector(3), 0.01 * mass * Eigen::Matrix3d::Identity()});
  }
  return RigidBodyDynamics(robot, inertials, {1.0, -0.5, -9.0});
}

constexpr double effort = 1e-3;  // so little that every load counts

}  // namespace

BOOST_AUTO_TEST_CASE(distances_left_and_their_derivatives_are_those_of_gravity) {
  Random random(11);
  for (int trial = 0; trial < 30; ++trial) {
    const Robot robot = test::random_tree(random, 6);
    const RigidBodyDynamics dynamics = random_dynamics(random, robot);
    const int nv = robot.num_coordinates();
    const GravityTorqueLimit limit(dynamics, Eigen::VectorXd::Constant(nv, effort), 0.05);
    BOOST_TEST(limit.loads().size() == static_cast<std::size_t>(nv));
    RigidBodyDynamics::Workspace w(dynamics);
    const Eigen::VectorXd q = random.vector(nv), v = random.vector(nv), rest = Eigen::VectorXd::Zero(nv);
    KinematicState state(robot);
    Eigen::VectorXd gravity(nv), gradient(nv), other(nv);
    state.update(robot, q, v);
    dynamics.gravity(state, w, gravity);
    for (const GravityTorqueLimit::Load& load : limit.loads()) {
      state.update(robot, q, v);
      GravityTorqueLimit::DistanceLeft left{};
      BOOST_TEST(test::allocations_of([&] { left = limit.at(load, state, gradient); }) == 0U);
      BOOST_TEST(std::abs(left.value - (effort - std::abs(gravity[load.coordinate])) / load.weight) < 1e-12);
      BOOST_TEST(std::abs(left.value - limit.value(load, state)) < 1e-12);
      BOOST_TEST(std::abs(left.rate - gradient.dot(v)) < 1e-12);
      constexpr double step = 1e-4;
      const auto value_at = [&](const Eigen::VectorXd& at) {
        state.update(robot, at, rest);
        return limit.value(load, state);
      };
      for (int j = 0; j < nv; ++j) {
        const Eigen::VectorXd along = step * Eigen::VectorXd::Unit(nv, j);
        BOOST_TEST(std::abs((value_at(q + along) - value_at(q - along)) / (2.0 * step) - gradient[j]) < 1e-5);
        BOOST_TEST(std::abs(gradient[j]) <= load.steepest[j] + 1e-12);
        state.update(robot, q + along, v);
        static_cast<void>(limit.at(load, state, other));
        for (int i = 0; i < nv; ++i) {
          BOOST_TEST(std::abs(other[i] - gradient[i]) <= step * load.bend(i, j) + 1e-12);
        }
      }
      const double second = (value_at(q + step * v) - 2.0 * value_at(q) + value_at(q - step * v)) / (step * step);
      BOOST_TEST(std::abs(second - left.curvature) < 1e-4 * (1.0 + std::abs(second)));
    }
  }
}

BOOST_AUTO_TEST_CASE(only_loads_that_can_come_near_the_limit_count) {
  Random random(12);
  const Robot robot = test::random_tree(random, 6);
  const RigidBodyDynamics dynamics = random_dynamics(random, robot);
  const int nv = robot.num_coordinates();
  BOOST_TEST(GravityTorqueLimit(dynamics, Eigen::VectorXd::Constant(nv, 1e5), 0.05).loads().empty());
  BOOST_TEST(GravityTorqueLimit(dynamics, Eigen::VectorXd::Constant(nv, std::numeric_limits<double>::infinity()), 0.05)
                 .loads()
                 .empty());
  const BarrierFunction f{0.05, 0.02, 2.0, 0.002};
  BOOST_CHECK_THROW(
      ClearanceBarrier(robot, std::make_shared<GravityTorqueLimit>(dynamics, Eigen::VectorXd::Constant(nv, 1e5), 0.05), f),
      std::invalid_argument);
}

BOOST_AUTO_TEST_CASE(the_barrier_writes_what_it_holds_and_no_least_clearance) {
  Random random(13);
  const Robot robot = test::random_tree(random, 6);
  const RigidBodyDynamics dynamics = random_dynamics(random, robot);
  const int nv = robot.num_coordinates();
  const GravityTorqueLimit limit(dynamics, Eigen::VectorXd::Constant(nv, 0.5), 0.05);
  const ClearanceBarrier barrier(robot, std::make_shared<GravityTorqueLimit>(limit), {0.05, 0.02, 2.0, 0.002});
  const Eigen::VectorXd q = random.vector(nv), v = random.vector(nv);
  const EmbeddingEvaluation found = evaluate(barrier, q, v, Obstacles::none());
  KinematicState state(robot);
  state.update(robot, q, v);
  int active = 0;
  for (int k = 0; k < barrier.num_coordinates(); ++k) {
    BOOST_TEST((barrier.label(k).kind == CoordinateLabel::Kind::effort));
    BOOST_TEST(found.clearances.least[k] == std::numeric_limits<double>::infinity());
    if (found.clearances.nearest[k] == 0) {
      ++active;
      BOOST_TEST(std::abs(found.clearances.values[k] - limit.value(limit.loads()[static_cast<std::size_t>(k)], state)) < 1e-12);
    }
  }
  BOOST_TEST(active > 0);
}

BOOST_AUTO_TEST_CASE(edges_that_are_free_can_be_held_all_along) {
  Random random(14);
  int free = 0, blocked = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const Robot robot = test::random_tree(random, 6);
    const RigidBodyDynamics dynamics = random_dynamics(random, robot);
    const int nv = robot.num_coordinates();
    const GravityTorqueLimit limit(dynamics, Eigen::VectorXd::Constant(nv, 25.0), 0.05);
    Body on_links = test::random_body(random, robot);
    on_links.levels = Eigen::VectorXd::Ones(on_links.num_components());
    const ClearanceQuery body(robot, on_links, {}, {}, {}, limit);
    ClearanceQuery::Workspace w(body);
    KinematicState state(robot);
    const Margins none{0.0, 0.002, 0.3, {}};
    for (int edge = 0; edge < 20; ++edge) {
      const Eigen::VectorXd a = random.vector(nv), b = random.vector(nv), rest = Eigen::VectorXd::Zero(nv);
      double least = 1.0;
      for (double s = 0.0; s <= 1.0; s += 0.01) {
        state.update(robot, a + s * (b - a), rest);
        for (const GravityTorqueLimit::Load& load : limit.loads()) {
          least = std::min(least, limit.value(load, state));
        }
      }
      const bool found = body.edge_free(a, b, Obstacles::none(), none, w);
      free += found;
      blocked += !found;
      BOOST_TEST((!found || least >= -none.slack));
      BOOST_TEST((found || least < 0.001));
    }
  }
  BOOST_TEST(free > 50);
  BOOST_TEST(blocked > 50);
}

BOOST_AUTO_TEST_CASE(what_the_arm_cannot_hold_is_not_free) {
  // A rod that hangs or stands: 2 kg whose centre is 0.5 m out, 9.81 Nm when level, of which 6 are there.
  std::vector<Joint> joints(1);
  joints[0].name = "lift";
  joints[0].axis = Eigen::Vector3d::UnitY();
  JointLimits limits = JointLimits::unlimited(1);
  limits.lower << -1.6;
  limits.upper << 1.6;
  const Robot robot("rod", joints, {{"rod", 0}}, {"lift"}, limits);
  const RigidBodyDynamics dynamics(robot, {{2.0, {0.5, 0.0, 0.0}, 0.01 * Eigen::Matrix3d::Identity()}});
  const Body body({"rod"}, Eigen::VectorXd::Ones(1), Eigen::Vector3d(0.5, 0.0, 0.0), {0.01 * Eigen::Matrix3d::Identity()},
                  Eigen::VectorXd::Ones(1));
  const ClearanceQuery known(robot, body, {}, {}, {}, GravityTorqueLimit(dynamics, Eigen::VectorXd::Constant(1, 6.0), 0.05));
  const ClearanceQuery unknown(robot, body);
  ClearanceQuery::Workspace w(known), v(unknown);
  const auto at = [](double q) { return Eigen::VectorXd::Constant(1, q); };
  const Margins none{0.0, 0.002, 0.3, {}};
  BOOST_TEST(known.num_items() == 2);
  BOOST_TEST(std::abs(known.nearest(1, at(0.0), Obstacles::none(), 1.0, w).clearance - (6.0 - 9.81) / (2.0 * 9.81)) < 1e-12);
  BOOST_TEST(known.free(at(1.3), Obstacles::none(), none, w));
  BOOST_TEST(!known.free(at(0.3), Obstacles::none(), none, w));
  BOOST_TEST(unknown.free(at(0.3), Obstacles::none(), none, v));
  BOOST_TEST(!known.edge_free(at(-1.3), at(1.3), Obstacles::none(), none, w));
  BOOST_TEST(known.edge_free(at(1.0), at(1.5), Obstacles::none(), none, w));
  BOOST_TEST(unknown.edge_free(at(-1.3), at(1.3), Obstacles::none(), none, v));
}

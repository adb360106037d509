// The loop allocates nothing, not even in the step that takes over new obstacles.
#include "sidestep/control/loop.hpp"

#include <boost/test/unit_test.hpp>
#include <memory>

#include "sidestep/embedding/clearance_barrier.hpp"
#include "support/allocations.hpp"
#include "support/random_scene.hpp"

using namespace sidestep;
using test::Random;

BOOST_AUTO_TEST_CASE(a_step_allocates_nothing) {
  Random random(5);
  const Robot robot = test::random_tree(random, 7);
  Body body = test::random_body(random, robot);
  body.levels = Eigen::VectorXd::Constant(body.num_components(), 0.02);
  const int nv = robot.num_coordinates();
  GeometricSystemSettings settings;
  settings.stiffness = settings.damping = Eigen::MatrixXd::Identity(nv, nv);
  const auto system = std::make_shared<const GeometricSystem>(
      robot,
      std::vector<std::shared_ptr<const Embedding>>{
          std::make_shared<ClearanceBarrier>(robot, body, BarrierFunction{0.1, 0.1, 2.0, 0.001})},
      settings);
  Loop loop(system, TorqueController(robot), JointGoal(Eigen::VectorXd::Zero(nv)), Obstacles::none());
  const Eigen::MatrixXd M = Eigen::MatrixXd::Identity(nv, nv);
  const Eigen::VectorXd h = Eigen::VectorXd::Zero(nv);
  for (int trial = 0; trial < 20; ++trial) {
    loop.set_obstacles(test::random_obstacles(random, 100));
    loop.set_goal(JointGoal(Eigen::VectorXd(0.5 * random.vector(nv).cwiseMax(-3.0).cwiseMin(3.0))));
    const Eigen::VectorXd q = random.vector(nv), v = random.vector(nv);
    LoopStatus status{};
    const std::size_t allocations = test::allocations_of([&] { status = loop.step(q, v, M, h); });
    BOOST_TEST(allocations == 0u);
    BOOST_TEST(!is_fallback(status.system));
    BOOST_TEST(loop.solution().torque.allFinite());
  }
  // A size that is wrong is invalid input.
  BOOST_TEST((loop.step(Eigen::VectorXd::Zero(nv + 1), h, M, h).system == StepStatus::invalid_state));
}

// Takes the given number of steps of one kind and nothing else, for instructions.cmake to count their instructions:
//   instructions_benchmark density|barriers|filtered|cloud STEPS
// density: Table 6.1 of the thesis; barriers: the covered arm among ten balls; filtered: the same with the filter;
// cloud: the covered arm above a table of 10,000 points, with the filter.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "scenes.hpp"
#include "sidestep/constraints/motion_program.hpp"
#include "sidestep/attractor/geometric_system.hpp"
#include "sidestep/attractor/clearance_barrier.hpp"
#include "sidestep/thesis/collision_density.hpp"
#include "sidestep/attractor/joint_limit_barrier.hpp"

int main(int argc, char** argv) {
  using namespace sidestep;
  const bool density = argc == 3 && std::strcmp(argv[1], "density") == 0;
  const bool cloud = argc == 3 && std::strcmp(argv[1], "cloud") == 0;
  const bool filtered = cloud || (argc == 3 && std::strcmp(argv[1], "filtered") == 0);
  if (argc != 3 || !(density || filtered || std::strcmp(argv[1], "barriers") == 0)) {
    std::fprintf(stderr, "usage: %s density|barriers|filtered|cloud STEPS\n", argv[0]);
    return 2;
  }
  const benchmarks::Scene scene =
      density ? benchmarks::fr3() : benchmarks::covered_fr3(cloud ? benchmarks::table(10'000) : benchmarks::balls(10));
  const Robot& robot = scene.robot;
  const int nv = robot.num_coordinates();
  std::vector<std::shared_ptr<const Embedding>> embeddings;
  if (density) {
    embeddings = {std::make_shared<CollisionDensity>(robot, scene.body)};
  } else {
    std::vector<LinkPair> pairs;
    for (std::size_t a = 0; a < robot.frames().size(); ++a) {
      for (std::size_t b = a + 3; b < robot.frames().size(); ++b) {
        pairs.push_back({robot.frames()[a].name, robot.frames()[b].name});
      }
    }
    embeddings = {std::make_shared<ClearanceBarrier>(robot, scene.body, BarrierFunction{0.1, 0.1, 2.0, 0.001}),
                  std::make_shared<JointLimitBarrier>(robot, BarrierFunction{0.1, 0.02, 2.0, 0.001}),
                  std::make_shared<SelfCollisionBarrier>(robot, scene.body, pairs, BarrierFunction{0.05, 0.02, 2.0, 0.001})};
  }
  GeometricSystemSettings settings;
  settings.stiffness = 2.0 * Eigen::MatrixXd::Identity(nv, nv);
  settings.damping = 3.0 * Eigen::MatrixXd::Identity(nv, nv);
  const GeometricSystem system(robot, std::move(embeddings), settings);
  GeometricSystem::Workspace workspace(system);
  MotionProgramSettings without_torque;
  without_torque.by_torque = false;
  MotionProgram filter(robot, without_torque);
  MotionSolution solution(nv);
  const Eigen::VectorXd goal = 0.5 * (robot.limits().lower + robot.limits().upper);
  std::vector<benchmarks::State> states = benchmarks::states(robot, 100, 0);
  if (cloud) {
    constexpr double room = 0.02;  // [m] that an arm that moves safely has left
    const ClearanceField field(robot, scene.body);
    KinematicState kinematics(robot);
    std::erase_if(states, [&](const benchmarks::State& state) {
      Clearances clearances(nv, field.size());
      kinematics.update(robot, state.q, state.v);
      field.evaluate(kinematics, scene.obstacles, room, {}, clearances.view(0, field.size()));
      return clearances.values.minCoeff() < room;
    });
  }
  int failures = 0;
  const int steps = std::atoi(argv[2]);
  for (int k = 0; k < steps; ++k) {
    const benchmarks::State& state = states[static_cast<std::size_t>(k) % states.size()];
    failures += is_fallback(system.acceleration(state.q, state.v, goal, scene.obstacles, workspace));
    if (filtered) {
      failures += filter.solve(
                      {.q = state.q, .v = state.v, .acceleration = workspace.acceleration, .clearances = &workspace.clearances},
                      solution) == ProgramStatus::fallback_solver;
    }
  }
  return failures == 0 ? 0 : 1;
}

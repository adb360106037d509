// One step of the system at the settings of the thesis's Table 6.1: 2, 3 and 7 joints, one Gaussian per link, one
// obstacle, unswitched with plain damping. Prints JSON.
#include <cstdio>
#include <memory>

#include "scenes.hpp"
#include "sidestep/attractor/geometric_system.hpp"
#include "sidestep/thesis/collision_density.hpp"
#include "timing.hpp"

namespace {

using namespace sidestep;

constexpr int num_states = 1000;
constexpr std::size_t num_steps = 1'000'000;

void report(const char* kind, std::size_t batch, const benchmarks::Timing& t, bool last) {
  std::printf(
      "      \"%s\": {\"batch\": %zu, \"median_ns\": %.1f, \"p95_ns\": %.1f, \"p99_ns\": %.1f, "
      "\"p999_ns\": %.1f, \"max_ns\": %.1f, \"steps_per_s\": %.0f}%s\n",
      kind, batch, t.median, t.p95, t.p99, t.p999, t.max, t.throughput, last ? "" : ",");
}

int run(const benchmarks::Scene& scene, bool last) {
  const int nv = scene.robot.num_coordinates();
  const auto density = std::make_shared<CollisionDensity>(scene.robot, scene.body);
  GeometricSystemSettings settings;
  settings.stiffness = 0.5 * Eigen::MatrixXd::Identity(nv, nv);
  settings.damping = 1.5 * Eigen::MatrixXd::Identity(nv, nv);
  const GeometricSystem system(scene.robot, {density}, settings);
  GeometricSystem::Workspace workspace(system);
  const std::vector<benchmarks::State> states = benchmarks::states(scene.robot, num_states, 0);
  const Eigen::VectorXd goal = 0.5 * (scene.robot.limits().lower + scene.robot.limits().upper);

  std::size_t failures = 0;
  double checksum = 0.0;  // uses every result, so that none is optimised away
  const auto step = [&](std::size_t k) {
    const benchmarks::State& state = states[k % num_states];
    failures += system.acceleration(state.q, state.v, goal, scene.obstacles, workspace) != StepStatus::ok;
    checksum += workspace.acceleration[0];
  };
  std::printf("    {\n      \"joints\": %d, \"robot\": \"%s\", \"gaussians\": %d, \"points\": 1,\n", nv,
              scene.robot.name().c_str(), scene.body.num_components());
  report("single", 1, benchmarks::time_calls(step, num_steps, 1), false);
  report("batched", 100, benchmarks::time_calls(step, num_steps, 100), false);
  std::printf("      \"checksum\": %.6g, \"failures\": %zu\n    }%s\n", checksum, failures, last ? "" : ",");
  return failures == 0 ? 0 : 1;
}

}  // namespace

int main() {
  std::printf("{\n  \"benchmark\": \"step\", \"language\": \"C++\", \"version\": \"%s\",\n", SIDESTEP_VERSION);
  std::printf("  \"cpu\": \"%s\", \"compiler\": \"%s\", \"flags\": \"%s\",\n", benchmarks::cpu_model().c_str(),
              SIDESTEP_COMPILER, SIDESTEP_FLAGS);
  std::printf("  \"results\": [\n");
  int failures = run(benchmarks::planar(2), false);
  failures += run(benchmarks::planar(3), false);
  failures += run(benchmarks::fr3(), true);
  std::printf("  ]\n}\n");
  return failures;
}

// Time of one MotionProgram step of a 7-joint arm, on random states of three kinds: nothing in the way, states and
// wanted accelerations at the limits, and loads so high that the bounds must be relaxed; then the same with clearances,
// by how many of them bend the motion, for torque control and for the filter of motion without torque. Prints
// percentiles in microseconds, steady clock included (about 0.03).
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "sidestep/constraints/motion_program.hpp"
#include "support/serial_arm.hpp"
#include "support/without_torque.hpp"

namespace {

using namespace sidestep;
using Times = std::map<std::string, std::vector<double>>;
constexpr int nv = 7, num_states = 2000, num_rounds = 10;

template <class Solve>
void time_rounds(Times& times, const std::string& kind, Solve&& solve) {
  for (int round = 0; round < num_rounds; ++round) {
    const auto start = std::chrono::steady_clock::now();
    const ProgramStatus status = solve();
    const auto stop = std::chrono::steady_clock::now();
    if (round > 0) {  // the first one warms the caches
      times[kind + name(status)].push_back(std::chrono::duration<double, std::micro>(stop - start).count());
    }
  }
}

void print(Times& times) {
  std::printf("%-36s %8s %8s %8s %8s %8s\n", "", "samples", "median", "p95", "p99", "p99.9");
  for (auto& [kind, samples] : times) {
    std::sort(samples.begin(), samples.end());
    const auto percentile = [&samples = samples](double p) {
      return samples[static_cast<std::size_t>(p * static_cast<double>(samples.size() - 1))];
    };
    std::printf("%-36s %8zu %8.2f %8.2f %8.2f %8.2f\n", kind.c_str(), samples.size(), percentile(0.5), percentile(0.95),
                percentile(0.99), percentile(0.999));
  }
  std::printf("\n");
}

void without_clearances() {
  const JointLimits limits = test::arm_limits(nv);
  MotionProgram controller(test::serial_arm(limits));
  MotionSolution solution(nv);
  test::Random random(0);
  Times times;
  for (int k = 0; k < num_states; ++k) {
    Eigen::VectorXd q(nv), v(nv), h(nv);
    const double load = k % 3 == 2 ? 1.3 : 0.5;
    const bool at_limits = k % 3 != 0;
    for (int i = 0; i < nv; ++i) {
      q[i] = at_limits && random.chance(0.5) ? limits.upper[i] - random.magnitude(1e-6, 0.1) : random.uniform(-1.5, 1.5);
      v[i] = random.uniform(-1.0, 1.0) * (at_limits ? 1.0 : 0.3) * limits.velocity[i];
      h[i] = random.uniform(-load, load) * limits.effort[i];
    }
    const Eigen::VectorXd a = (at_limits ? random.magnitude(1.0, 300.0) : 1.0) * random.vector(nv);
    const Eigen::MatrixXd M = test::random_mass(random, nv);
    time_rounds(times, "no clearances, ", [&] { return controller.solve({q, v, a, M, h}, solution); });
  }
  print(times);
}

/// An arm at rest in the middle of its range, on the margin of `num` clearances with random gradients, while the task
/// wants to go anywhere: about half of the rows are violated by it.
void with_clearances(int num) {
  const JointLimits limits = test::arm_limits(nv);
  MotionProgram controller(test::serial_arm(limits));
  MotionProgram filter(test::serial_arm(limits), test::without_torque());
  MotionSolution solution(nv);
  test::Random random(1);
  Times times;
  char label[40];
  for (int k = 0; k < num_states; ++k) {
    const Eigen::VectorXd q = random.vector(nv).cwiseMax(-1.5).cwiseMin(1.5);
    Eigen::VectorXd h(nv);
    for (int i = 0; i < nv; ++i) {
      h[i] = random.uniform(-0.5, 0.5) * limits.effort[i];
    }
    const Eigen::VectorXd v = Eigen::VectorXd::Zero(nv), a = 10.0 * random.vector(nv);
    const Eigen::MatrixXd M = test::random_mass(random, nv);
    Clearances clearances(nv, num);
    clearances.gradients = 0.3 * random.matrix(nv, num);
    clearances.nearest.setLinSpaced(num, 0, std::max(num - 1, 0));
    for (int n = 0; n < num; ++n) {
      // Asks for at least 0 to 0.3 m/s² away from it.
      clearances.values[n] = SafetySettings().margin;
      clearances.rates[n] = 0.0;
      clearances.curvatures[n] = -random.uniform(0.0, 0.3);
    }
    std::snprintf(label, sizeof label, "%2d clearances, torque, ", num);
    time_rounds(times, label, [&] { return controller.solve({q, v, a, M, h, &clearances}, solution); });
    std::snprintf(label, sizeof label, "%2d clearances, filter, ", num);
    time_rounds(times, label,
                [&] { return filter.solve({.q = q, .v = v, .acceleration = a, .clearances = &clearances}, solution); });
  }
  print(times);
}

}  // namespace

int main() {
  without_clearances();
  for (const int num : {0, 4, 16}) {
    with_clearances(num);
  }
}

// Time of one TorqueController step of a 7-joint arm, on random states of three kinds: nothing in the way, states and
// wanted accelerations at the limits, and loads so high that the bounds must be relaxed. Prints percentiles in
// microseconds, steady clock included (about 0.03).
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "sidestep/control/torque_controller.hpp"
#include "support/serial_arm.hpp"

int main() {
  using namespace sidestep;
  constexpr int nv = 7, num_states = 2000, num_rounds = 10;
  const JointLimits limits = test::arm_limits(nv);
  TorqueController controller(test::serial_arm(limits));
  TorqueSolution solution(nv);
  test::Random random(0);

  std::map<TorqueStatus, std::vector<double>> times;
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
    for (int round = 0; round < num_rounds; ++round) {
      const auto start = std::chrono::steady_clock::now();
      const TorqueStatus status = controller.solve(q, v, a, M, h, solution);
      const auto stop = std::chrono::steady_clock::now();
      if (round > 0) {  // the first one warms the caches
        times[status].push_back(std::chrono::duration<double, std::micro>(stop - start).count());
      }
    }
  }
  std::printf("%-24s %8s %8s %8s %8s %8s\n", "status", "samples", "median", "p95", "p99", "p99.9");
  for (auto& [status, samples] : times) {
    std::sort(samples.begin(), samples.end());
    const auto percentile = [&samples](double p) {
      return samples[static_cast<std::size_t>(p * static_cast<double>(samples.size() - 1))];
    };
    std::printf("%-24s %8zu %8.2f %8.2f %8.2f %8.2f\n", name(status), samples.size(), percentile(0.5),
                percentile(0.95), percentile(0.99), percentile(0.999));
  }
}

// Recordings: a step that is recorded allocates nothing, and a replay gives its commands again.
#include <boost/test/unit_test.hpp>
#include <chrono>
#include <filesystem>
#include <random>
#include <thread>

#include "sidestep/controller/controller.hpp"
#include "support/allocations.hpp"
#include "support/covered_arm.hpp"
#include "support/numbers.hpp"

using namespace sidestep;
using test::covered_arm;
using test::nv;

namespace {

/// A path that no other program has, removed at the end.
struct TemporaryPath {
  std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("sidestep-" + std::to_string(std::random_device{}()) + ".step");
  ~TemporaryPath() {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
  }
};

Obstacles ball(double y) {
  return Obstacles(Eigen::Vector3d(0.6, y, 0.2), Eigen::VectorXd::Constant(1, 0.05), Eigen::Vector3d(0.0, -0.1, 0.0));
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_recorded_step_allocates_nothing_and_is_replayed) {
  const TemporaryPath file;
  constexpr int steps = 400;
  RecordingSummary summary;
  {
    Controller controller(covered_arm(test::arm_limits(nv)));  // with its threads
    controller.record(file.path);
    controller.set_goal(Eigen::VectorXd::Constant(nv, 0.5));
    Eigen::VectorXd q = Eigen::VectorXd::Zero(nv), v = q;
    std::size_t allocations = 0;
    for (int k = 0; k < steps; ++k) {
      if (k % 40 == 0) {
        controller.set_obstacles(ball(0.5 - 0.001 * k));
      }
      allocations += test::allocations_of([&] { controller.step(q, v); });
      v += 0.001 * controller.command().acceleration;
      q += 0.001 * v;
      std::this_thread::sleep_for(std::chrono::microseconds(500));  // in which the workers find something
    }
    BOOST_TEST(allocations == 0U);
    summary = controller.stop_recording();
  }
  BOOST_TEST(summary.steps == static_cast<std::uint64_t>(steps));
  BOOST_TEST(summary.lost == 0U);
  const ReplayResult result = replay(file.path);
  BOOST_TEST(result.equal());
  BOOST_TEST(result.complete);
  BOOST_TEST(result.steps == static_cast<std::uint64_t>(steps));
  BOOST_TEST(result.notes.empty());
}

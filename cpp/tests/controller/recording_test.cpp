// Recordings: a step that is recorded allocates nothing, and a replay gives its commands again.
#include <boost/test/unit_test.hpp>
#include <chrono>
#include <filesystem>
#include <random>
#include <thread>

#include "sidestep/controller/controller.hpp"
#include "sidestep/controller/recorded_run.hpp"
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
      std::filesystem::temp_directory_path() / ("sidestep-" + std::to_string(std::random_device{}()) + ".mcap");
  ~TemporaryPath() {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
  }
};

Obstacles ball(double y) {
  return Obstacles(Eigen::Vector3d(0.6, y, 0.2), Eigen::VectorXd::Constant(1, 0.05), Eigen::Vector3d(0.0, -0.1, 0.0));
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_step_with_a_black_box_allocates_nothing_and_only_the_last_seconds_stay) {
  const TemporaryPath folder;
  Controller controller(covered_arm(test::arm_limits(nv)));
  Eigen::VectorXd q = Eigen::VectorXd::Zero(nv);
  const Eigen::VectorXd v = q;
  controller.set_obstacles(ball(0.5));
  controller.step(q, v, 100.0);  // begins in the middle
  controller.black_box(folder.path, 3.0);
  BOOST_CHECK_THROW(controller.black_box(folder.path), std::runtime_error);
  std::size_t allocations = 0;
  constexpr int steps = 1000;
  for (int k = 0; k < steps; ++k) {
    const double time = 100.01 + 0.01 * k;  // 10 s: files of 1 s each
    allocations += test::allocations_of([&] { controller.step(q, v, time); });
    if (k % 25 == 0) {
      controller.set_obstacles(ball(0.5 - 0.0001 * k), {.time = time});
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
  BOOST_TEST(allocations == 0U);
  const BlackBoxSummary summary = controller.stop_black_box();
  BOOST_CHECK_THROW(controller.stop_black_box(), std::runtime_error);
  BOOST_TEST(summary.trouble == "");
  BOOST_TEST(summary.steps == static_cast<std::uint64_t>(steps));
  BOOST_TEST(summary.files.size() == 4U);
  BOOST_CHECK_THROW(replay(summary.files.front()), std::invalid_argument);
  const RecordedRun run = read_recorded_run(summary.files);
  BOOST_TEST(run.damage == "");
  BOOST_TEST(run.complete);
  BOOST_TEST(run.time.back() == 110.0, boost::test_tools::tolerance(1e-9));
  BOOST_TEST(run.time.front() <= 107.0);
  BOOST_TEST(run.time.front() >= 106.0 - 0.011);
  std::filesystem::remove_all(folder.path);
}

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

BOOST_AUTO_TEST_CASE(what_drives_went_on_from_is_replayed) {
  const TemporaryPath file;
  {
    ControllerSettings settings;
    settings.output = ControllerSettings::Output::position;
    Controller controller(covered_arm(test::arm_limits(nv)), settings);
    controller.record(file.path);
    controller.set_goal(Eigen::VectorXd::Constant(nv, 0.5));
    controller.set_obstacles(ball(0.5));
    Eigen::VectorXd q = Eigen::VectorXd::Zero(nv), v = q;
    for (int k = 0; k < 200; ++k) {
      if (k % 20 == 10) {
        q += 0.004 * v;  // 4 cycles without a command
        controller.continue_from(q, v, Eigen::VectorXd::Zero(nv));
      }
      v = controller.step(q, v).velocity;
      q = controller.command().position;
    }
    controller.stop_recording();
  }
  BOOST_TEST(replay(file.path).equal());
}

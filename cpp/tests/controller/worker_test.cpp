// The part beside the loop, alone: it is told snapshots, and what it finds comes back by buffers.
#include <boost/test/unit_test.hpp>
#include <chrono>
#include <thread>

#include "../../src/controller/worker.hpp"
#include "support/numbers.hpp"
#include "support/stage_model.hpp"

using namespace sidestep;
using test::nv;
using Output = ControllerSettings::Output;

namespace {

constexpr double worker_patience = 20.0;  // of a slow machine under a sanitizer; it takes milliseconds [s]

ControllerSettings worker_settings() {
  ControllerSettings settings = test::straight_settings(Output::position);
  settings.synchronous = false;
  settings.look_ahead = LookAheadSettings{};
  return settings;
}

/// Waits until that is so.
template <class Condition>
bool comes_true(Condition&& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(worker_patience);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) {
      return false;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

/// The worker with an arm of seven joints at rest, upright.
struct Working {
  ~Working() { worker.stop(); }
  /// Tells it that the reference rests, on request number `request`.
  void tell(std::uint64_t request, bool by_pose, double time = 0.0) {
    Snapshot& s = worker.draft();
    s.time = time;
    s.request_number = request;
    s.world_number = board.newest_world()->number;
    s.by_pose = by_pose;
    s.places.num = 1;
    s.written = std::chrono::steady_clock::now();
    worker.tell(true);
  }

  const ControllerModel model = test::stage_model(nv, worker_settings());
  RequestBoard board{nv};
  GoalFollower goal{model.body, model.settings, model.joints, model.dynamics, board, false};
  LookAheadFollower look_ahead{model.system, model.settings, model.dynamics};
  ActivationDistances distances{model.system, model.clearances};
  Worker worker{board, model.system, distances, look_ahead, model.settings, 0.001};
};

const Eigen::VectorXd worker_goal = (Eigen::VectorXd(nv) << 0.4, 0.5, 0.3, 0.9, -0.2, 0.6, 0.4).finished();

}  // namespace

BOOST_AUTO_TEST_CASE(a_worker_finds_a_posture_for_the_pose_that_it_is_told_of_and_shows_it) {
  Working w;
  const PoseGoal pose = test::pose_of(w.model.arm.robot(), worker_goal);
  w.board.put(Goal(pose), "");
  w.worker.start(w.goal, w.look_ahead);
  w.tell(1, true);
  BOOST_TEST(comes_true([&] { return w.goal.found_postures().update(); }));
  const FoundPosture& found = w.goal.found_postures().current();
  BOOST_TEST(found.request_number == 1u);
  BOOST_TEST(found.attempt == 0u);
  const PoseError error = pose_error(pose, test::state_at(w.model.arm.robot(), found.posture.q));
  BOOST_TEST(error.position < 1e-7);  // as Posture::found promises
  BOOST_TEST(error.rotation < 1e-7);
  BOOST_TEST((w.board.newest().posture->q == found.posture.q));
  BOOST_TEST(comes_true([&] { return w.worker.activations().update(); }));  // the end of this look
  w.tell(1, true);                                                          // the same question again is none
  BOOST_TEST(comes_true([&] { return w.worker.activations().update(); }));
  BOOST_TEST(!w.goal.found_postures().update());
  BOOST_TEST(w.board.fault() == "");
}

BOOST_AUTO_TEST_CASE(a_worker_lowers_barriers_at_places_among_the_obstacles_that_stand_on_the_board) {
  Working w;
  w.board.put(Goal(JointGoal(worker_goal)), "");
  w.board.put(test::world_of(test::ball({0.09, 0.0, 1.0}, 0.03)), "", [](const Obstacles&) {});  // 2 cm beside a link, upright
  w.worker.start(w.goal, w.look_ahead);
  w.tell(1, false);
  BOOST_TEST(comes_true([&] { return w.worker.activations().update(); }));
  const FoundActivations& found = w.worker.activations().current();
  Eigen::VectorXd expected = w.model.system->activations();
  Places places(nv);
  places.num = 1;
  GeometricSystem::Workspace workspace(*w.model.system);
  BOOST_TEST(!w.distances.lower_at(places, w.board.newest_world()->obstacles, workspace, expected));
  BOOST_TEST(found.request_number == 1u);
  BOOST_TEST((found.values == expected));
  BOOST_TEST((found.values != w.model.system->activations()));
  BOOST_TEST(!found.target_blocked);
}

BOOST_AUTO_TEST_CASE(a_worker_looks_ahead_once_in_a_delay_and_says_from_which_state_it_did) {
  Working w;
  w.board.put(Goal(JointGoal(worker_goal)), "");
  w.board.put(test::world_of(test::ball({0.6, 0.0, 1.0}, 0.05, {-1.0, 0.0, 0.0})), "",
              [](const Obstacles&) {});  // it comes in half a second
  w.worker.start(w.goal, w.look_ahead);
  w.tell(1, false, 0.5);
  BOOST_TEST(comes_true([&] { return w.look_ahead.buffer().update(); }));
  const FoundTrajectory& found = w.look_ahead.buffer().current();
  BOOST_TEST(found.time == 0.5);
  BOOST_TEST(found.request_number == 1u);
  BOOST_TEST(found.duration > 0.0);
  w.worker.activations().update();
  w.tell(1, false, 0.55);  // half a delay later
  BOOST_TEST(comes_true([&] { return w.worker.activations().update(); }));
  w.tell(1, false, 0.61);
  BOOST_TEST(comes_true([&] { return w.look_ahead.buffer().update(); }));
  BOOST_TEST(w.look_ahead.buffer().current().time == 0.61);  // that of 0.55 was left out, or this would not be the next
  w.worker.retire();
  w.worker.stop();
}

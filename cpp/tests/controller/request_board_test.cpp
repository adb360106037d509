// What was set last, for any thread: numbers, copies and hand-over, without a step.
#include <boost/test/unit_test.hpp>
#include <thread>
#include <stdexcept>
#include <string>

#include "../../src/controller/request_board.hpp"
#include "support/covered_arm.hpp"
#include "support/stage_model.hpp"

using namespace sidestep;

namespace {

const auto nobody = [](const Obstacles&) {};
const Eigen::Vector3d board_place(1.0, 2.0, 3.0);

}  // namespace

BOOST_AUTO_TEST_CASE(a_board_numbers_what_is_put_and_hands_it_to_the_step) {
  RequestBoard board(2);
  BOOST_TEST(board.request_number() == 0u);
  BOOST_TEST(board.last_measured().size() == 0);
  const Eigen::Vector2d velocity(0.1, 0.2);
  board.put(VelocityRequest{velocity}, "why so fast?");
  board.put(test::world_of(test::ball(board_place, 0.1)), "", nobody);
  BOOST_TEST(board.request_number() == 1u);
  BOOST_TEST(board.requests().get().number == 1u);
  BOOST_TEST((std::get<VelocityRequest>(board.requests().get().request).velocity == velocity));
  BOOST_TEST(board.worlds().get().number == 1u);
  BOOST_TEST((board.newest_world()->obstacles.points().col(0) == board_place));
  BOOST_TEST((board.request(0).index() == 0));  // there is a newer one
  BOOST_TEST((board.request(1).index() != 0));
  BOOST_TEST(board.questions().order == "why so fast?");
  BOOST_TEST(board.questions().order_is_newer);
  board.put(test::world_of(test::ball(board_place, 0.1), 2), "so far away?", nobody);
  BOOST_TEST(!board.questions().order_is_newer);
  board.number_next_request(7);
  board.put(Request(), "");
  BOOST_TEST(board.request_number() == 7u);
  BOOST_TEST(board.newest_world()->number == 2u);
}

BOOST_AUTO_TEST_CASE(only_the_newest_obstacles_are_shared_and_only_the_newest_request_has_a_posture) {
  RequestBoard board(2);
  Eigen::Index given = 0;
  board.put(test::world_of(test::ball(board_place, 0.1)), "", [&](const Obstacles& obstacles) { given = obstacles.size(); });
  BOOST_TEST(given == 1);
  int shared = 0;
  board.share_if_newest(1, [&] { ++shared; });
  board.share_if_newest(0, [&] { ++shared; });
  BOOST_TEST(shared == 1);
  const Posture posture{Eigen::Vector2d(0.3, 0.4), 0.0, 0.0};
  board.put(Goal(JointGoal(Eigen::Vector2d::Zero())), "");
  board.show_posture(0, posture);
  BOOST_TEST(!board.newest().posture.has_value());
  board.show_posture(1, posture);
  BOOST_TEST((board.newest().posture->q == posture.q));
  board.put(Request(), "");
  BOOST_TEST(!board.newest().posture.has_value());
}

BOOST_AUTO_TEST_CASE(what_belongs_together_is_read_together_while_another_thread_sets_goals) {
  RequestBoard board(1);
  std::thread setter([&] {
    for (std::uint64_t k = 1; k <= 20000; ++k) {
      const Eigen::VectorXd q = Eigen::VectorXd::Constant(1, static_cast<double>(k));
      board.put(Goal(JointGoal(q)), "");
      board.show_posture(k, {q, 0.0, 0.0});
    }
  });
  int with_posture = 0, apart = 0;
  while (board.request_number() < 20000 || with_posture == 0) {
    const RequestBoard::Newest newest = board.newest();
    if (newest.posture) {
      ++with_posture;
      apart += newest.posture->q != std::get<JointGoal>(std::get<Goal>(newest.request)).position;
    }
  }
  setter.join();
  BOOST_TEST(apart == 0);
}

BOOST_AUTO_TEST_CASE(another_board_takes_over_everything_with_its_numbers) {
  RequestBoard before(2), after(2);
  before.number_next_request(5);
  before.put(Goal(JointGoal(Eigen::Vector2d(0.1, 0.2))), "a question");
  before.put(test::world_of(test::ball(board_place, 0.1), 9), "", nobody);
  Eigen::Index given = 0;
  after.take_over(before, [&](const Obstacles& obstacles) { given = obstacles.size(); });
  BOOST_TEST(given == 1);
  BOOST_TEST(after.request_number() == 5u);
  BOOST_TEST(after.newest_world()->number == 9u);
  BOOST_TEST(after.requests().get().number == 5u);
  BOOST_TEST(after.worlds().get().number == 9u);
  BOOST_TEST((after.worlds().get().obstacles.points().col(0) == board_place));
  BOOST_TEST(after.questions().order == "a question");
  BOOST_TEST((std::get<Goal>(after.newest().request).index() == 0));
}

BOOST_AUTO_TEST_CASE(what_background_work_throws_is_kept_as_a_fault) {
  RequestBoard board(2);
  int done = 0;
  board.guarded([&] { ++done; });
  BOOST_TEST(done == 1);
  BOOST_TEST(board.fault() == "");
  board.guarded([] { throw std::runtime_error("no memory for a path"); });
  BOOST_TEST(board.fault() == "no memory for a path");
  board.guarded([] { throw 1; });
  BOOST_TEST(board.fault() == "an unknown exception");
  board.guarded([] { throw std::runtime_error(std::string(500, 'x')); });
  BOOST_TEST(board.fault() == std::string(159, 'x'));  // as long as there is memory for
}

// The planner in its two modes, and its hand-over between threads.
#include "sidestep/planning/online_planner.hpp"

#include <boost/test/unit_test.hpp>
#include <chrono>
#include <thread>

#include "support/allocations.hpp"
#include "support/planar_arm.hpp"
#include "support/random_scene.hpp"

using namespace sidestep;

namespace {

Obstacles point(double x, double y) {
  return Obstacles(Eigen::Vector3d(x, y, 0.0), Eigen::VectorXd::Constant(1, 0.02), Eigen::Matrix3Xd::Zero(3, 1));
}

/// An arm that is drawn to the reference without delay.
OnlinePlannerStatus follow(OnlinePlanner& guide, Eigen::VectorXd& q, double& time, double duration) {
  OnlinePlanner::Reference reference(2);
  OnlinePlannerStatus status = OnlinePlannerStatus::idle;
  for (const double end = time + duration; time < end; time += 0.01) {
    status = guide.step(q, time, reference);
    q += 0.2 * (reference.position - q);
  }
  return status;
}

}  // namespace

BOOST_AUTO_TEST_CASE(arrives_around_an_obstacle_and_tells_of_a_blocked_goal) {
  OnlinePlannerConfig settings;
  settings.synchronous = true;
  OnlinePlanner guide(test::planar_arm_body(), settings);
  guide.set_obstacles(point(0.5, 0.0));
  Eigen::VectorXd q = Eigen::Vector2d(1.0, 0.0);
  OnlinePlanner::Reference reference(2);
  BOOST_TEST(name(guide.step(q, 0.0, reference)) == "idle");
  guide.set_goal(Eigen::Vector2d(-1.0, 0.0));
  double time = 0.0;
  BOOST_TEST(name(follow(guide, q, time, 20.0)) == "arrived");
  BOOST_TEST(guide.counts().found >= 1);

  guide.set_goal(Eigen::Vector2d(0.0, 0.0));
  BOOST_TEST(name(follow(guide, q, time, 0.1)) == "goal_in_collision");
  BOOST_TEST(guide.last_plan().obstruction.label.name == "tip");
  guide.set_obstacles(point(5.0, 0.0));  // it becomes free
  q = Eigen::Vector2d(-1.0, 0.0);
  BOOST_TEST(name(follow(guide, q, time, 20.0)) == "arrived");
  BOOST_CHECK_THROW(guide.set_goal(Eigen::Vector3d::Zero()), std::invalid_argument);
}

BOOST_AUTO_TEST_CASE(synchronous_motions_are_the_same_every_time) {
  OnlinePlannerConfig settings;
  settings.synchronous = true;
  Eigen::VectorXd ends[2];
  for (Eigen::VectorXd& q : ends) {
    OnlinePlanner guide(test::planar_arm_body(), settings);
    guide.set_obstacles(point(0.5, 0.0));
    guide.set_goal(Eigen::Vector2d(-1.0, 0.0));
    q = Eigen::Vector2d(1.0, 0.0);
    double time = 0.0;
    static_cast<void>(follow(guide, q, time, 2.0));
  }
  BOOST_TEST((ends[0] == ends[1]));
}

BOOST_AUTO_TEST_CASE(the_step_allocates_nothing_while_the_guide_searches) {
  OnlinePlanner guide(test::planar_arm_body(), {});
  guide.set_obstacles(point(0.5, 0.0));
  guide.set_goal(Eigen::Vector2d(-1.0, 0.0));
  Eigen::VectorXd q = Eigen::Vector2d(1.0, 0.0);
  OnlinePlanner::Reference reference(2);
  OnlinePlannerStatus status = OnlinePlannerStatus::idle;
  double time = 0.0;
  // Until it has searched, however slow the machine is.
  while (guide.counts().searches == 0) {
    const std::size_t allocations = test::allocations_of([&] { status = guide.step(q, time, reference); });
    BOOST_TEST(allocations == 0);
    time += 0.001;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  for (int i = 0; i < 5000 && status != OnlinePlannerStatus::arrived; ++i) {
    const std::size_t allocations = test::allocations_of([&] { status = guide.step(q, time, reference); });
    BOOST_TEST(allocations == 0);
    q += 0.1 * (reference.position - q);
    time += 0.01;
  }
  BOOST_TEST(name(status) == "arrived");
}

BOOST_AUTO_TEST_CASE(a_path_that_is_blocked_while_it_is_improved_is_given_up_at_once) {
  OnlinePlannerConfig settings;
  settings.planner.search.shortcuts = 1'000'000;  // for longer than anybody waits
  OnlinePlanner guide(test::planar_arm_body(), settings);
  guide.set_obstacles(point(0.5, 0.0));
  guide.set_goal(Eigen::Vector2d(-1.0, 0.0));
  const Eigen::VectorXd q = Eigen::Vector2d(1.0, 0.0);
  OnlinePlanner::Reference reference(2);
  OnlinePlannerStatus status = OnlinePlannerStatus::idle;
  double time = 0.0;
  const auto step = [&] {
    status = guide.step(q, time, reference);
    time += 0.001;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  do {  // until it leads along its first path
    step();
  } while (reference.velocity.isZero());
  BOOST_TEST(guide.counts().searches == 0);  // none is over
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 2);
  points.col(0) << 0.5, 0.0, 0.0;
  points.col(1) << 0.5 * std::cos(-1.0), 0.5 * std::sin(-1.0), 0.0;  // in the goal
  guide.set_obstacles(Obstacles(points, Eigen::VectorXd::Constant(2, 0.02), Eigen::Matrix3Xd::Zero(3, 2)));
  for (int i = 0; i < 30000 && status != OnlinePlannerStatus::goal_in_collision; ++i) {
    step();
  }
  BOOST_TEST(name(status) == "goal_in_collision");
  BOOST_TEST(guide.counts().searches == 2);
}

BOOST_AUTO_TEST_CASE(an_arm_that_is_off_its_path_finds_back_to_it) {
  OnlinePlannerConfig settings;
  settings.synchronous = true;
  settings.planner.route.lead = 3.0;
  settings.planner.patience = 20.0;
  OnlinePlanner guide(test::planar_arm_body(), settings);
  const Obstacles obstacles = point(0.5, 0.0);
  guide.set_obstacles(obstacles);
  guide.set_goal(Eigen::Vector2d(-1.0, 0.0));
  RrtConnect eyes(guide.body(), settings.planner.search);
  Eigen::VectorXd q = Eigen::Vector2d(1.0, 0.0);
  OnlinePlanner::Reference reference(2);
  double time = 0.0;
  // The arm stands still: the reference goes around the obstacle until the arm no longer sees it.
  bool seen = true;
  for (; time < 15.0 && seen; time += 0.001) {
    static_cast<void>(guide.step(q, time, reference));
    seen = eyes.sees(q, reference.position, settings.planner.search.floor, obstacles);
  }
  BOOST_TEST(!seen);
  for (int i = 0; i < 30; ++i, time += 0.001) {  // past its next look
    static_cast<void>(guide.step(q, time, reference));
  }
  BOOST_TEST(eyes.sees(q, reference.position, settings.planner.search.floor, obstacles));
  BOOST_TEST(guide.counts().searches == 1);
  BOOST_TEST(name(follow(guide, q, time, 20.0)) == "arrived");
  BOOST_TEST(guide.counts().searches == 1);
}

BOOST_AUTO_TEST_CASE(an_arm_that_is_slow_is_not_stuck) {
  OnlinePlannerConfig settings;
  settings.synchronous = true;
  OnlinePlanner guide(test::planar_arm_body(), settings);
  guide.set_obstacles(point(0.5, 0.0));
  guide.set_goal(Eigen::Vector2d(-1.0, 0.0));
  Eigen::VectorXd q = Eigen::Vector2d(1.0, 0.0);
  OnlinePlanner::Reference reference(2);
  double time = 0.0;
  const auto move = [&](double speed, double duration) {
    for (const double end = time + duration; time < end; time += 0.01) {
      static_cast<void>(guide.step(q, time, reference));
      const Eigen::VectorXd away = reference.position - q;
      q += std::min(1.0, 0.01 * speed / std::max(away.norm(), 1e-9)) * away;
    }
  };
  move(0.03, 5.0);  // at 0.03 rad/s, about a 100th of the way a second
  BOOST_TEST(guide.counts().searches == 1);
  move(0.01, 5.0);
  BOOST_TEST(guide.counts().searches > 1);
}

// The guide in its two modes, its hand-over between threads, and the attractor on a route.
#include "sidestep/guidance/guide.hpp"

#include <boost/test/unit_test.hpp>
#include <chrono>
#include <thread>

#include "support/allocations.hpp"
#include "support/random_scene.hpp"

using namespace sidestep;

namespace {

/// One joint that turns a link of 0.3 m, and a point that blocks the way through zero.
Robot turning() {
  Joint joint;
  joint.name = "joint";
  JointLimits limits = JointLimits::unlimited(2);
  limits.lower.setConstant(-3.0);
  limits.upper.setConstant(3.0);
  Joint second = joint;
  second.name = "second";
  second.parent = 0;
  second.coordinate = 1;
  second.X_PJ.translation().x() = 0.3;
  return Robot("turning", {joint, second},
               {Frame{"link", 0, Eigen::Isometry3d::Identity()}, Frame{"tip", 1, Eigen::Isometry3d::Identity()}},
               {"joint", "second"}, std::move(limits));
}

BodyClearance body_of(const Robot& robot) {
  Eigen::Matrix3Xd means = Eigen::Matrix3Xd::Zero(3, 2);
  means.row(0).setConstant(0.15);
  const Eigen::Matrix3d shape = Eigen::Vector3d(0.16 * 0.16, 0.02 * 0.02, 0.02 * 0.02).asDiagonal();
  return BodyClearance(robot, Body({"link", "tip"}, Eigen::VectorXd::Ones(2), means, {shape, shape}, Eigen::VectorXd::Ones(2)));
}

Obstacles point(double x, double y) {
  return Obstacles(Eigen::Vector3d(x, y, 0.0), Eigen::VectorXd::Constant(1, 0.02), Eigen::Matrix3Xd::Zero(3, 1));
}

/// An arm that is drawn to the attractor without delay.
GuideStatus follow(Guide& guide, Eigen::VectorXd& q, double& time, double duration) {
  Guide::Attractor attractor{q, q, q};
  GuideStatus status = GuideStatus::idle;
  for (const double end = time + duration; time < end; time += 0.01) {
    status = guide.step(q, time, attractor);
    q += 0.2 * (attractor.position - q);
  }
  return status;
}

}  // namespace

BOOST_AUTO_TEST_CASE(arrives_around_an_obstacle_and_tells_of_a_blocked_goal) {
  const Robot robot = turning();
  GuideSettings settings;
  settings.synchronous = true;
  Guide guide(body_of(robot), settings);
  guide.set_obstacles(point(0.5, 0.0));
  Eigen::VectorXd q = Eigen::Vector2d(1.0, 0.0);
  Guide::Attractor attractor{q, q, q};
  BOOST_TEST(name(guide.step(q, 0.0, attractor)) == "idle");
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
  const Robot robot = turning();
  GuideSettings settings;
  settings.synchronous = true;
  Eigen::VectorXd ends[2];
  for (Eigen::VectorXd& q : ends) {
    Guide guide(body_of(robot), settings);
    guide.set_obstacles(point(0.5, 0.0));
    guide.set_goal(Eigen::Vector2d(-1.0, 0.0));
    q = Eigen::Vector2d(1.0, 0.0);
    double time = 0.0;
    static_cast<void>(follow(guide, q, time, 2.0));
  }
  BOOST_TEST((ends[0] == ends[1]));
}

BOOST_AUTO_TEST_CASE(the_step_allocates_nothing_while_the_guide_searches) {
  const Robot robot = turning();
  Guide guide(body_of(robot), {});
  guide.set_obstacles(point(0.5, 0.0));
  guide.set_goal(Eigen::Vector2d(-1.0, 0.0));
  Eigen::VectorXd q = Eigen::Vector2d(1.0, 0.0);
  Guide::Attractor attractor{q, q, q};
  GuideStatus status = GuideStatus::idle;
  double time = 0.0;
  // Until it has searched, however slow the machine is.
  while (guide.counts().searches == 0) {
    const std::size_t allocations = test::allocations_of([&] { status = guide.step(q, time, attractor); });
    BOOST_TEST(allocations == 0);
    time += 0.001;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  for (int i = 0; i < 5000 && status != GuideStatus::arrived; ++i) {
    const std::size_t allocations = test::allocations_of([&] { status = guide.step(q, time, attractor); });
    BOOST_TEST(allocations == 0);
    q += 0.1 * (attractor.position - q);
    time += 0.01;
  }
  BOOST_TEST(name(status) == "arrived");
}

BOOST_AUTO_TEST_CASE(the_tightest_place_between_arm_and_attractor_is_known) {
  const Robot robot = turning();
  const BodyClearance body = body_of(robot);
  BodyClearance::Workspace w(body);
  const RouteSettings settings;
  Eigen::MatrixXd path(2, 2);
  path << 0.0, 2.0, 0.0, 0.0;
  // Beyond the tip, stretched towards 1 rad: the tip ends at 0.61 m, the point begins at 0.63 m.
  const Route route = make_route(path, body, point(0.65 * std::cos(1.0), 0.65 * std::sin(1.0)), settings, w);
  Eigen::Index narrowest = 0;
  BOOST_TEST(std::abs(route.clearance.minCoeff(&narrowest) - 0.02) < 1e-3);  // the tip passes between two samples
  BOOST_TEST(std::abs(route.q(0, narrowest) - 1.0) < 0.05);                  // their spacing
  BOOST_TEST(route.speed[narrowest] <= 0.021 / settings.wide * settings.speed);  // as the clearance, within 1 mm
  RouteFollower follower;
  Eigen::VectorXd q = Eigen::Vector2d::Zero(), position(2), velocity(2);
  follower.enter(route, q);
  BOOST_TEST(follower.tightest(route, settings) == -1);  // it is wide there
  while (follower.station < 1.2) {
    follower.advance(route, settings, position = Eigen::Vector2d(follower.station, 0.0), 0.01, position, velocity);
  }
  BOOST_TEST(follower.tightest(route, settings) == narrowest);  // behind the attractor, ahead of the arm
  while (follower.station < 1.9) {
    follower.advance(route, settings, position = Eigen::Vector2d(follower.station, 0.0), 0.01, position, velocity);
  }
  BOOST_TEST(follower.tightest(route, settings) == -1);
  const Route quick = make_route(path, body, Obstacles::none(), settings, w, false);
  BOOST_TEST(quick.clearance.maxCoeff() == 0.0);
  BOOST_TEST(quick.speed.maxCoeff() <= settings.slowest * settings.speed);
}

BOOST_AUTO_TEST_CASE(the_attractor_waits_for_the_arm_and_slows_at_the_end) {
  const Robot robot = turning();
  const BodyClearance body = body_of(robot);
  BodyClearance::Workspace w(body);
  const RouteSettings settings;
  Eigen::MatrixXd path(2, 3);
  path << 0.0, 1.0, 1.0, 0.0, 0.0, 1.0;
  const Route route = make_route(path, body, Obstacles::none(), settings, w);
  BOOST_TEST(std::abs(route.length() - 2.0) < 1e-12);  // rounding
  BOOST_TEST(route.speed.maxCoeff() <= settings.speed);
  BOOST_TEST(route.speed[route.speed.size() - 1] == 0.0);
  RouteFollower follower;
  Eigen::VectorXd q = Eigen::Vector2d::Zero(), position(2), velocity(2);
  follower.enter(route, q);
  for (int i = 0; i < 2000; ++i) {
    follower.advance(route, settings, q, 0.01, position, velocity);  // the arm does not move
  }
  BOOST_TEST((position - q).norm() <= settings.lead + 1e-9);  // rounding
  BOOST_TEST((position - q).norm() > 0.5 * settings.lead);
  for (int i = 0; i < 2000; ++i) {
    follower.advance(route, settings, position, 0.01, position, velocity);
  }
  BOOST_TEST((position - Eigen::Vector2d(1.0, 1.0)).norm() < 1e-3);  // it slows down towards the end
}

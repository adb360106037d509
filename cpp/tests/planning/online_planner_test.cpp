// The planner in its two modes, its hand-over between threads, and the reference on a timed path.
#include "sidestep/planning/online_planner.hpp"

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
OnlinePlannerStatus follow(OnlinePlanner& guide, Eigen::VectorXd& q, double& time, double duration) {
  OnlinePlanner::Attractor attractor(2);
  OnlinePlannerStatus status = OnlinePlannerStatus::idle;
  for (const double end = time + duration; time < end; time += 0.01) {
    status = guide.step(q, time, attractor);
    q += 0.2 * (attractor.position - q);
  }
  return status;
}

}  // namespace

BOOST_AUTO_TEST_CASE(arrives_around_an_obstacle_and_tells_of_a_blocked_goal) {
  const Robot robot = turning();
  OnlinePlannerConfig settings;
  settings.synchronous = true;
  OnlinePlanner guide(body_of(robot), settings);
  guide.set_obstacles(point(0.5, 0.0));
  Eigen::VectorXd q = Eigen::Vector2d(1.0, 0.0);
  OnlinePlanner::Attractor attractor(2);
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
  OnlinePlannerConfig settings;
  settings.synchronous = true;
  Eigen::VectorXd ends[2];
  for (Eigen::VectorXd& q : ends) {
    OnlinePlanner guide(body_of(robot), settings);
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
  OnlinePlanner guide(body_of(robot), {});
  guide.set_obstacles(point(0.5, 0.0));
  guide.set_goal(Eigen::Vector2d(-1.0, 0.0));
  Eigen::VectorXd q = Eigen::Vector2d(1.0, 0.0);
  OnlinePlanner::Attractor attractor(2);
  OnlinePlannerStatus status = OnlinePlannerStatus::idle;
  double time = 0.0;
  // Until it has searched, however slow the machine is.
  while (guide.counts().searches == 0) {
    const std::size_t allocations = test::allocations_of([&] { status = guide.step(q, time, attractor); });
    BOOST_TEST(allocations == 0);
    time += 0.001;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  for (int i = 0; i < 5000 && status != OnlinePlannerStatus::arrived; ++i) {
    const std::size_t allocations = test::allocations_of([&] { status = guide.step(q, time, attractor); });
    BOOST_TEST(allocations == 0);
    q += 0.1 * (attractor.position - q);
    time += 0.01;
  }
  BOOST_TEST(name(status) == "arrived");
}

BOOST_AUTO_TEST_CASE(a_path_that_is_blocked_while_it_is_improved_is_given_up_at_once) {
  const Robot robot = turning();
  OnlinePlannerConfig settings;
  settings.planner.shortcuts = 1'000'000;  // for longer than anybody waits
  OnlinePlanner guide(body_of(robot), settings);
  guide.set_obstacles(point(0.5, 0.0));
  guide.set_goal(Eigen::Vector2d(-1.0, 0.0));
  const Eigen::VectorXd q = Eigen::Vector2d(1.0, 0.0);
  OnlinePlanner::Attractor attractor(2);
  OnlinePlannerStatus status = OnlinePlannerStatus::idle;
  double time = 0.0;
  const auto step = [&] {
    status = guide.step(q, time, attractor);
    time += 0.001;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  do {  // until it leads along its first path
    step();
  } while (attractor.velocity.isZero());
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

BOOST_AUTO_TEST_CASE(the_narrow_places_between_arm_and_attractor_are_known) {
  const Robot robot = turning();
  const BodyClearance body = body_of(robot);
  BodyClearance::Workspace w(body);
  const TimedPathSettings settings;
  Eigen::MatrixXd path(2, 2);
  path << 0.0, 2.0, 0.0, 0.0;
  // Beyond the tip, stretched towards 1 rad: the tip ends at 0.61 m, the points begin at 0.63 m; others follow,
  // farther.
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 5);
  for (Eigen::Index k = 0; k < 5; ++k) {
    const double angle = 1.0 + 0.05 * static_cast<double>(k - 2), away = k == 2 ? 0.65 : 0.655;
    points.col(k) << away * std::cos(angle), away * std::sin(angle), 0.0;
  }
  const Obstacles row(points, Eigen::VectorXd::Constant(5, 0.02), Eigen::Matrix3Xd::Zero(3, 5));
  const TimedPath route = make_route(path, body, row, settings, w);
  Eigen::Index narrowest = 0;
  BOOST_TEST(std::abs(route.clearance.minCoeff(&narrowest) - 0.02) < 1e-3);  // the tip passes between two samples
  BOOST_TEST(std::abs(route.q(0, narrowest) - 1.0) < 0.05);                  // their spacing
  BOOST_TEST(route.speed[narrowest] <= 0.021 / settings.wide * settings.speed);  // as the clearance, within 1 mm
  TimedPathFollower follower;
  Eigen::VectorXd q = Eigen::Vector2d::Zero(), position(2), velocity(2), acceleration(2);
  follower.enter(route, q, Eigen::Vector2d::Zero());
  Eigen::MatrixXd places(2, TimedPathFollower::most_places);
  const auto narrow = [&] { return places.leftCols(follower.narrow(route, settings, places)); };
  BOOST_TEST(narrow().cols() == 0);  // it is wide there
  while (follower.station < 1.2) {
    follower.advance(route, settings, position = Eigen::Vector2d(follower.station, 0.0), 0.01, position, velocity, acceleration);
  }
  // Behind the attractor, ahead of the arm: all, as they are few, or every second.
  const auto num_narrow = (route.clearance.array() < settings.wide).count();
  BOOST_TEST(num_narrow > 2);
  const Eigen::Index every = num_narrow > TimedPathFollower::most_places ? 2 : 1;
  BOOST_TEST(narrow().cols() == (num_narrow + every - 1) / every);
  const Eigen::VectorXd off = (narrow().colwise() - route.q.col(narrowest)).colwise().norm();
  BOOST_TEST(off.minCoeff() < (every == 1 ? 1e-12 : 0.051));  // their spacing
  BOOST_TEST(off.maxCoeff() < 0.2);
  while (follower.station < 1.9) {
    follower.advance(route, settings, position = Eigen::Vector2d(follower.station, 0.0), 0.01, position, velocity, acceleration);
  }
  BOOST_TEST(narrow().cols() == 0);
  const TimedPath quick = make_route(path, body, Obstacles::none(), settings, w, false);
  BOOST_TEST(quick.clearance.maxCoeff() == 0.0);
  BOOST_TEST(quick.speed.maxCoeff() <= settings.slowest * settings.speed);
}

BOOST_AUTO_TEST_CASE(the_attractor_waits_for_the_arm_and_slows_at_the_end) {
  const Robot robot = turning();
  const BodyClearance body = body_of(robot);
  BodyClearance::Workspace w(body);
  const TimedPathSettings settings;
  Eigen::MatrixXd path(2, 3);
  path << 0.0, 1.0, 1.0, 0.0, 0.0, 1.0;
  const TimedPath route = make_route(path, body, Obstacles::none(), settings, w);
  BOOST_TEST(std::abs(route.length() - 2.0) < 1e-12);  // rounding
  BOOST_TEST(route.speed.maxCoeff() <= settings.speed);
  BOOST_TEST(route.speed[route.speed.size() - 1] == 0.0);
  TimedPathFollower follower;
  Eigen::VectorXd q = Eigen::Vector2d::Zero(), position(2), velocity(2), acceleration(2);
  follower.enter(route, q, Eigen::Vector2d::Zero());
  for (int i = 0; i < 2000; ++i) {
    follower.advance(route, settings, q, 0.01, position, velocity, acceleration);  // the arm does not move
  }
  BOOST_TEST((position - q).norm() <= settings.lead + 1e-9);  // rounding
  BOOST_TEST((position - q).norm() > 0.5 * settings.lead);
  for (int i = 0; i < 2000; ++i) {
    follower.advance(route, settings, position, 0.01, position, velocity, acceleration);
  }
  BOOST_TEST((position - Eigen::Vector2d(1.0, 1.0)).norm() < 1e-3);  // it slows down towards the end
}

BOOST_AUTO_TEST_CASE(the_attractor_says_how_it_speeds_up_and_begins_as_fast_as_the_arm) {
  const Robot robot = turning();
  const BodyClearance body = body_of(robot);
  BodyClearance::Workspace w(body);
  const TimedPathSettings settings;
  Eigen::MatrixXd path(2, 2);
  path << 0.0, 2.0, 0.0, 0.0;
  const TimedPath route = make_route(path, body, Obstacles::none(), settings, w);
  TimedPathFollower follower;
  Eigen::VectorXd position(2), velocity(2), acceleration(2), before = Eigen::Vector2d::Zero();
  follower.enter(route, path.col(0), Eigen::Vector2d(0.5, 3.0));
  BOOST_TEST(follower.rate == 0.5);  // what leads along the route
  follower.enter(route, path.col(0), Eigen::Vector2d(-0.5, 0.0));
  BOOST_TEST(follower.rate == 0.0);
  const double step = 0.001;
  double most = 0.0;
  while (follower.station < 1.99) {
    const double rate = follower.rate;
    follower.advance(route, settings, Eigen::Vector2d(follower.station, 0.0), step, position, velocity, acceleration);
    BOOST_TEST(std::abs(velocity[0] - follower.rate) < 1e-12);  // rounding
    // 4 rad/s² there, and back but for the samples at which speeds are given.
    BOOST_TEST(std::abs(acceleration[0] - (follower.rate - rate) / step) < 0.2);
    BOOST_TEST(acceleration[1] == 0.0);
    most = std::max(most, std::abs(acceleration[0]));
  }
  BOOST_TEST(std::abs(most - settings.acceleration) < 1e-9);  // rounding
}

BOOST_AUTO_TEST_CASE(corners_are_passed_slowly_where_there_is_little_room) {
  const Robot robot = turning();
  const BodyClearance body = body_of(robot);
  BodyClearance::Workspace w(body);
  const TimedPathSettings settings;
  Eigen::MatrixXd path(2, 3);
  path << 0.0, 1.0, 1.5, 0.0, 0.0, -0.5;  // a turn of 45°
  const auto speed = [&](double distance) {
    const TimedPath route = make_route(path, body, point(distance * std::cos(1.0), distance * std::sin(1.0)), settings, w);
    return route.speed[20];  // 1 rad, by 0.05 rad
  };
  // The tip ends at 0.61 m, the point begins 2 cm farther; the tip is 0.61 m from the first joint, 0.31 m from the
  // second.
  const double room = 0.02, swing = settings.delay * (0.61 * (1.0 - std::sqrt(0.5)) + 0.31 * std::sqrt(0.5));
  BOOST_TEST(speed(0.65) <= 1.01 * room / swing);  // the clearance is a lower bound, to 1 %
  BOOST_TEST(speed(0.65) >= 0.8 * room / swing);   // the bound of the motion knows no direction of it
  BOOST_TEST(speed(0.9) > 2.0 * speed(0.65));
  BOOST_TEST(speed(2.0) == settings.speed * std::sqrt(0.5), boost::test_tools::tolerance(1e-9));  // by the angle alone
}

BOOST_AUTO_TEST_CASE(an_arm_that_is_off_its_path_finds_back_to_it) {
  const Robot robot = turning();
  OnlinePlannerConfig settings;
  settings.synchronous = true;
  settings.route.lead = 3.0;
  settings.patience = 20.0;
  OnlinePlanner guide(body_of(robot), settings);
  const Obstacles obstacles = point(0.5, 0.0);
  guide.set_obstacles(obstacles);
  guide.set_goal(Eigen::Vector2d(-1.0, 0.0));
  RrtConnect eyes(guide.body(), settings.planner);
  Eigen::VectorXd q = Eigen::Vector2d(1.0, 0.0);
  OnlinePlanner::Attractor attractor(2);
  double time = 0.0;
  // The arm stands still: the attractor goes around the obstacle until the arm no longer sees it.
  bool seen = true;
  for (; time < 15.0 && seen; time += 0.001) {
    static_cast<void>(guide.step(q, time, attractor));
    seen = eyes.sees(q, attractor.position, settings.planner.floor, obstacles);
  }
  BOOST_TEST(!seen);
  for (int i = 0; i < 30; ++i, time += 0.001) {  // past its next look
    static_cast<void>(guide.step(q, time, attractor));
  }
  BOOST_TEST(eyes.sees(q, attractor.position, settings.planner.floor, obstacles));
  BOOST_TEST(guide.counts().searches == 1);
  BOOST_TEST(name(follow(guide, q, time, 20.0)) == "arrived");
  BOOST_TEST(guide.counts().searches == 1);
}

BOOST_AUTO_TEST_CASE(an_arm_that_is_slow_is_not_stuck) {
  const Robot robot = turning();
  OnlinePlannerConfig settings;
  settings.synchronous = true;
  OnlinePlanner guide(body_of(robot), settings);
  guide.set_obstacles(point(0.5, 0.0));
  guide.set_goal(Eigen::Vector2d(-1.0, 0.0));
  Eigen::VectorXd q = Eigen::Vector2d(1.0, 0.0);
  OnlinePlanner::Attractor attractor(2);
  double time = 0.0;
  const auto move = [&](double speed, double duration) {
    for (const double end = time + duration; time < end; time += 0.01) {
      static_cast<void>(guide.step(q, time, attractor));
      const Eigen::VectorXd away = attractor.position - q;
      q += std::min(1.0, 0.01 * speed / std::max(away.norm(), 1e-9)) * away;
    }
  };
  move(0.03, 5.0);  // at 0.03 rad/s, about a 100th of the way a second
  BOOST_TEST(guide.counts().searches == 1);
  move(0.01, 5.0);
  BOOST_TEST(guide.counts().searches > 1);
}

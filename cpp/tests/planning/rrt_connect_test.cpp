// Paths of a planar arm among obstacles: free everywhere, deterministic, and honest where there is none.
#include "sidestep/planning/rrt_connect.hpp"

#include <boost/test/unit_test.hpp>

#include "sidestep/planning/path_smoothing.hpp"
#include "support/random_scene.hpp"
#include "support/serial_arm.hpp"

using namespace sidestep;
using test::Random;

namespace {

/// A chain in a plane, joints 0.3 m apart, each link an ellipsoid along it.
Robot planar(int nv) {
  std::vector<Joint> joints;
  std::vector<Frame> frames;
  std::vector<std::string> names;
  for (int i = 0; i < nv; ++i) {
    Joint joint;
    joint.name = "joint" + std::to_string(i);
    joint.parent = i - 1;
    joint.X_PJ.translation().x() = i == 0 ? 0.0 : 0.3;
    joint.coordinate = i;
    names.push_back(joint.name);
    joints.push_back(joint);
    frames.push_back({"link" + std::to_string(i), i, Eigen::Isometry3d::Identity()});
  }
  JointLimits limits = JointLimits::unlimited(nv);
  limits.lower.setConstant(-3.0);
  limits.upper.setConstant(3.0);
  return Robot("planar", std::move(joints), std::move(frames), std::move(names), std::move(limits));
}

Body along_links(const Robot& robot) {
  const int num = robot.num_joints();
  std::vector<std::string> links;
  for (const Frame& frame : robot.frames()) {
    links.push_back(frame.name);
  }
  Eigen::Matrix3Xd means = Eigen::Matrix3Xd::Zero(3, num);
  means.row(0).setConstant(0.15);
  const Eigen::Matrix3d shape = Eigen::Vector3d(0.17 * 0.17, 0.03 * 0.03, 0.03 * 0.03).asDiagonal();
  return Body(links, Eigen::VectorXd::Ones(num), means, std::vector<Eigen::Matrix3d>(static_cast<std::size_t>(num), shape),
              Eigen::VectorXd::Ones(num));
}

Obstacles at(const Eigen::Matrix3Xd& points, double radius) {
  return Obstacles(points, Eigen::VectorXd::Constant(points.cols(), radius), Eigen::Matrix3Xd::Zero(3, points.cols()));
}

/// A wall of points from (0.5, -0.05) outwards that the straight way crosses.
Obstacles wall() {
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 20);
  points.row(0).setLinSpaced(0.5, 1.2);
  return at(points, 0.01);
}

Eigen::VectorXd joints(double first) { return Eigen::Vector3d(first, 0.0, 0.0); }

}  // namespace

BOOST_AUTO_TEST_CASE(goes_straight_where_that_is_free) {
  const Robot robot = planar(3);
  const ClearanceQuery body(robot, along_links(robot));
  RrtConnect planner(body, {});
  const Plan plan = planner.plan(joints(0.5), joints(1.5), wall(), 0);
  BOOST_TEST(name(plan.status) == "found");
  BOOST_TEST(plan.path.cols() == 2);
  BOOST_TEST(plan.iterations == 0);
}

BOOST_AUTO_TEST_CASE(finds_a_free_way_around_and_the_same_every_time) {
  const Robot robot = planar(3);
  const ClearanceQuery body(robot, along_links(robot));
  RrtConnect planner(body, {});
  ClearanceQuery::Workspace w(body);
  const Obstacles points = wall();
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Plan plan = planner.plan(joints(0.5), joints(-0.5), points, seed);
    BOOST_TEST(name(plan.status) == "found");
    BOOST_TEST(plan.path.cols() > 2);  // 9 cm of straight way lie in the wall
    BOOST_TEST((plan.path.col(0) == joints(0.5)));
    BOOST_TEST((plan.path.col(plan.path.cols() - 1) == joints(-0.5)));
    double least = 1.0;
    for (Eigen::Index k = 1; k < plan.path.cols(); ++k) {
      for (int i = 0; i <= 200; ++i) {
        const Eigen::VectorXd q = plan.path.col(k - 1) + (plan.path.col(k) - plan.path.col(k - 1)) * i / 200.0;
        least = std::min(least, body.nearest(q, points, 1.0, w).clearance);
      }
    }
    BOOST_TEST(least >= plan.margin - planner.settings().slack);
    const Plan again = planner.plan(joints(0.5), joints(-0.5), points, seed);
    BOOST_TEST((again.path == plan.path));
  }
}

BOOST_AUTO_TEST_CASE(a_path_begins_anew_where_an_arm_is_that_has_moved_on) {
  const Robot robot = planar(3);
  const ClearanceQuery body(robot, along_links(robot));
  RrtConnect planner(body, {});
  const Obstacles points = wall();
  const Plan plan = planner.plan(joints(0.5), joints(-0.5), points, 0);
  const Eigen::Index last = plan.path.cols() - 1;
  BOOST_REQUIRE(last > 1);
  const double floor = planner.settings().floor;

  // From beside the goal it goes there straight.
  Eigen::MatrixXd path = plan.path;
  const Eigen::VectorXd beside = joints(-0.6);
  BOOST_TEST(planner.enter(path, 0, floor, beside, points));
  BOOST_TEST(path.cols() == 2);
  BOOST_TEST((path.col(0) == beside));
  BOOST_TEST((path.col(1) == plan.path.col(last)));

  // From beside the start it goes to the last waypoint that is seen from there, and on as before.
  path = plan.path;
  const Eigen::VectorXd here = joints(0.6);
  BOOST_TEST(planner.enter(path, 0, floor, here, points));
  BOOST_TEST((path.col(0) == here));
  const Eigen::Index kept = path.cols() - 1;
  BOOST_TEST(kept > 1);  // the wall hides the goal
  BOOST_TEST((path.rightCols(kept) == plan.path.rightCols(kept)));
  BOOST_TEST(planner.sees(here, path.col(1), floor, points));
  for (Eigen::Index k = 2; k <= kept; ++k) {
    BOOST_TEST(!planner.sees(here, path.col(k), floor, points));
  }

  // No waypoint before the first that is asked for is gone back to.
  path = plan.path;
  BOOST_TEST(!planner.enter(path, last, floor, here, points));
  BOOST_TEST((path == plan.path));
}

BOOST_AUTO_TEST_CASE(smoothing_makes_a_path_shorter_and_wide_where_there_is_room) {
  const Robot robot = planar(3);
  const ClearanceQuery body(robot, along_links(robot));
  PlannerSettings settings;
  settings.margin = settings.floor = 0.01;
  RrtConnect planner(body, settings);
  ClearanceQuery::Workspace w(body);
  const Obstacles points = wall();
  const auto least = [&](const Eigen::MatrixXd& path) {
    double clearance = 1.0;
    for (Eigen::Index k = 1; k < path.cols(); ++k) {
      for (int i = 0; i <= 100; ++i) {
        const Eigen::VectorXd q = path.col(k - 1) + (path.col(k) - path.col(k - 1)) * i / 100.0;
        clearance = std::min(clearance, body.nearest(q, points, clearance, w).clearance);
      }
    }
    return clearance;
  };
  int wider = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Plan plan = planner.find(joints(0.5), joints(-0.5), points, seed);
    BOOST_TEST(name(plan.status) == "found");
    const Eigen::MatrixXd found = plan.path;
    planner.improve(plan, points, seed, settings.margin);
    BOOST_TEST(length(plan.path) <= length(found) + 1.0);  // waypoints may be shifted a little outwards
    RandomStream random(seed);
    const Margins kept = planner.margins(settings.margin, joints(0.5), joints(-0.5), points);
    const Eigen::MatrixXd tight = shorten(found, body, points, kept, 40, random, w);
    const Eigen::MatrixXd wide = widen(tight, body, points, kept, 0.06, random, w);
    BOOST_TEST(length(tight) <= length(found) + 1e-12);  // rounding
    BOOST_TEST(least(wide) >= settings.margin - settings.slack);
    wider += least(wide) > least(tight) + 0.002;
  }
  BOOST_TEST(wider >= 10);
}

BOOST_AUTO_TEST_CASE(says_what_is_in_the_way_and_how_deep) {
  const Robot robot = planar(3);
  const ClearanceQuery body(robot, along_links(robot), {{"link0", "link2"}});
  RrtConnect planner(body, {});
  const Plan goal = planner.plan(joints(0.5), joints(0.0), wall(), 0);
  BOOST_TEST(name(goal.status) == "goal_in_collision");
  BOOST_TEST(goal.obstruction.label.name == "link2");
  BOOST_TEST(goal.obstruction.point >= 0);
  // across the ellipsoid, 3 cm half-width and the 1 cm of the point: the wall runs along its axis
  BOOST_TEST(goal.obstruction.depth > 0.035);
  BOOST_TEST(goal.obstruction.depth < 0.19);
  const Plan start = planner.plan(joints(0.0), joints(0.5), wall(), 0);
  BOOST_TEST(name(start.status) == "start_in_collision");
  const Plan folded = planner.plan(joints(0.5), Eigen::Vector3d(0.0, 2.9, 2.9), Obstacles::none(), 0);
  BOOST_TEST(name(folded.status) == "goal_in_collision");
  BOOST_TEST(folded.obstruction.label.other == "link2");
  BOOST_TEST(name(planner.plan(joints(0.5), joints(3.1), wall(), 0).status) == "invalid");
}

BOOST_AUTO_TEST_CASE(a_point_at_the_centre_of_an_ellipsoid_is_as_deep_as_it_is_thick) {
  // Where two of the balls that cover it meet, in the middle of a cell: they do not hold the depth.
  const Robot robot = planar(1);
  const Eigen::Vector3d centre(0.0, 0.02, 0.02);
  const Eigen::Matrix3d shape = Eigen::Vector3d(0.0451, 0.025, 0.025).cwiseAbs2().asDiagonal();
  const ClearanceQuery body(robot, Body({"link0"}, Eigen::VectorXd::Ones(1), centre, {shape}, Eigen::VectorXd::Ones(1)));
  ClearanceQuery::Workspace w(body);
  const Obstacles point = at(centre, 0.0);
  const Eigen::VectorXd q = Eigen::VectorXd::Zero(1);
  Eigen::VectorXd found(1);
  body.clearances(q, point, -0.02, w, found);
  BOOST_TEST(std::abs(found[0] + 0.025) < 1e-4);  // what two steps of Newton leave
  RrtConnect planner(body, {});
  Obstruction obstruction;
  BOOST_TEST(planner.obstructed(q, point, obstruction));
  BOOST_TEST(std::abs(obstruction.depth - 0.025) < 1e-4);
}

BOOST_AUTO_TEST_CASE(a_wider_way_is_taken_where_there_is_one) {
  const Robot robot = planar(3);
  const ClearanceQuery body(robot, along_links(robot));
  RrtConnect planner(body, {});
  int wider = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Plan first = planner.find(joints(0.5), joints(-0.5), wall(), seed);
    BOOST_TEST(name(first.status) == "found");
    BOOST_TEST(first.margin == planner.settings().floor);
    Plan plan = first;
    planner.improve(plan, wall(), seed, planner.settings().margin);
    wider += plan.margin == planner.settings().margin;
    BOOST_TEST((plan.path.col(0) == first.path.col(0)));
    BOOST_TEST((plan.path.rightCols(1) == first.path.rightCols(1)));
    BOOST_TEST(plan.nodes >= first.nodes);
    plan = first;
    planner.improve(plan, wall(), seed, 1.0);  // a metre from everything: there is no such way
    BOOST_TEST(plan.margin < 1.0);
    BOOST_TEST(name(plan.status) == "found");
  }
  BOOST_TEST(wider > 5);
}

BOOST_AUTO_TEST_CASE(ends_that_are_slightly_inside_are_left_and_reached) {
  const Robot robot = planar(3);
  const ClearanceQuery body(robot, along_links(robot));
  RrtConnect planner(body, {});
  ClearanceQuery::Workspace w(body);
  // A point 1 cm deep in the side of the last link at the goal: less than the allowance.
  Eigen::Matrix3Xd points(3, 1);
  points << 0.75, -0.03, 0.0;
  const Obstacles index = at(points, 0.01);
  const double clearance = body.nearest(joints(0.0), index, 1.0, w).clearance;
  BOOST_TEST(std::abs(clearance + 0.01) < 2e-3);  // the ellipsoid is straight at its middle but for its curvature
  const Plan plan = planner.plan(joints(0.8), joints(0.0), index, 0);
  BOOST_TEST(name(plan.status) == "found");
  PlannerSettings strict;
  strict.allowance = 0.005;
  RrtConnect strict_planner(body, strict);
  BOOST_TEST(name(strict_planner.plan(joints(0.8), joints(0.0), index, 0).status) == "goal_in_collision");
}

BOOST_AUTO_TEST_CASE(what_is_no_longer_wanted_ends_with_what_there_is) {
  const Robot robot = planar(3);
  const ClearanceQuery body(robot, along_links(robot));
  RrtConnect planner(body, {});
  const Plan first = planner.find(joints(0.5), joints(-0.5), wall(), 3);
  BOOST_TEST_REQUIRE(name(first.status) == "found");
  int asked = 0;
  planner.interrupt_when([&asked] { return ++asked > 0; });
  Plan plan = first;
  planner.improve(plan, wall(), 3, planner.settings().margin);
  BOOST_TEST(name(plan.status) == "found");
  BOOST_TEST((plan.path == first.path));
  BOOST_TEST(name(planner.find(joints(0.5), joints(-0.5), wall(), 3).status) == "timeout");
  BOOST_TEST(asked > 0);
  planner.interrupt_when(never_interrupted);
  planner.improve(plan, wall(), 3, planner.settings().margin);
  BOOST_TEST(length(plan.path) < length(first.path));
}

BOOST_AUTO_TEST_CASE(a_closed_way_ends_with_the_budget) {
  const Robot robot = planar(1);
  const ClearanceQuery body(robot, along_links(robot));
  Eigen::Matrix3Xd points(3, 2);
  points << 0.25, -0.25, 0.0, 0.0, 0.0, 0.0;
  PlannerSettings settings;
  settings.max_iterations = 500;
  RrtConnect planner(body, settings);
  const Plan plan = planner.plan(Eigen::VectorXd::Constant(1, 1.5), Eigen::VectorXd::Constant(1, -1.5), at(points, 0.02), 0);
  BOOST_TEST(name(plan.status) == "no_path");
  BOOST_TEST(plan.path.size() == 0);
  BOOST_TEST(plan.iterations == 500);
  settings.max_iterations = 2000000000;
  settings.max_checks = 5000;
  RrtConnect bounded(body, settings);
  const Plan ended = bounded.plan(Eigen::VectorXd::Constant(1, 1.5), Eigen::VectorXd::Constant(1, -1.5), at(points, 0.02), 0);
  BOOST_TEST(name(ended.status) == "no_path");
  BOOST_TEST(ended.iterations < 100000);
  BOOST_TEST(ended.checks > 5000);
  BOOST_TEST(ended.checks < 5500);
  const Plan again = bounded.plan(Eigen::VectorXd::Constant(1, 1.5), Eigen::VectorXd::Constant(1, -1.5), at(points, 0.02), 0);
  BOOST_TEST(again.iterations == ended.iterations);
  BOOST_TEST(again.checks == ended.checks);
  settings.max_seconds = 1e-9;
  RrtConnect hurried(body, settings);
  BOOST_TEST(
      name(hurried.plan(Eigen::VectorXd::Constant(1, 1.5), Eigen::VectorXd::Constant(1, -1.5), at(points, 0.02), 0).status) ==
      "timeout");
  settings.floor = 0.1;
  BOOST_CHECK_THROW(RrtConnect(body, settings), std::invalid_argument);
}

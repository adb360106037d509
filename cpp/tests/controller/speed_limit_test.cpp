// Cartesian speed by the distance to obstacles, in motions of the whole controller.
#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>
#include <thread>

#include "sidestep/controller/controller.hpp"
#include "support/allocations.hpp"
#include "support/covered_arm.hpp"
#include "support/numbers.hpp"

using namespace sidestep;
using test::covered_arm;
using test::nv;

namespace {

struct Frames {
  double speed = 0.0;
  Eigen::Vector3d tip;
};

/// The speed of the fastest frame.
Frames frames_at(const Robot& robot, const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
  KinematicState state(robot);
  state.update(robot, q, v);
  Frames all;
  for (int f = 0; f < static_cast<int>(robot.frames().size()); ++f) {
    all.speed = std::max(all.speed, (frame_jacobian(robot, state, f).topRows(3) * v).norm());
  }
  all.tip = frame_pose(robot, state, robot.frame_index("tip")).translation();
  return all;
}

struct Motion {
  double largest_excess = -test::infinity;   // of speed over the limit [m/s]
  double fastest = 0.0, fastest_near = 0.0;  // near: within 0.2 m
  double nearest = test::infinity, least_clearance = test::infinity;
  int relaxed = 0, slowed = 0;
  std::size_t allocations = 0;
  bool arrived = false;
  std::string words;  // when it was slowed near
};

/// Moves past the obstacles to the goal, or without one, and looks at every sample.
Motion move(const Arm& arm, ControllerSettings settings, const Eigen::VectorXd& start,
            const std::optional<Eigen::VectorXd>& goal, const Obstacles& obstacles, int steps) {
  settings.planner.reset();
  settings.look_ahead.reset();
  settings.local_minimum.reset();
  settings.synchronous = true;
  Controller controller(arm, settings);
  controller.set_obstacles(Obstacles::none());
  controller.set_obstacles(obstacles, test::for_ever);
  if (goal) {
    controller.set_goal(*goal);
  }
  const ClearanceQuery body(arm.robot(), arm.body());
  ClearanceQuery::Workspace workspace(body);
  const SpeedLimitSettings limits = settings.speed_limits.value_or(SpeedLimitSettings{});
  Motion motion;
  Eigen::VectorXd q = start, v = Eigen::VectorXd::Zero(nv);
  for (int k = 0; k < steps && !motion.arrived; ++k) {
    motion.allocations += test::allocations_of([&] { controller.step(q, v); });
    const Command& command = controller.command();
    const double speed = frames_at(arm.robot(), q, v).speed;
    const double distance = body.nearest(q, controller.obstacles(), 10.0, workspace).clearance;
    BOOST_REQUIRE(std::abs(command.speed - speed) < 1e-12);
    if (settings.speed_limits) {
      BOOST_REQUIRE(command.speed_limit == limits.allowed(distance));
      BOOST_REQUIRE(command.distance == (distance < limits.far_distance ? distance : test::infinity));
    } else {
      BOOST_REQUIRE(command.speed_limit == test::infinity);
      BOOST_REQUIRE(command.distance == test::infinity);
    }
    motion.largest_excess = std::max(motion.largest_excess, speed - limits.allowed(distance));
    motion.fastest = std::max(motion.fastest, speed);
    motion.nearest = std::min(motion.nearest, distance);
    motion.least_clearance = std::min(motion.least_clearance, command.clearance);
    motion.relaxed += command.status == SafetyStatus::relaxed;
    if (distance < 0.2) {
      motion.fastest_near = std::max(motion.fastest_near, speed);
    }
    if (controller.part_results().solution.speed_frame >= 0) {
      ++motion.slowed;
      if (motion.words.empty()) {
        motion.words = controller.explain();
      }
    }
    motion.arrived = command.activity == Activity::arrived;
    v += settings.period * command.acceleration;
    q += settings.period * v;
  }
  return motion;
}

Eigen::VectorXd turned(double first) {
  Eigen::VectorXd q = Eigen::VectorXd::Zero(nv);
  q[0] = first;
  q[1] = 1.2;
  return q;
}

}  // namespace

BOOST_AUTO_TEST_CASE(the_limit_of_speed_is_held_at_every_sample_past_an_obstacle) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  const Eigen::Vector3d tip = frames_at(arm.robot(), turned(0.0), Eigen::VectorXd::Zero(nv)).tip;
  const Eigen::Vector3d beside = tip + Eigen::Vector3d(0.15, 0.0, 0.0);
  for (const auto output :
       {ControllerSettings::Output::torque, ControllerSettings::Output::acceleration, ControllerSettings::Output::position}) {
    BOOST_TEST_CONTEXT(static_cast<int>(output)) {
      ControllerSettings settings;
      settings.output = output;
      settings.barriers.stiffness = 20.0;  // in a hurry
      settings.barriers.damping = 9.0;
      const Motion free = move(arm, settings, turned(-1.2), turned(1.2), test::ball(beside, 0.03), 8000);
      settings.speed_limits.emplace();
      const Motion limited = move(arm, settings, turned(-1.2), turned(1.2), test::ball(beside, 0.03), 8000);
      BOOST_TEST(free.arrived);
      BOOST_TEST(free.slowed == 0);
      BOOST_TEST(free.largest_excess > 0.5);
      BOOST_TEST(free.fastest_near > 1.0);
      BOOST_TEST(limited.arrived);
      BOOST_TEST(limited.largest_excess <= 0.0);
      BOOST_TEST(limited.fastest > 0.9);  // where it is far
      BOOST_TEST(limited.nearest < 0.15);
      BOOST_TEST(limited.fastest_near < 0.56);  // V(0.2 m) = 0.55
      BOOST_TEST(limited.slowed > 100);
      BOOST_TEST(limited.relaxed == 0);
      BOOST_TEST(limited.allocations == 0U);
      BOOST_TEST(limited.words.find("slowed by the speed limit: '") != std::string::npos, limited.words);
      BOOST_TEST_MESSAGE("excess " << limited.largest_excess << " fastest " << limited.fastest << " near "
                                   << limited.fastest_near << " free " << free.fastest_near << " nearest " << limited.nearest
                                   << " slowed " << limited.slowed << " relaxed " << limited.relaxed << " free relaxed "
                                   << free.relaxed << " words " << limited.words);
    }
  }
}

BOOST_AUTO_TEST_CASE(speed_limits_give_way_to_what_comes_at_the_arm) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  const Eigen::Vector3d tip = frames_at(arm.robot(), turned(0.0), Eigen::VectorXd::Zero(nv)).tip;
  for (const auto output : {ControllerSettings::Output::torque, ControllerSettings::Output::acceleration}) {
    BOOST_TEST_CONTEXT(static_cast<int>(output)) {
      ControllerSettings settings;
      settings.output = output;
      settings.speed_limits = SpeedLimitSettings{0.05, 0.1, 0.2, 1.0};
      const Obstacles comes = test::ball(tip + Eigen::Vector3d(-0.1, 0.6, 0.0), 0.05, {0.0, -0.6, 0.0});
      const Motion motion = move(arm, settings, turned(0.0), std::nullopt, comes, 1400);
      settings.speed_limits.reset();
      const Motion free = move(arm, settings, turned(0.0), std::nullopt, comes, 1400);
      BOOST_TEST(motion.least_clearance > settings.safety.margin - 2e-4);  // barriers, which begin earlier, give way
      BOOST_TEST(motion.largest_excess > 0.2);                             // it has to be as fast as the ball
      BOOST_TEST(motion.relaxed > free.relaxed + 100);
      BOOST_TEST(motion.allocations == 0U);
      BOOST_TEST_MESSAGE("clearance " << motion.least_clearance << " excess " << motion.largest_excess << " relaxed "
                                      << motion.relaxed << " free " << free.least_clearance << " " << free.relaxed << " words "
                                      << motion.words);
    }
  }
}

BOOST_AUTO_TEST_CASE(the_limit_is_held_on_a_path_of_the_planner_without_allocations) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  ControllerSettings settings;
  settings.speed_limits = SpeedLimitSettings{0.2, 0.1, 0.5, 1.0};
  Controller controller(arm, settings);
  controller.set_obstacles(Obstacles::none());
  const Eigen::Vector3d tip = frames_at(arm.robot(), turned(0.0), Eigen::VectorXd::Zero(nv)).tip;
  controller.set_obstacles(test::ball(tip + Eigen::Vector3d(0.15, 0.0, 0.0), 0.03));
  controller.set_goal(turned(1.2));
  Eigen::VectorXd q = turned(-1.2), v = Eigen::VectorXd::Zero(nv);
  std::size_t allocations = 0;
  int on_path = 0, slowed = 0;
  bool arrived = false;
  for (int k = 0; k < 40000 && !arrived; ++k) {
    allocations += test::allocations_of([&] { controller.step(q, v, settings.period * k); });
    const Command& command = controller.command();
    BOOST_REQUIRE(command.speed <= command.speed_limit);
    on_path += command.on_path;
    slowed += controller.part_results().solution.speed_frame >= 0;
    arrived = command.activity == Activity::arrived;
    v += settings.period * command.acceleration;
    q += settings.period * v;
    std::this_thread::sleep_for(std::chrono::microseconds(200));  // for the planner
  }
  BOOST_TEST(allocations == 0U);
  BOOST_TEST(arrived);
  BOOST_TEST(on_path > 100);
  BOOST_TEST(slowed > 0);
}

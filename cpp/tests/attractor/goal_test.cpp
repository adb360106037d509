// Goals: their gradients against finite differences, what fits a half turn, the posture pull, and moving goals.
#include "sidestep/attractor/goal.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <limits>

#include "sidestep/thesis/rollout.hpp"
#include "support/random_scene.hpp"
#include "support/serial_arm.hpp"

using namespace sidestep;
using test::Random;

namespace {

constexpr double pi = 3.14159265358979323846;

GoalPotential potential_of(const Robot& robot, const Goal& goal, const Eigen::VectorXd& q) {
  KinematicState state(robot);
  state.update(robot, q, Eigen::VectorXd::Zero(q.size()));
  GoalPotential found(robot.num_coordinates());
  found.update(goal, state, Gain(Eigen::MatrixXd::Identity(q.size(), q.size())));
  return found;
}

Eigen::Isometry3d tip_at(const Robot& robot, const Eigen::VectorXd& q) {
  KinematicState state(robot);
  state.update(robot, q, Eigen::VectorXd::Zero(q.size()));
  return frame_pose(robot, state, robot.frame_index("tip"));
}

GeometricSystem flat_system(const Robot& robot) {
  const int nv = robot.num_coordinates();
  return GeometricSystem(robot, {}, {Eigen::MatrixXd::Identity(nv, nv), 2.0 * Eigen::MatrixXd::Identity(nv, nv)});
}

}  // namespace

BOOST_AUTO_TEST_CASE(gradients_are_those_of_the_potential) {
  Random random(1);
  for (int trial = 0; trial < 300; ++trial) {
    const Robot robot = test::random_tree(random, 7);
    const int nv = robot.num_coordinates();
    const auto& frames = robot.frames();
    const std::string frame = frames[static_cast<std::size_t>(random.integer(0, static_cast<int>(frames.size()) - 1))].name;
    PoseGoalSettings settings;
    settings.position_only = trial % 3 == 0;
    const Goal goal = PoseGoal(robot, frame, test::random_pose(random, 0.3), settings);
    const Eigen::VectorXd q = random.vector(nv);
    const GoalPotential found = potential_of(robot, goal, q);
    if (!settings.position_only && found.rotation_error > pi - 0.05) {
      continue;  // the ridge, below
    }
    for (int j = 0; j < nv; ++j) {
      constexpr double step = 1e-6;
      const Eigen::VectorXd dq = step * Eigen::VectorXd::Unit(nv, j);
      const double slope =
          (potential_of(robot, goal, q + dq).potential - potential_of(robot, goal, q - dq).potential) / (2.0 * step);
      // central differences: step² times third derivatives, and rounding of U over the step
      BOOST_TEST(std::abs(found.gradient[j] - slope) < 1e-7 * (1.0 + found.potential));
    }
  }
}

BOOST_AUTO_TEST_CASE(rotation_vectors_invert_the_exponential_up_to_a_half_turn) {
  Random random(2);
  for (const double angle : {0.0, 1e-12, 1e-7, 0.3, 2.0, 3.0, pi - 1e-6, pi - 1e-12, pi}) {
    for (int trial = 0; trial < 100; ++trial) {
      const Eigen::Vector3d axis = Eigen::Vector3d(random.vector(3)).normalized();
      const Eigen::Vector3d phi = rotation_vector(Eigen::AngleAxisd(angle, axis).toRotationMatrix());
      // rounding of the matrix entries; at the half turn either way is right
      const double error = std::min((phi - angle * axis).norm(), angle > 3.1 ? (phi + angle * axis).norm() : 1.0);
      BOOST_TEST(error < 1e-5 * (angle > 3.1) + 1e-14);
      BOOST_TEST(phi.norm() <= pi + 1e-15);  // rounding of the norm
    }
  }
}

BOOST_AUTO_TEST_CASE(a_half_turn_is_left_and_ends_at_the_goal) {
  const Robot robot = test::serial_arm(test::arm_limits(7));
  Random random(3);
  const GeometricSystem system = flat_system(robot);
  for (int trial = 0; trial < 5; ++trial) {
    const Eigen::VectorXd q = 0.5 * random.vector(7).cwiseMax(-2.0).cwiseMin(2.0);
    Eigen::Isometry3d pose = tip_at(robot, q);
    const Eigen::Matrix3d opposite = pose.linear() * Eigen::AngleAxisd(pi, Eigen::Vector3d::UnitZ());
    pose.linear() = opposite;
    PoseGoalSettings settings;
    settings.position_stiffness = 0.0;  // the turn alone
    const Goal goal = PoseGoal(robot, "tip", pose, settings);
    const GoalPotential first = potential_of(robot, goal, q);
    BOOST_TEST(first.gradient.allFinite());
    BOOST_TEST(std::abs(first.rotation_error - pi) < 1e-6);
    const Rollout motion = rollout(system, q, Eigen::VectorXd::Zero(7), goal, Obstacles::none(), {0.005, 4000});
    const GoalPotential last = potential_of(robot, goal, motion.q.row(4000).transpose());
    BOOST_TEST(last.rotation_error < 0.02);
  }
}

BOOST_AUTO_TEST_CASE(a_position_is_reached_and_the_posture_pull_does_not_move_it) {
  const Robot robot = test::serial_arm(test::arm_limits(7));
  const GeometricSystem system = flat_system(robot);
  const Eigen::VectorXd target = Eigen::VectorXd::LinSpaced(7, 0.3, 1.2), start = 0.6 * Eigen::VectorXd::Ones(7);
  double away[2];
  for (const double posture : {0.0, 0.3}) {
    PoseGoalSettings settings;
    settings.position_only = true;  // four joints are free
    settings.posture_stiffness = posture;
    settings.rest = Eigen::VectorXd::Constant(7, 0.2);
    const Goal goal = PoseGoal(robot, "tip", tip_at(robot, target), settings);
    const Rollout motion = rollout(system, start, Eigen::VectorXd::Zero(7), goal, Obstacles::none(), {0.01, 10000});
    const Eigen::VectorXd end = motion.q.row(10000);
    const GoalPotential found = potential_of(robot, goal, end);
    // 100 s at rates of 0.05 /s and more; with the posture pull λ²/σ² of it remains
    BOOST_TEST(found.position_error < 5e-3);
    BOOST_TEST(found.gradient.norm() < 1e-3);  // nothing is left to gain, of 0.3 rad/s² and more at the start
    away[posture > 0.0] = (end - settings.rest).norm();
  }
  BOOST_TEST(away[1] < 0.9 * away[0]);  // the free motion is used
}

BOOST_AUTO_TEST_CASE(a_moving_goal_is_followed_without_lag) {
  const Robot robot = test::serial_arm(test::arm_limits(7));
  const GeometricSystem system = flat_system(robot);
  const Eigen::VectorXd start = Eigen::VectorXd::LinSpaced(7, 0.4, 1.0);
  Vector6d twist;
  twist << 0.05, -0.02, -0.03, 0.0, 0.0, 0.0;
  PoseGoalSettings stiff;
  stiff.position_stiffness = 20.0;
  stiff.position_only = true;
  double error[2];
  for (const bool announced : {false, true}) {
    Goal goal = PoseGoal(robot, "tip", tip_at(robot, start), stiff, twist);
    const Rollout motion = rollout(system, start, Eigen::VectorXd::Zero(7), goal, Obstacles::none(), {0.005, 1200});
    if (announced) {
      advance(goal, 6.0);
      error[1] = potential_of(robot, goal, motion.q.row(1200).transpose()).position_error;
    } else {  // the same goal, moved without saying so
      GeometricSystem::Workspace w(system);
      Eigen::VectorXd q = start, v = Eigen::VectorXd::Zero(7);
      for (int k = 0; k < 1200; ++k) {
        Goal still = goal;
        std::get<PoseGoal>(still).twist.setZero();
        static_cast<void>(system.acceleration(q, v, still, Obstacles::none(), w));
        v += 0.005 * w.acceleration;
        q += 0.005 * v;
        advance(goal, 0.005);
      }
      error[0] = potential_of(robot, goal, q).position_error;
    }
  }
  BOOST_TEST(error[1] < 0.2 * error[0]);
  BOOST_TEST(error[1] < 3e-3);  // what is left is the acceleration that v* itself changes with, and the start from rest

  const Goal joints = JointGoal(start, Eigen::VectorXd::Constant(7, 0.05));
  const Rollout motion = rollout(system, start, Eigen::VectorXd::Constant(7, 0.05), joints, Obstacles::none(), {0.01, 500});
  const Eigen::VectorXd expected = start + 5.0 * Eigen::VectorXd::Constant(7, 0.05);
  BOOST_TEST((motion.q.row(500).transpose() - expected).norm() < 1e-12);  // it starts on the goal and stays: rounding

  // From rest, with the acceleration of the goal: what is left is the step of the integration, ½ dt a t.
  const Goal faster = JointGoal(start, Eigen::VectorXd::Zero(7), Eigen::VectorXd::Constant(7, 0.1));
  const Rollout ahead = rollout(system, start, Eigen::VectorXd::Zero(7), faster, Obstacles::none(), {0.001, 2000});
  const Eigen::VectorXd there = start + 0.5 * 2.0 * 2.0 * Eigen::VectorXd::Constant(7, 0.1);
  BOOST_TEST((ahead.q.row(2000).transpose() - there).lpNorm<Eigen::Infinity>() < 1e-4);
}

BOOST_AUTO_TEST_CASE(what_is_wrong_with_a_goal_is_said) {
  const Robot robot = test::serial_arm(test::arm_limits(7));
  const Robot other = test::serial_arm(test::arm_limits(5));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  BOOST_TEST((check(PoseGoal(robot, "tip", pose), robot) == GoalFault::none));
  BOOST_TEST((check(PoseGoal(other, "tip", pose), robot) == GoalFault::invalid));
  BOOST_TEST((check(JointGoal(Eigen::VectorXd::Zero(5)), robot) == GoalFault::invalid));
  BOOST_TEST((check(JointGoal(Eigen::VectorXd::Constant(7, nan)), robot) == GoalFault::invalid));
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(7);
  BOOST_TEST((check(JointGoal(rest, rest, Eigen::VectorXd::Constant(7, nan)), robot) == GoalFault::invalid));
  BOOST_CHECK_THROW(JointGoal(rest, rest, Eigen::VectorXd::Zero(6)), std::invalid_argument);
  BOOST_TEST((check(JointGoal(Eigen::VectorXd::Constant(7, 2.6)), robot) == GoalFault::outside_limits));
  pose.translation().z() = nan;
  BOOST_TEST((check(PoseGoal(robot, "tip", pose), robot) == GoalFault::invalid));
  pose.translation().z() = 0.3 * 7 + 0.01;  // 0.3 m to the shoulder, 1.8 m of arm
  BOOST_TEST((check(PoseGoal(robot, "tip", pose), robot) == GoalFault::out_of_reach));
  pose.translation().z() -= 0.02;
  BOOST_TEST((check(PoseGoal(robot, "tip", pose), robot) == GoalFault::none));

  const auto message_has = [](const char* text) {
    return [text](const std::invalid_argument& e) { return std::string(e.what()).find(text) != std::string::npos; };
  };
  BOOST_CHECK_EXCEPTION(PoseGoal(robot, "hand", pose), std::invalid_argument, message_has("tip"));
  Eigen::Isometry3d sheared = pose;
  sheared.matrix()(0, 1) = 0.1;
  BOOST_CHECK_EXCEPTION(PoseGoal(robot, "tip", sheared), std::invalid_argument, message_has("not a rotation"));
  PoseGoalSettings bad;
  bad.position_stiffness = -1.0;
  BOOST_CHECK_EXCEPTION(PoseGoal(robot, "tip", pose, bad), std::invalid_argument, message_has("position stiffness is -1"));
  PoseGoalSettings homeless;
  homeless.posture_stiffness = 1.0;
  BOOST_CHECK_EXCEPTION(PoseGoal(robot, "tip", pose, homeless), std::invalid_argument, message_has("needs a rest"));
}

BOOST_AUTO_TEST_CASE(a_goal_that_would_move_out_of_the_finite_stays) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  const Robot robot = test::serial_arm(test::arm_limits(7));
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation().z() = 1.0;
  Vector6d twist = Vector6d::Zero();
  for (const int axis : {0, 4}) {
    twist.setZero();
    twist[axis] = 1e300;
    for (const double duration : {nan, infinity, -infinity, 1e300}) {
      Goal goal = PoseGoal(robot, "tip", pose, {}, twist);
      BOOST_TEST(!advance(goal, duration));
      BOOST_TEST((std::get<PoseGoal>(goal).pose.matrix() == pose.matrix()));
    }
  }
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(7), one = Eigen::VectorXd::Ones(7);
  for (const double duration : {nan, infinity, 1e300}) {
    Goal goal = JointGoal(rest, one, one);
    BOOST_TEST(!advance(goal, duration));
    BOOST_TEST((std::get<JointGoal>(goal).position == rest));
    BOOST_TEST((std::get<JointGoal>(goal).velocity == one));
  }
  Goal goal = JointGoal(rest, one, one);
  BOOST_TEST(advance(goal, 2.0));
  BOOST_TEST((std::get<JointGoal>(goal).position == 4.0 * one));
  BOOST_TEST((std::get<JointGoal>(goal).velocity == 3.0 * one));
}

// Whole motions: they repeat, arrive with every part left out, take the short way round, and reach poses.
#include "sidestep/controller/motion.hpp"

#include <limits>
#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <chrono>
#include <cmath>
#include <numbers>
#include <string>
#include <thread>

#include "sidestep/controller/posture_search.hpp"
#include "support/covered_arm.hpp"
#include "support/numbers.hpp"
#include "support/random.hpp"

using namespace sidestep;
using test::covered_arm;
using test::nv;
using test::pose_of;
using test::state_at;
using test::Random;

namespace {

constexpr double pi = std::numbers::pi;

/// Steps until the controller has arrived.
bool arrives(Controller& controller, Eigen::VectorXd& q, Eigen::VectorXd& v, int steps) {
  const double period = controller.settings().period;
  for (int k = 0; k < steps; ++k) {
    const Command& command = controller.step(q, v);
    BOOST_REQUIRE(to_string(command.status) != std::string("clearance_lost"));
    BOOST_REQUIRE(to_string(command.status) != std::string("stopping"));
    if (command.activity == Activity::arrived) {
      return true;
    }
    v += period * command.acceleration;
    q += period * v;
  }
  return false;
}

/// A swing of the arm, bent by a right angle, over a ball in its way.
const Eigen::VectorXd swing_from = (Eigen::VectorXd(nv) << -0.9, 0.9, 0.0, 0.6, 0.0, 0.0, 0.0).finished();
const Eigen::VectorXd swing_to = (Eigen::VectorXd(nv) << 0.9, 0.9, 0.0, 0.6, 0.0, 0.0, 0.0).finished();

Obstacles in_the_way(const Robot& robot, double beside) {
  const Eigen::VectorXd middle = 0.5 * (swing_from + swing_to);
  Eigen::Vector3d tip = frame_pose(robot, state_at(robot, middle), robot.frame_index("tip")).translation();
  tip.z() += beside;
  return test::ball(tip, 0.06);
}

}  // namespace

BOOST_AUTO_TEST_CASE(synchronous_motions_repeat_bit_for_bit) {
  ControllerSettings settings;
  settings.synchronous = true;
  settings.look_ahead->tries = 30;
  const Arm arm = covered_arm(test::arm_limits(nv));
  const auto motion = [&](std::uint64_t seed) {
    ControllerSettings own = settings;
    own.seed = seed;
    Controller controller(arm, own);
    controller.set_obstacles(Obstacles::none());
    controller.set_goal(pose_of(arm.robot(), swing_to));
    const Eigen::Vector3d ball = in_the_way(arm.robot(), 0.0).points().col(0);
    Eigen::Matrix3Xd points(3, 2), velocities = Eigen::Matrix3Xd::Zero(3, 2);
    points.col(0) = ball;
    points.col(1) << 1.0, 1.0, 1.2;
    velocities.col(1) << -0.5, -0.5, 0.0;
    controller.set_obstacles(Obstacles(points, Eigen::VectorXd::Constant(2, 0.06), velocities), test::for_ever);
    return integrate(controller, swing_from, Eigen::VectorXd::Zero(nv), 1500);
  };
  const MotionRecord first = motion(0);
  const MotionRecord other = motion(5);  // in between
  const MotionRecord again = motion(0);
  BOOST_TEST((first.q == again.q));
  BOOST_TEST((first.acceleration == again.acceleration));
  BOOST_TEST((first.clearance == again.clearance));
  BOOST_TEST((first.statuses == again.statuses));
  BOOST_TEST((first.activities == again.activities));
  BOOST_TEST((first.last_q - swing_from).norm() > 0.5);
}

BOOST_AUTO_TEST_CASE(with_any_part_left_out_it_arrives_or_says_why_not) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  const Robot& robot = arm.robot();
  int reached = 0;
  for (int parts = 0; parts < 16; ++parts) {
    for (const bool pose : {false, true}) {
      for (const auto output : {ControllerSettings::Output::torque, ControllerSettings::Output::acceleration}) {
        ControllerSettings settings;
        settings.synchronous = true;
        settings.output = output;
        if ((parts & 1) != 0) {
          settings.planner.reset();
        }
        if ((parts & 2) != 0) {
          settings.look_ahead.reset();
        }
        if ((parts & 4) != 0) {
          settings.local_minimum.reset();
        }
        settings.local_activation = (parts & 8) == 0;
        BOOST_TEST_CONTEXT("without " << parts << ", pose " << pose << ", torque "
                                      << (output == ControllerSettings::Output::torque)) {
          Controller controller(arm, settings);
          controller.set_obstacles(Obstacles::none());
          BOOST_TEST(controller.has_torque() == (output == ControllerSettings::Output::torque));
          controller.set_obstacles(in_the_way(robot, -0.1), test::for_ever);
          if (pose) {
            controller.set_goal(pose_of(robot, swing_to));
          } else {
            controller.set_goal(swing_to);
          }
          Eigen::VectorXd q = swing_from, v = Eigen::VectorXd::Zero(nv);
          const bool arrived = arrives(controller, q, v, 20000);
          reached += arrived;
          const std::string why = controller.explain();
          if (arrived) {
            BOOST_TEST(why == "arrived");
            if (!pose) {
              BOOST_TEST((q - swing_to).cwiseAbs().maxCoeff() <= settings.arrival.joint);
            }
          } else {
            BOOST_TEST_MESSAGE(why);
            BOOST_TEST(!settings.local_activation);  // it creeps then where barriers are near
            BOOST_TEST((why.find("link") != std::string::npos || why.find("path") != std::string::npos ||
                        why.find("arriving") != std::string::npos));
          }
        }
      }
    }
  }
  BOOST_TEST(reached >= 56);  // of 64
}

BOOST_AUTO_TEST_CASE(a_joint_without_limits_takes_the_short_way_also_where_its_encoder_wraps) {
  JointLimits limits = test::arm_limits(nv);
  limits.lower[0] = limits.lower[2] = -test::infinity;
  limits.upper[0] = limits.upper[2] = test::infinity;
  const Arm arm = covered_arm(limits);
  for (const bool planner : {true, false}) {
    for (const bool wraps : {true, false}) {
      for (const bool follows : {true, false}) {
        ControllerSettings settings;
        settings.synchronous = true;
        if (!planner) {
          settings.planner.reset();
        }
        Controller controller(arm, settings);
        controller.set_obstacles(Obstacles::none());
        Eigen::VectorXd q = Eigen::VectorXd::Constant(nv, 0.4), v = Eigen::VectorXd::Zero(nv), goal = q;
        q[0] = 3.0;
        goal[0] = -3.0;
        if (follows) {
          controller.set_goal(Goal(JointGoal(goal, 1e-6 * Eigen::VectorXd::Unit(nv, 0))));
        } else {
          controller.set_goal(goal);
        }
        double fastest = 0.0;
        for (int k = 0; k < 6000; ++k) {
          Eigen::VectorXd seen = q;
          if (wraps) {
            seen[0] = std::remainder(q[0], 2.0 * pi);
          }
          const Command& command = controller.step(seen, v);
          BOOST_REQUIRE((command.position - seen).cwiseAbs().maxCoeff() < 0.01);  // in the coordinates of the encoder
          v += settings.period * command.acceleration;
          q += settings.period * v;
          fastest = std::max(fastest, v.cwiseAbs().maxCoeff());
          BOOST_REQUIRE(q[0] > 2.9);
          BOOST_REQUIRE(q[0] < 3.5);
        }
        BOOST_TEST(std::abs(q[0] - (2.0 * pi - 3.0)) < 0.02);
        // By the spring, or along the planner's path: half of the way as quickly as the joint can, and no turn.
        const double way = 2.0 * pi - 6.0;
        BOOST_TEST(fastest < (planner && !follows ? std::sqrt(way * arm.robot().limits().acceleration[0]) : 0.5));
        if (!follows) {
          const double turn = wraps ? 0.0 : 2.0 * pi;  // the target is seen in the coordinates of the state
          BOOST_TEST(std::abs(controller.target()[0] - (turn - 3.0)) < 1e-9);
        }
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(integrate_sees_a_turn_more_as_the_same_place) {
  JointLimits limits = test::arm_limits(nv);
  limits.lower[0] = -test::infinity;
  limits.upper[0] = test::infinity;
  ControllerSettings settings;
  settings.synchronous = true;
  Controller controller(covered_arm(limits), settings);
  controller.set_obstacles(Obstacles::none());
  Eigen::VectorXd q = Eigen::VectorXd::Constant(nv, 0.4), goal = q;
  q[0] = 3.0;
  goal[0] = -3.0;
  controller.set_goal(goal);
  BOOST_TEST(integrate(controller, q, Eigen::VectorXd::Zero(nv), 6000, goal, 0.02).arrived);
}

BOOST_AUTO_TEST_CASE(arms_without_limits_pairs_or_more_than_one_joint_move) {
  JointLimits none = JointLimits::unlimited(nv);
  none.acceleration.setConstant(10.0);
  JointLimits one = test::arm_limits(1);
  for (const auto& [limits, pairs] : {std::pair{none, true}, std::pair{test::arm_limits(nv), false}, std::pair{one, false}}) {
    const Arm arm = covered_arm(limits, pairs, false);
    const int num = arm.num_coordinates();
    ControllerSettings settings;
    settings.synchronous = true;
    Controller controller(arm, settings);
    controller.set_obstacles(Obstacles::none());
    BOOST_TEST(!controller.has_torque());
    const Eigen::VectorXd goal = Eigen::VectorXd::Constant(num, 0.5);
    controller.set_goal(goal);
    Eigen::VectorXd q = Eigen::VectorXd::Constant(num, 0.1), v = Eigen::VectorXd::Zero(num);
    controller.set_obstacles(test::ball({1.0, 1.0, 0.5}, 0.05));
    BOOST_TEST(arrives(controller, q, v, 10000));
    controller.set_goal(pose_of(arm.robot(), Eigen::VectorXd::Constant(num, 0.3)));
    BOOST_TEST(arrives(controller, q, v, 10000));
  }
}

BOOST_AUTO_TEST_CASE(poses_are_reached_in_a_free_workspace) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  const Robot& robot = arm.robot();
  ControllerSettings settings;
  settings.synchronous = true;
  Random random(3);
  const auto draw = [&] { return Eigen::VectorXd::NullaryExpr(nv, [&](Eigen::Index) { return random.uniform(-2.3, 2.3); }); };
  const ClearanceQuery body(robot, arm.body(), arm.pairs());
  ClearanceQuery::Workspace workspace(body);
  const auto free = [&](const Eigen::VectorXd& q) {
    return body.nearest(q, Obstacles::none(), 0.1, workspace).clearance > 0.02;
  };
  int reached = 0;
  constexpr int num = 50;
  for (int k = 0; k < num; ++k) {
    Eigen::VectorXd q = draw(), there = draw(), v = Eigen::VectorXd::Zero(nv);
    while (!free(q)) {
      q = draw();
    }
    while (!free(there)) {
      there = draw();
    }
    Controller controller(arm, settings);
    controller.set_obstacles(Obstacles::none());
    const PoseGoal goal = pose_of(robot, there);
    controller.set_goal(goal);
    const bool arrived = arrives(controller, q, v, 20000);
    const PoseError error = pose_error(goal, state_at(robot, q));
    BOOST_TEST(arrived == (error.position <= 1e-3 && error.rotation <= 0.0088 && arrived));
    reached += arrived;
    if (!arrived) {
      BOOST_TEST_MESSAGE(k << ": " << error.position << " m " << error.rotation << " rad, " << controller.explain());
    }
  }
  BOOST_TEST(reached >= 48);  // 95 %
}

BOOST_AUTO_TEST_CASE(a_posture_that_is_searched_for_an_old_goal_is_not_followed) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  ControllerSettings settings;
  settings.contact.share = std::numeric_limits<double>::infinity();  // the arm here stays where it is, as one that is held
  Controller controller(arm, settings);                              // with its worker
  controller.set_obstacles(Obstacles::none());
  Eigen::VectorXd q = Eigen::VectorXd::Constant(nv, 0.3), v = Eigen::VectorXd::Zero(nv);
  Random random(5);
  Eigen::VectorXd last = swing_to;
  for (int k = 0; k < 40; ++k) {  // every goal takes the place of one that is searched for
    last = k + 1 == 40 ? swing_to : Eigen::VectorXd(0.5 * random.vector(nv));
    controller.set_goal(pose_of(arm.robot(), last));
    controller.step(q, v);
    std::this_thread::sleep_for(std::chrono::milliseconds(random.integer(0, 4)));
    controller.step(q, v);
  }
  for (int k = 0; k < 20000 && controller.target().size() == 0; ++k) {
    controller.step(q, v);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  BOOST_REQUIRE(controller.target().size() == nv);
  BOOST_TEST(pose_error(pose_of(arm.robot(), last), state_at(arm.robot(), controller.target())).position < 1e-6);
}

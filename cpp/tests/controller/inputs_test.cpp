// Velocities, twists and trajectories: followed where it is free, within limits, and as the behaviour says where it is not.
#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <string>
#include <thread>

#include "sidestep/controller/controller.hpp"
#include "support/allocations.hpp"
#include "support/covered_arm.hpp"
#include "support/numbers.hpp"
#include "support/repeatable_settings.hpp"

using namespace sidestep;
using test::ball;
using test::covered_arm;
using test::nv;

namespace {

constexpr double tick = 0.001;

ControllerSettings repeatable() { return test::repeatable_settings(ControllerSettings::Output::acceleration); }

Eigen::VectorXd bent() {
  Eigen::VectorXd q(nv);
  for (Eigen::Index j = 0; j < nv; ++j) {
    q[j] = j % 2 == 0 ? 0.4 : -0.7;
  }
  return q;
}

/// A model that does what it is told.
struct Model {
  Eigen::VectorXd q = bent(), v = Eigen::VectorXd::Zero(nv);

  const Command& step(Controller& controller) {
    const Command& command = controller.step(q, v);
    v += tick * command.acceleration;
    q += tick * v;
    return command;
  }
};

/// Samples every 50 ms along a straight line there and in `time` [s], at rest at both ends.
void line(const Eigen::VectorXd& from, const Eigen::VectorXd& to, double time, Eigen::MatrixXd& q, Eigen::VectorXd& times) {
  const int num = static_cast<int>(std::lround(time / 0.05)) + 1;
  q.resize(from.size(), num);
  times = Eigen::VectorXd::LinSpaced(num, 0.0, time);
  for (int k = 0; k < num; ++k) {
    const double u = times[k] / time, share = u * u * u * (10.0 + u * (6.0 * u - 15.0));
    q.col(k) = from + share * (to - from);
  }
}

/// How far q is from the segment between two configurations, in the farthest joint.
double off(const Eigen::VectorXd& q, const Eigen::VectorXd& from, const Eigen::VectorXd& to) {
  const Eigen::VectorXd along = to - from;
  const double share = std::clamp((q - from).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (q - from - share * along).cwiseAbs().maxCoeff();
}

template <class Action>
std::string refusal(Action&& action) {
  try {
    action();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

Eigen::Vector3d tip_of(const Arm& arm, const Eigen::VectorXd& q) {
  return frame_pose(arm.robot(), test::state_at(arm.robot(), q), arm.robot().frame_index("tip")).translation();
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_velocity_is_reached_scaled_to_the_limits_and_given_up_when_commands_stop) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  Controller controller(arm, repeatable());
  controller.set_obstacles(Obstacles::none());
  Model model;
  Eigen::VectorXd wanted = Eigen::VectorXd::Zero(nv);
  wanted[0] = 0.3;
  wanted[3] = -0.2;
  for (int k = 0; k < 500; ++k) {
    controller.set_velocity(wanted);
    BOOST_TEST((model.step(controller).activity == Activity::moving));
  }
  BOOST_TEST((model.v - wanted).cwiseAbs().maxCoeff() < 1e-3);
  const double most =
      controller.settings().speed * (1.0 - controller.settings().limit_margin) * arm.robot().limits().velocity[0];
  wanted *= 100.0 * most;  // the direction stays
  for (int k = 0; k < 450; ++k) {
    controller.set_velocity(-wanted);
    model.step(controller);
  }
  BOOST_TEST((model.v.cwiseAbs() - arm.robot().limits().velocity).maxCoeff() < 0.0);
  BOOST_TEST(std::abs(model.v[3] / model.v[0] + 2.0 / 3.0) < 0.01);
  for (int k = 0; k < 1000; ++k) {
    model.step(controller);
  }
  BOOST_TEST((controller.command().activity == Activity::no_goal));
  BOOST_TEST(model.v.cwiseAbs().maxCoeff() < 1e-3);
}

BOOST_AUTO_TEST_CASE(what_is_wrong_with_an_order_is_named_and_the_order_before_stays) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  Controller controller(arm, repeatable());
  controller.set_obstacles(Obstacles::none());
  Eigen::VectorXd wanted = Eigen::VectorXd::Zero(nv);
  wanted[0] = 0.3;
  controller.set_velocity(wanted);
  const std::string joint = arm.robot().coordinate_names()[2];
  Eigen::VectorXd bad = wanted;
  bad[2] = test::not_a_number;
  BOOST_TEST(refusal([&] { controller.set_velocity(bad); }).find("joint '" + joint + "' is nan, allowed: finite") !=
             std::string::npos);
  BOOST_TEST(refusal([&] { controller.set_velocity(Eigen::VectorXd::Zero(2)); }).find("has 2 entries") != std::string::npos);
  BOOST_TEST(refusal([&] { controller.set_twist("hand", Vector6d::Zero()); }).find("'hand'; its links are: link1") !=
             std::string::npos);
  BOOST_TEST(refusal([&] { controller.set_twist("tip", Vector6d::Constant(test::infinity)); }).find("inf") !=
             std::string::npos);
  Eigen::MatrixXd q = bent().replicate(1, 3);
  BOOST_TEST(refusal([&] { controller.set_trajectory(q, Eigen::Vector3d(0.0, 0.1, 0.05)); }).find("time 2 is 0.05") !=
             std::string::npos);
  BOOST_TEST(refusal([&] { controller.set_trajectory(q, Eigen::Vector3d(-0.1, 0.1, 0.2)); }).find("time 0 is -0.1") !=
             std::string::npos);
  BOOST_TEST(refusal([&] { controller.set_trajectory(q, Eigen::Vector2d(0.0, 0.1)); }).find("3 samples") != std::string::npos);
  q(2, 1) = 100.0;
  const std::string said = refusal([&] { controller.set_trajectory(q, Eigen::Vector3d(0.0, 0.1, 0.2)); });
  BOOST_TEST(said.find("joint '" + joint + "' of sample 1 is 100.0") != std::string::npos);
  BOOST_TEST(said.find("allowed: ") != std::string::npos);
  Model model;
  for (int k = 0; k < 240; ++k) {
    model.step(controller);
  }
  BOOST_TEST(std::abs(model.v[0] - 0.3) < 0.01);
}

BOOST_AUTO_TEST_CASE(a_twist_is_followed_in_axes_of_the_world_and_of_the_frame) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  const int tip = arm.robot().frame_index("tip");
  for (const bool local : {false, true}) {
    Controller controller(arm, repeatable());
    controller.set_obstacles(Obstacles::none());
    Model model;
    Vector6d twist;
    twist << 0.05, -0.1, 0.04, 0.1, 0.0, -0.2;
    for (int k = 0; k < 800; ++k) {
      controller.set_twist("tip", twist, local);
      model.step(controller);
      if (k < 500) {
        continue;
      }
      const KinematicState state = test::state_at(arm.robot(), model.q);
      Vector6d got = frame_jacobian(arm.robot(), state, tip) * model.v;
      if (local) {
        const Eigen::Matrix3d R = frame_pose(arm.robot(), state, tip).linear();
        got << R.transpose() * got.head<3>(), R.transpose() * got.tail<3>();
      }
      BOOST_TEST((got - twist).norm() < 0.02 * twist.norm());
    }
    for (int k = 0; k < 800; ++k) {
      model.step(controller);
    }
    BOOST_TEST(model.v.cwiseAbs().maxCoeff() < 1e-3);
    BOOST_TEST((controller.command().activity == Activity::no_goal));
  }
}

BOOST_AUTO_TEST_CASE(a_twist_rests_at_a_joint_limit_and_comes_back) {
  JointLimits limits = test::arm_limits(nv);
  limits.upper[0] = bent()[0] + 0.15;
  limits.lower[0] = bent()[0] - 0.15;
  const Arm arm = covered_arm(limits);
  const int tip = arm.robot().frame_index("tip");
  Controller controller(arm, repeatable());
  controller.set_obstacles(Obstacles::none());
  Model model;
  Vector6d twist = Vector6d::Zero();
  twist[5] = 0.3;  // the tip turns about the vertical
  for (int k = 0; k < 2000; ++k) {
    controller.set_twist("tip", twist);
    model.step(controller);
    BOOST_TEST(model.q[0] < limits.upper[0]);
  }
  const Vector6d got = frame_jacobian(arm.robot(), test::state_at(arm.robot(), model.q), tip) * model.v;
  BOOST_TEST(got.norm() < 0.01);  // the other joints cannot turn the tip alone: nothing moves across what is asked
  BOOST_TEST((controller.command().status >= SafetyStatus::limited));
  BOOST_TEST(controller.command().input_change.cwiseAbs().maxCoeff() > 0.1);
  for (int k = 0; k < 600; ++k) {
    controller.set_twist("tip", -twist);
    model.step(controller);
  }
  const Vector6d back = frame_jacobian(arm.robot(), test::state_at(arm.robot(), model.q), tip) * model.v;
  BOOST_TEST((back + twist).norm() < 0.02 * twist.norm());
}

BOOST_AUTO_TEST_CASE(a_twist_through_a_singular_configuration_stays_within_limits_and_comes_back) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  Controller controller(arm, repeatable());
  controller.set_obstacles(Obstacles::none());
  Model model;
  const Eigen::Vector3d before = tip_of(arm, model.q);
  Vector6d twist = Vector6d::Zero();
  twist.head<3>() = 0.3 * (before - Eigen::Vector3d(0.0, 0.0, 0.3)).normalized();  // outwards, beyond reach
  for (int k = 0; k < 6000; ++k) {
    controller.set_twist("tip", k < 3000 ? twist : Vector6d(-twist));
    const Command& command = model.step(controller);
    BOOST_TEST((command.status <= SafetyStatus::limited));
    BOOST_TEST((model.v.cwiseAbs() - arm.robot().limits().velocity).maxCoeff() < 1e-6);
    if (k == 2999) {
      BOOST_TEST(model.v.cwiseAbs().maxCoeff() < 0.2);  // stretched, and calm
    }
  }
  BOOST_TEST((tip_of(arm, model.q) - tip_of(arm, bent())).dot(twist.head<3>()) < 0.0);
}

BOOST_AUTO_TEST_CASE(a_trajectory_is_kept_to_a_milliradian_and_arrives_in_time) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  Controller controller(arm, repeatable());
  controller.set_obstacles(Obstacles::none());
  Model model;
  Eigen::MatrixXd q;
  Eigen::VectorXd times, end = bent();
  end.array() += 0.5;
  line(bent(), end, 2.0, q, times);
  for (const auto behaviour : {TrajectoryBehaviour::keep_path, TrajectoryBehaviour::steer}) {
    model = Model();
    controller.set_trajectory(q, times, behaviour);
    double most = 0.0;
    for (int k = 0; k < 2300; ++k) {
      const Command& command = model.step(controller);
      most = std::max(most, command.deviation);
      BOOST_TEST(command.delay < 0.02);
    }
    BOOST_TEST_MESSAGE("deviation " << most);
    BOOST_TEST(most < 1e-3);
    BOOST_TEST((controller.command().activity == Activity::arrived));
    BOOST_TEST((model.q - end).cwiseAbs().maxCoeff() < 0.01);
  }
}

BOOST_AUTO_TEST_CASE(a_trajectory_that_is_too_fast_is_run_as_fast_as_limits_allow_on_its_path) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  Controller controller(arm, repeatable());
  controller.set_obstacles(Obstacles::none());
  Model model;
  Eigen::VectorXd end = bent();
  end.array() += 0.5;
  Eigen::MatrixXd q(nv, 2);
  q << bent(), end;
  controller.set_trajectory(q, Eigen::Vector2d(0.0, 0.01));
  double most = 0.0;
  int steps = 0;
  while (steps < 5000 && model.step(controller).activity != Activity::arrived) {
    most = std::max(most, off(model.q, bent(), end));
    BOOST_TEST((controller.command().status <= SafetyStatus::limited));
    ++steps;
  }
  BOOST_TEST_MESSAGE("too fast: " << steps << " steps, off " << most);
  BOOST_TEST(steps < 3000);
  BOOST_TEST(most < 1e-3);
  BOOST_TEST(controller.command().delay > 0.1);
}

BOOST_AUTO_TEST_CASE(a_first_sample_later_than_the_order_is_led_to) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  Controller controller(arm, repeatable());
  controller.set_obstacles(Obstacles::none());
  Model model;
  Eigen::VectorXd end = bent();
  end.array() += 0.2;
  controller.set_trajectory(end, Eigen::VectorXd::Constant(1, 1.0));
  double most = 0.0;
  for (int k = 0; k < 1200; ++k) {
    most = std::max(most, model.step(controller).deviation);
  }
  BOOST_TEST(most < 0.01);
  BOOST_TEST((model.q - end).cwiseAbs().maxCoeff() < 0.01);
}

BOOST_AUTO_TEST_CASE(keep_path_waits_before_what_blocks_it_and_goes_on_when_that_is_taken_away) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  Controller controller(arm, repeatable());
  controller.set_obstacles(Obstacles::none());
  Model model;
  Eigen::VectorXd end = bent();
  end[0] += 1.5;
  Eigen::MatrixXd q;
  Eigen::VectorXd times;
  line(bent(), end, 2.0, q, times);
  controller.set_trajectory(q, times);
  Eigen::VectorXd halfway = bent();
  halfway[0] += 1.0;
  controller.set_obstacles(ball(tip_of(arm, halfway), 0.05).named({"ball"}, {1}));
  double most = 0.0, least = test::infinity;
  for (int k = 0; k < 4000; ++k) {
    const Command& command = model.step(controller);
    most = std::max(most, off(model.q, bent(), end));
    least = std::min(least, command.clearance);
  }
  BOOST_TEST_MESSAGE("blocked: off " << most << ", clearance " << least << ", " << controller.explain());
  BOOST_TEST((controller.command().activity == Activity::waiting));
  BOOST_TEST(controller.explain().find("blocked by 'ball'") != std::string::npos);
  BOOST_TEST(controller.command().delay > 2.0 - 1.5);
  BOOST_TEST(model.v.cwiseAbs().maxCoeff() < 1e-3);
  BOOST_TEST(model.q[0] > bent()[0] + 0.3);
  BOOST_TEST(least > 0.003);
  BOOST_TEST(most < 1e-3);
  controller.remove_obstacles("scene");
  for (int k = 0; k < 2500; ++k) {
    model.step(controller);
    most = std::max(most, off(model.q, bent(), end));
  }
  BOOST_TEST((controller.command().activity == Activity::arrived));
  BOOST_TEST((model.q - end).cwiseAbs().maxCoeff() < 0.01);
  BOOST_TEST(most < 1e-3);
}

BOOST_AUTO_TEST_CASE(steer_goes_around_and_rejoins) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  Controller controller(arm, repeatable());
  controller.set_obstacles(Obstacles::none());
  Model model;
  Eigen::VectorXd end = bent(), halfway = bent();
  end[0] += 1.5;
  halfway[0] += 0.75;
  Eigen::MatrixXd q;
  Eigen::VectorXd times;
  line(bent(), end, 4.0, q, times);
  controller.set_trajectory(q, times, TrajectoryBehaviour::steer);
  controller.set_obstacles(ball(tip_of(arm, halfway) + Eigen::Vector3d(0.0, 0.0, 0.05), 0.05));
  double most = 0.0, least = test::infinity;
  int steps = 0;
  while (steps < 15000 && model.step(controller).activity != Activity::arrived) {
    most = std::max(most, controller.command().deviation);
    least = std::min(least, controller.command().clearance);
    ++steps;
  }
  BOOST_TEST_MESSAGE("steer: " << steps << " steps, deviation " << most << ", clearance " << least << ", "
                               << controller.explain());
  BOOST_TEST((controller.command().activity == Activity::arrived));
  BOOST_TEST(most > 0.02);
  BOOST_TEST(least > 0.0);
}

BOOST_AUTO_TEST_CASE(a_step_allocates_nothing_with_velocities_twists_and_trajectories) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  ControllerSettings settings;
  settings.output = ControllerSettings::Output::torque;
  Controller controller(arm, settings);
  controller.set_obstacles(Obstacles::none());
  Model model;
  Eigen::VectorXd end = bent();
  end.array() += 0.3;
  Eigen::MatrixXd q;
  Eigen::VectorXd times;
  line(bent(), end, 0.4, q, times);
  times.array() += 0.01;
  std::size_t allocations = 0;
  for (int k = 0; k < 2000; ++k) {
    if (k % 100 == 0) {
      std::thread([&] {  // where allocations do not count
        const int kind = k / 100 % 4;
        if (kind == 0) {
          controller.set_velocity(Eigen::VectorXd::Constant(nv, 0.1));
        } else if (kind == 1) {
          controller.set_twist("tip", Vector6d::Constant(0.1), true,
                               k % 800 == 100 ? TwistFreedom::rotation : TwistFreedom::none);
        } else {
          controller.set_trajectory(q, times, kind == 2 ? TrajectoryBehaviour::keep_path : TrajectoryBehaviour::steer);
        }
        controller.set_obstacles(ball({0.5, 0.4, 1.2}, 0.05, {0.0, -0.1, 0.0}), test::for_ever);
      })
          .join();
    }
    allocations += test::allocations_of([&] { controller.step(model.q, model.v); });
    model.v += tick * controller.command().acceleration;
    model.q += tick * model.v;
  }
  BOOST_TEST(allocations == 0U);
}

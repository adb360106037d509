// The controller in its two modes: no allocation in `step`, the same motion again, clearances whatever the goal is.
#include "sidestep/controller/controller.hpp"

#include <boost/test/unit_test.hpp>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

#include "sidestep/controller/motion.hpp"
#include "support/allocations.hpp"
#include "support/covered_arm.hpp"
#include "support/random.hpp"
#include "support/serial_arm.hpp"

using namespace sidestep;

namespace {

constexpr int num_joints = 6;
constexpr double period = 0.001;

/// A chain of links of 0.3 m, covered by one ellipsoid each, with the inertia of a rod.
Arm make_arm() {
  const Robot chain = test::serial_arm(test::arm_limits(num_joints));
  std::vector<Frame> frames;
  std::vector<std::string> links;
  std::vector<Inertial> inertials;
  for (int j = 0; j < num_joints; ++j) {
    links.push_back("link" + std::to_string(j));
    frames.push_back({links.back(), j, Eigen::Isometry3d::Identity()});
    Inertial inertial;
    inertial.mass = 1.0;
    inertial.com.z() = 0.15;
    inertial.inertia = Eigen::Vector3d(0.01, 0.01, 0.002).asDiagonal();
    inertials.push_back(inertial);
  }
  Eigen::Matrix3Xd means = Eigen::Matrix3Xd::Zero(3, num_joints);
  means.row(2).setConstant(0.15);
  const Eigen::Matrix3d shape = Eigen::Vector3d(0.04, 0.04, 0.16).cwiseAbs2().asDiagonal();
  const Robot robot("chain", chain.joints(), frames, chain.coordinate_names(), chain.limits());
  const Body body(links, Eigen::VectorXd::Ones(num_joints), means, std::vector<Eigen::Matrix3d>(num_joints, shape),
                  Eigen::VectorXd::Ones(num_joints));
  return Arm(robot, body, {{"link0", "link3", 0.0}, {"link1", "link4", 0.0}, {"link1", "link5", 0.0}}, {}, inertials);
}

ControllerSettings synchronous() {
  ControllerSettings settings;
  settings.synchronous = true;
  settings.output = ControllerSettings::Output::acceleration;
  return settings;
}

Obstacles ball(const Eigen::Vector3d& at, const Eigen::Vector3d& velocity = Eigen::Vector3d::Zero()) {
  return Obstacles(at, Eigen::VectorXd::Constant(1, 0.1), velocity);
}

Eigen::VectorXd constant(double value) { return Eigen::VectorXd::Constant(num_joints, value); }

}  // namespace

BOOST_AUTO_TEST_CASE(a_step_allocates_nothing_with_everything_on_and_orders_from_another_thread) {
  const Arm arm = make_arm();
  Controller controller(arm);
  controller.set_obstacles(Obstacles::none());
  BOOST_TEST(controller.has_torque());
  Eigen::VectorXd q = constant(0.1), v = constant(0.0);
  std::size_t count = 0;
  bool on_path = false, waited = false, avoided = false;
  const Robot& robot = arm.robot();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Vector3d(0.5, 0.3, 0.9);
  for (int k = 0; k < 1500; ++k) {
    if (k % 100 == 0) {
      std::thread([&] {  // where allocations do not count
        const double side = k % 200 == 0 ? 1.0 : -1.0;
        if (k % 300 == 0) {
          controller.set_goal(Goal(PoseGoal(robot, "link5", pose)));
        } else {
          controller.set_goal(constant(0.8 * side));
        }
        controller.set_obstacles(ball({0.5, -0.6 * side, 0.9}, {0.0, 0.4 * side, 0.0}), test::for_ever);
      })
          .join();
    }
    count += test::allocations_of([&] {
      const Command& command = controller.step(q, v, period * k);
      on_path = on_path || command.on_path;
      waited = waited || command.activity == Activity::waiting;
      avoided = avoided || command.avoiding;
    });
    v += period * controller.command().acceleration;
    q += period * v;
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  BOOST_TEST(count == 0u);
  BOOST_TEST(waited);
  BOOST_TEST(q.allFinite());
  BOOST_TEST_MESSAGE("on a path: " << on_path << ", out of the way: " << avoided);
}

BOOST_AUTO_TEST_CASE(a_synchronous_motion_repeats_bit_for_bit) {
  const Arm arm = make_arm();
  Eigen::MatrixXd first;
  for (int run = 0; run < 2; ++run) {
    Controller controller(arm, synchronous());
    controller.set_obstacles(Obstacles::none());
    controller.set_goal(constant(0.9));
    controller.set_obstacles(ball({0.6, 0.3, 0.9}, {-0.1, 0.0, 0.0}), test::for_ever);
    const MotionRecord record = integrate(controller, constant(-0.4), constant(0.0), 1500);
    if (run == 0) {
      first = record.q;
    } else {
      BOOST_TEST((record.q.array() == first.array()).all());
    }
  }
}

BOOST_AUTO_TEST_CASE(clearances_bound_commands_whatever_the_goal_is) {
  const Arm arm = make_arm();
  const Eigen::VectorXd q = constant(0.0), v = constant(0.3);
  for (const int kind : {0, 1, 2}) {
    Controller controller(arm, synchronous());
    controller.set_obstacles(Obstacles::none());
    controller.set_obstacles(ball({0.17, 0.0, 1.5}));  // less than 5 cm beside the upright arm
    if (kind == 1) {
      controller.set_goal(constant(1.0));
    } else if (kind == 2) {  // drifts over its limit in the second step
      controller.set_goal(Goal(JointGoal(constant(2.5), constant(10.0))));
      static_cast<void>(controller.step(q, v));
    }
    const Command& command = controller.step(q, v);
    BOOST_TEST(controller.part_results().solution.num_safety_rows > 0);
    BOOST_TEST(command.clearance < 0.05);
    BOOST_TEST((command.activity == (kind == 0 ? Activity::no_goal : kind == 1 ? Activity::moving : Activity::blocked)));
  }
}

BOOST_AUTO_TEST_CASE(stale_obstacles_stop_the_arm_and_keep_their_clearances) {
  ControllerSettings settings = synchronous();
  settings.obstacle_timeout = 0.05;
  Controller controller(make_arm(), settings);
  controller.set_obstacles(Obstacles::none());
  controller.set_goal(constant(1.0));
  controller.set_obstacles(ball({0.17, 0.0, 1.5}));
  Eigen::VectorXd q = constant(0.0), v = constant(0.0);
  for (int k = 0; k < 600; ++k) {
    v += period * controller.step(q, v).acceleration;
    q += period * v;
  }
  BOOST_TEST((controller.command().activity == Activity::stale));
  BOOST_TEST(v.cwiseAbs().maxCoeff() < 0.02);
  BOOST_TEST(controller.command().clearance > 0.0);
  controller.set_obstacles(ball({0.17, 0.0, 1.5}));
  BOOST_TEST((controller.step(q, v).activity == Activity::moving));
}

BOOST_AUTO_TEST_CASE(bad_input_throws_or_stops_and_nothing_is_lost) {
  Controller controller(make_arm(), synchronous());
  controller.set_obstacles(Obstacles::none());
  controller.set_goal(constant(0.5));
  BOOST_CHECK_THROW(controller.set_goal(constant(3.0)), std::invalid_argument);
  BOOST_CHECK_THROW(controller.set_goal(constant(std::nan(""))), std::invalid_argument);
  BOOST_CHECK_THROW(controller.set_goal(Eigen::VectorXd::Zero(2)), std::invalid_argument);
  const Eigen::VectorXd rest = constant(0.0), wrong = Eigen::VectorXd::Zero(3), unknown = constant(std::nan(""));
  BOOST_TEST((controller.step(wrong, rest).status == SafetyStatus::stopping));
  BOOST_TEST((controller.step(unknown, rest).status == SafetyStatus::stopping));
  BOOST_TEST(controller.command().acceleration.allFinite());
  BOOST_TEST((controller.step(rest, rest).activity == Activity::moving));
  BOOST_TEST(controller.target().isApprox(constant(0.5)));
  ControllerSettings settings;
  settings.period = 0.0;
  BOOST_CHECK_THROW(Controller(make_arm(), settings), std::invalid_argument);
}

BOOST_AUTO_TEST_CASE(an_arm_file_is_all_that_a_program_needs) {
  const auto path = std::filesystem::temp_directory_path() / "sidestep_controller_test.arm";
  make_arm().save(path);
  Controller controller(Arm::load(path), synchronous());
  controller.set_obstacles(Obstacles::none());
  std::filesystem::remove(path);
  controller.set_goal(constant(0.3));
  const MotionRecord record = integrate(controller, constant(0.0), constant(0.0), 6000, constant(0.3), 0.01);
  BOOST_TEST(record.arrived);
}

// Among what is at rest every limit is kept, jerk as well, whatever the arm is told; nothing is touched.
#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>

#include "sidestep/controller/controller.hpp"
#include "support/covered_arm.hpp"
#include "support/numbers.hpp"
#include "support/random.hpp"
#include "support/repeatable_settings.hpp"

using namespace sidestep;
using test::covered_arm;
using test::nv;
using test::Random;
using test::repeatable_settings;

namespace {

constexpr double step_time = 0.001;
constexpr int num_balls = 150;

JointLimits jerk_limited() {
  JointLimits limits = test::arm_limits(nv);
  limits.jerk.setConstant(300.0);
  limits.effort_rate.setConstant(1000.0);
  return limits;
}

/// Balls all around the arm, none of them nearer to it than 12 mm.
Obstacles narrow(Random& random, Controller& controller, const Eigen::VectorXd& q) {
  Eigen::Matrix3Xd points(3, num_balls);
  for (int n = 0; n < num_balls; ++n) {
    do {
      points.col(n) = Eigen::Vector3d(random.uniform(-0.8, 0.8), random.uniform(-0.8, 0.8), random.uniform(0.0, 2.0));
      controller.set_obstacles(test::ball(points.col(n), 0.03));
      static_cast<void>(controller.step(q, Eigen::VectorXd::Zero(nv)));
    } while (controller.command().clearance < 0.012);
  }
  return Obstacles(points, Eigen::VectorXd::Constant(num_balls, 0.03), Eigen::Matrix3Xd::Zero(3, num_balls));
}

struct Worst {
  double jerk = 0.0, acceleration = 0.0, clearance = 1.0;
};

/// Drives it to and fro at random, at full speed.
Worst drive(unsigned seed, double seconds, ControllerSettings::Output output) {
  const JointLimits limits = jerk_limited();
  const Arm arm = covered_arm(limits);
  Random random(seed);
  Eigen::VectorXd q = Eigen::VectorXd::Zero(nv), v = q, last = q, velocity(nv);
  for (Eigen::Index j = 0; j < nv; ++j) {
    q[j] = random.uniform(-0.8, 0.8);
  }
  const ControllerSettings settings = repeatable_settings(output);
  Controller empty(arm, settings), controller(arm, settings);
  controller.set_obstacles(narrow(random, empty, q));
  Worst worst;
  for (int k = 0; k < seconds / step_time; ++k) {
    if (k % 300 == 0) {
      for (Eigen::Index j = 0; j < nv; ++j) {
        velocity[j] = random.uniform(-2.4, 2.4);
      }
    }
    if (k % 50 == 0) {
      controller.set_velocity(velocity);
    }
    const Command& command = controller.step(q, v);
    worst.jerk =
        std::max(worst.jerk, (command.acceleration - last).cwiseAbs().cwiseQuotient(limits.jerk).maxCoeff() / step_time);
    worst.acceleration =
        std::max(worst.acceleration, command.acceleration.cwiseAbs().cwiseQuotient(limits.acceleration).maxCoeff());
    worst.clearance = std::min(worst.clearance, command.clearance);
    last = command.acceleration;
    v += step_time * command.acceleration;
    q += step_time * v;
  }
  return worst;
}

}  // namespace

BOOST_AUTO_TEST_CASE(no_drive_into_obstacles_breaks_a_limit) {
  for (const unsigned seed : {1u, 2u, 3u, 4u, 6u, 8u}) {  // of drives that come near
    for (const auto output : {ControllerSettings::Output::acceleration, ControllerSettings::Output::torque}) {
      const Worst worst = drive(seed, 6.0, output);
      BOOST_TEST(worst.jerk < 1.0 + 1e-6);
      BOOST_TEST(worst.acceleration < 1.0 + 1e-6);
      BOOST_TEST(worst.clearance > 0.0);
      BOOST_TEST(worst.clearance < 0.01);  // it came near
    }
  }
}

BOOST_AUTO_TEST_CASE(places_that_are_looked_at_again_serve_once_they_are_free) {
  // The same cloud, told anew in every step, changes nothing.
  const Arm arm = covered_arm(jerk_limited());
  Controller once(arm, repeatable_settings(ControllerSettings::Output::acceleration)),
      anew(arm, repeatable_settings(ControllerSettings::Output::acceleration));
  Random random(3);
  Eigen::VectorXd q = Eigen::VectorXd::Constant(nv, 0.2), v = Eigen::VectorXd::Zero(nv);
  Controller empty(arm, repeatable_settings(ControllerSettings::Output::acceleration));
  const Obstacles cloud = narrow(random, empty, q);
  once.set_obstacles(cloud);
  for (int k = 0; k < 1000; ++k) {
    const Eigen::VectorXd velocity = Eigen::VectorXd::Constant(nv, k < 500 ? 1.0 : -1.0);
    once.set_velocity(velocity);
    anew.set_velocity(velocity);
    anew.set_obstacles(cloud);
    const Eigen::VectorXd a = once.step(q, v).acceleration;
    BOOST_REQUIRE((anew.step(q, v).acceleration - a).norm() < 1e-9);
    v += step_time * a;
    q += step_time * v;
  }
}

// What every step promises: no allocation, clearances in every command, a status that tells the truth.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <atomic>
#include <boost/test/unit_test.hpp>
#include <chrono>
#include <cmath>
#include <thread>

#include "sidestep/controller/controller.hpp"
#include "sidestep/body/body_ellipsoid.hpp"
#include "sidestep/clearance/ellipsoid_gap.hpp"
#include "support/allocations.hpp"
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

Eigen::VectorXd random_configuration(Random& random, double most = 1.5) {
  return Eigen::VectorXd::NullaryExpr(nv, [&](Eigen::Index) { return random.uniform(-most, most); });
}

Obstacles random_balls(Random& random, int num, double speed) {
  Eigen::Matrix3Xd points(3, num), velocities(3, num);
  for (int k = 0; k < num; ++k) {
    points.col(k) << random.uniform(-0.9, 0.9), random.uniform(-0.9, 0.9), random.uniform(0.3, 2.0);
    velocities.col(k) = speed * random.vector(3);
  }
  return Obstacles(points, Eigen::VectorXd::Constant(num, 0.05), velocities);
}

/// The distance of a point from an ellipsoid y S⁻¹ y ≤ 1, less than zero inside, where it is not the distance.
double signed_distance(const Eigen::Matrix3d& S, const Eigen::Vector3d& e) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(S);
  const Eigen::Array3d A = principal.eigenvalues(), along = principal.eigenvectors().transpose() * e;
  const auto excess = [&](double t) { return (A * (along / (A + t)).square()).sum() - 1.0; };
  if (excess(0.0) <= 0.0) {
    const Eigen::Array3d u = along / A;
    const double m = (along * u).sum();
    return (m - std::sqrt(m)) / u.matrix().norm();  // of first order, as it is documented
  }
  double low = 0.0, high = 1.0;
  while (excess(high) > 0.0) {
    high *= 2.0;
  }
  for (int k = 0; k < 200; ++k) {
    (excess(0.5 * (low + high)) > 0.0 ? low : high) = 0.5 * (low + high);
  }
  return low * (along / (A + low)).matrix().norm();
}

/// The least clearance of the covering body at a state, one ellipsoid after another.
double least_clearance(const Arm& arm, const Eigen::VectorXd& q, const Obstacles& obstacles) {
  const Robot& robot = arm.robot();
  KinematicState state(robot);
  state.update(robot, q, Eigen::VectorXd::Zero(q.size()));
  const std::vector<BodyEllipsoid> ellipsoids = body_ellipsoids(robot, arm.body(), "test");
  double least = test::infinity;
  for (const BodyEllipsoid& e : ellipsoids) {
    const KinematicState::Link& link = state.link(e.joint);
    for (Eigen::Index n = 0; n < obstacles.size(); ++n) {
      const Eigen::Vector3d y = link.R_WL.transpose() * (obstacles.points().col(n) - link.p_WL) - e.mean;
      least = std::min(least, signed_distance(e.shape, y) - obstacles.radii()[n]);
    }
  }
  for (const LinkPair& pair : arm.pairs()) {
    for (const BodyEllipsoid& a : ellipsoids) {
      for (const BodyEllipsoid& b : ellipsoids) {
        if (arm.body().links[static_cast<std::size_t>(a.component)] != pair.first ||
            arm.body().links[static_cast<std::size_t>(b.component)] != pair.second) {
          continue;
        }
        const KinematicState::Link &A = state.link(a.joint), &B = state.link(b.joint);
        const Eigen::Matrix3d R = A.R_WL.transpose() * B.R_WL;
        const Eigen::Vector3d d = A.R_WL.transpose() * (B.p_WL + B.R_WL * b.mean - A.p_WL) - a.mean;
        least = std::min(least, ellipsoid_gap(d, a.shape, R * b.shape * R.transpose()).value - pair.contact);
      }
    }
  }
  return least;
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_step_allocates_nothing_while_another_thread_sets_goals_and_obstacles) {
  for (const auto output : {ControllerSettings::Output::torque, ControllerSettings::Output::acceleration}) {
    ControllerSettings settings;
    settings.output = output;
    settings.planner->search.shortcuts = 20;
    settings.look_ahead->tries = 30;
    const Arm arm = covered_arm(test::arm_limits(nv));
    Controller controller(arm, settings);
    controller.set_obstacles(Obstacles::none());
    std::atomic<bool> done{false};
    std::atomic<int> steps{0};
    std::thread other([&] {
      Random random(7);
      const Eigen::VectorXd left = Eigen::VectorXd::Constant(nv, -0.3), right = -left;
      for (int k = 0; !done.load(); ++k) {
        const Eigen::VectorXd q = random_configuration(random);
        switch (k % 5) {
          case 0: controller.set_goal(k % 2 == 0 ? left : right); break;
          case 1: controller.set_goal(pose_of(arm.robot(), q)); break;
          case 2: controller.set_goal(Goal(JointGoal(q, 0.1 * random.vector(nv)))); break;
          case 3: controller.clear_goal(); break;
          default: controller.set_goal(q); break;
        }
        if (k % 5 ==
            0) {  // comes from afar at the middle of the arm where it will be, too large and too fast for it to back off
          const KinematicState there = state_at(arm.robot(), k % 2 == 0 ? left : right);
          const Eigen::Vector3d at = frame_pose(arm.robot(), there, arm.robot().frame_index("link4")).translation();
          controller.set_obstacles(test::ball(at + Eigen::Vector3d(0.0, 3.0, 0.001 * (k % 11)), 0.25, {0.0, -3.0, 0.0}),
                                   test::for_ever);
        } else {
          controller.set_obstacles(random_balls(random, 1 + k % 4, 0.0));
        }
        // Counted in steps, so that a machine under load sees the same.
        for (const int until = steps + (k % 5 == 0 ? 900 : k % 5 == 4 ? 400 : 80); steps < until && !done;) {
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
      }
    });
    Eigen::VectorXd q = Eigen::VectorXd::Constant(nv, 0.3), v = Eigen::VectorXd::Zero(nv);
    std::size_t allocations = 0, avoided = 0, on_path = 0;
    for (int k = 0; k < 40000 && (k < 2500 || avoided == 0 || on_path == 0); ++k) {  // however slow the machine is
      const bool broken = k % 500 == 250;                                            // a sensor that fails now and then
      const Eigen::VectorXd seen = broken ? Eigen::VectorXd::Constant(nv, test::not_a_number) : q;
      allocations += test::allocations_of([&] { controller.step(seen, v, 0.001 * k); });
      const Command& command = controller.command();
      avoided += command.avoiding;
      on_path += command.on_path;
      v += 0.001 * command.acceleration;
      q += 0.001 * v;
      ++steps;
      std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
    done = true;
    other.join();
    BOOST_TEST(allocations == 0U);
    BOOST_TEST(avoided > 0U);
    BOOST_TEST(on_path > 0U);
  }
}

BOOST_AUTO_TEST_CASE(a_step_allocates_nothing_whatever_time_it_is_told) {
  using Output = ControllerSettings::Output;
  for (const auto output : {Output::torque, Output::acceleration, Output::velocity}) {
    ControllerSettings settings;
    settings.output = output;
    settings.planner.reset();
    settings.look_ahead.reset();
    Controller controller(covered_arm(test::arm_limits(nv)), settings);
    controller.set_goal(Eigen::VectorXd::Constant(nv, 0.3));
    Eigen::VectorXd q = Eigen::VectorXd::Constant(nv, 0.6), v = Eigen::VectorXd::Zero(nv);
    std::size_t allocations = 0, stops = 0;
    double time = 0.0;
    for (int k = 0; k < 300; ++k) {
      const double period = k % 50 == 49 ? -0.1 : k % 50 == 48 ? 1.0 : k % 3 == 0 ? 0.004 : 0.001;
      time += period;
      const double told = k % 7 == 0 ? test::not_a_number : time;
      allocations += test::allocations_of([&] { controller.step(q, v, told); });
      stops += controller.command().status == SafetyStatus::stopping;
      v += 0.001 * controller.command().acceleration;
      q += 0.001 * v;
    }
    BOOST_TEST(allocations == 0U);
    BOOST_TEST(stops == 5U);  // the second jump back is less than the one forward before it, which was not told
    BOOST_TEST(controller.command().timing.late_steps > 80);
  }
}

BOOST_AUTO_TEST_CASE(an_impedance_allocates_nothing) {
  ControllerSettings settings;
  settings.output = ControllerSettings::Output::torque;
  settings.planner.reset();
  settings.look_ahead.reset();
  settings.tracking.stiffness = 5.0;
  Controller controller(covered_arm(test::arm_limits(nv)), settings);
  controller.set_obstacles(Obstacles::none());
  controller.set_goal(Eigen::VectorXd::Constant(nv, 0.3));
  Eigen::VectorXd q = Eigen::VectorXd::Constant(nv, 0.3), v = Eigen::VectorXd::Zero(nv);
  std::size_t allocations = 0;
  double farthest = 0.0;
  for (int k = 0; k < 300; ++k) {
    allocations += test::allocations_of([&] { controller.step(q, v); });
    v += 0.001 * controller.command().acceleration;
    v[0] += 0.001;  // a push, so that the arm is off its reference
    q += 0.001 * v;
    farthest = std::max(farthest, controller.command().tracking_error);
  }
  BOOST_TEST(allocations == 0U);
  BOOST_TEST(farthest > 1e-4);
}

BOOST_AUTO_TEST_CASE(clearances_bind_whatever_the_goal_is) {
  enum class Case { no_goal, refused, drifting, stale, blocked_pose };
  for (const Case which : {Case::no_goal, Case::refused, Case::drifting, Case::stale, Case::blocked_pose}) {
    for (const auto output : {ControllerSettings::Output::torque, ControllerSettings::Output::acceleration}) {
      BOOST_TEST_CONTEXT(static_cast<int>(which)) {
        ControllerSettings settings;
        settings.output = output;
        settings.synchronous = true;
        settings.look_ahead.reset();  // the rows alone
        if (which == Case::stale) {
          settings.obstacle_timeout = 0.05;
          settings.stop_time = 1.0;  // so slow that it would go on into the ball
        }
        const Arm arm = covered_arm(test::arm_limits(nv));
        Controller controller(arm, settings);
        controller.set_obstacles(Obstacles::none());
        // The tip, at (0.6, 0, 1.5) or so, moves towards a ball at rest.
        Eigen::VectorXd q = Eigen::VectorXd::Zero(nv), v = Eigen::VectorXd::Zero(nv);
        q[3] = 1.2;
        v[0] = 1.5;
        KinematicState state(arm.robot());
        state.update(arm.robot(), q + 0.45 * Eigen::VectorXd::Unit(nv, 0), v);
        const Eigen::Vector3d tip = frame_pose(arm.robot(), state, arm.robot().frame_index("tip")).translation();
        controller.set_obstacles(test::ball(tip, 0.05));
        switch (which) {
          case Case::refused:
            BOOST_CHECK_THROW(controller.set_goal(Eigen::VectorXd::Constant(nv, test::not_a_number)), std::invalid_argument);
            break;
          case Case::drifting: {  // leaves the limits in a tenth of a second
            Eigen::VectorXd goal = q, velocity = Eigen::VectorXd::Zero(nv);
            goal[0] = 2.4;
            velocity[0] = 1.0;
            controller.set_goal(Goal(JointGoal(goal, velocity)));
            break;
          }
          case Case::blocked_pose: {
            PoseGoal pose = pose_of(arm.robot(), q + 0.45 * Eigen::VectorXd::Unit(nv, 0));
            controller.set_goal(pose);
            break;
          }
          case Case::no_goal:
          case Case::stale: break;
        }
        bool bound = false;
        for (int k = 0; k < 1500; ++k) {
          const Command& command = controller.step(q, v);
          BOOST_REQUIRE(command.clearance > 0.0);
          BOOST_REQUIRE(command.status < SafetyStatus::stopping);
          bound = bound || controller.part_results().solution.num_safety_rows > 0;
          v += settings.period * command.acceleration;
          q += settings.period * v;
        }
        BOOST_TEST(bound);
        const Activity activity = controller.command().activity;
        if (which == Case::stale) {
          BOOST_TEST(to_string(activity) == "stale");
          BOOST_TEST(v.norm() < 0.5);
        } else if (which == Case::drifting) {
          BOOST_TEST(to_string(activity) == "blocked");
        } else if (which != Case::blocked_pose) {
          BOOST_TEST(to_string(activity) == "no_goal");
        }
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(status_and_clearance_tell_the_truth_about_the_covering_body) {
  ControllerSettings settings;
  settings.synchronous = true;
  settings.planner.reset();
  settings.look_ahead.reset();
  const Arm arm = covered_arm(test::arm_limits(nv));
  Controller controller(arm, settings);
  controller.set_obstacles(Obstacles::none());
  Random random(11);
  int touched = 0, apart = 0;
  for (int k = 0; k < 3000; ++k) {
    const Eigen::VectorXd q = random_configuration(random, 2.4), v = 0.5 * random.vector(nv);
    // Some of many points just outside, one just inside: a mean of them says nothing of the least.
    const Obstacles obstacles = k % 2 == 0 ? random_balls(random, 1 + k % 8, 0.0) : random_balls(random, 300, 0.0);
    controller.set_obstacles(obstacles);
    controller.restart();  // the arm does not come here by itself
    const Command& command = controller.step(q, v);
    const double least = least_clearance(arm, q, obstacles);
    BOOST_REQUIRE((command.status == SafetyStatus::clearance_lost) == (least < 0.0));
    BOOST_REQUIRE((command.clearance < 0.0) == (least < 0.0));
    if (least < settings.barriers.self_activation) {
      BOOST_REQUIRE(std::abs(command.clearance - least) < 1e-9);  // [m] rounding of two ways to compute it
    } else {                                                      // pairs of links are looked at no farther than that
      BOOST_REQUIRE(command.clearance >= least - 1e-9);
    }
    (least < 0.0 ? touched : apart) += 1;
  }
  BOOST_TEST(touched > 100);
  BOOST_TEST(apart > 100);
}

BOOST_AUTO_TEST_CASE(points_that_outweigh_the_one_that_touches_hide_nothing) {
  ControllerSettings settings;
  settings.synchronous = true;
  const Arm arm = covered_arm(test::arm_limits(nv));
  Controller controller(arm, settings);
  controller.set_obstacles(Obstacles::none());
  // beside the first link, which has a semi-axis of 5 cm in y
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 200);
  points.row(1).setConstant(0.05 + 1e-3);
  points.row(2).setConstant(0.45);
  points(1, 17) = 0.05 - 1e-4;
  controller.set_obstacles(Obstacles(points, Eigen::VectorXd::Zero(200), Eigen::Matrix3Xd::Zero(3, 200)));
  const Command& command = controller.step(Eigen::VectorXd::Zero(nv), Eigen::VectorXd::Zero(nv));
  BOOST_TEST(to_string(command.status) == "clearance_lost");
  BOOST_TEST(command.point == 17);
  BOOST_TEST(std::abs(command.clearance + 1e-4) < 1e-6);                           // [m] of first order inside
  BOOST_TEST(controller.workspace().clearances.values[command.coordinate] > 0.0);  // the mean, which is smooth
}

BOOST_AUTO_TEST_CASE(a_paused_arm_rests_within_its_limits_and_goes_on_to_its_goal) {
  ControllerSettings settings;
  settings.synchronous = true;
  const Arm arm = covered_arm(test::arm_limits(nv));
  const JointLimits& limits = arm.robot().limits();
  Controller controller(arm, settings);
  controller.set_obstacles(Obstacles::none());
  controller.set_goal(Eigen::VectorXd::Constant(nv, 0.8));
  Eigen::VectorXd q = Eigen::VectorXd::Zero(nv), v = q;
  const auto steps = [&](int number) {
    for (int k = 0; k < number; ++k) {
      const Command& command = controller.step(q, v);
      for (Eigen::Index j = 0; j < nv; ++j) {
        BOOST_REQUIRE(std::abs(command.acceleration[j]) <= limits.acceleration[j] * (1.0 + 1e-9));  // rounding
      }
      v += settings.period * command.acceleration;
      q += settings.period * v;
    }
  };
  steps(300);
  BOOST_TEST(v.cwiseAbs().maxCoeff() > 0.05);
  controller.pause();
  BOOST_TEST(controller.is_paused());
  steps(1500);
  BOOST_TEST(v.cwiseAbs().maxCoeff() < 1e-3);
  BOOST_TEST(to_string(controller.command().activity) == "waiting");
  BOOST_TEST(controller.explain() == "paused: the arm rests until `resume`");
  const Eigen::VectorXd rest = q;
  controller.resume();
  steps(8000);
  BOOST_TEST(to_string(controller.command().activity) == "arrived");
  BOOST_TEST((q - rest).cwiseAbs().maxCoeff() > 0.1);
}

BOOST_AUTO_TEST_CASE(a_state_that_is_unusable_stops_the_arm_and_is_said) {
  ControllerSettings settings;
  settings.synchronous = true;
  Controller controller(covered_arm(test::arm_limits(nv)), settings);
  controller.set_obstacles(Obstacles::none());
  Eigen::VectorXd goal = Eigen::VectorXd::Constant(nv, 0.4);
  controller.set_goal(goal);
  const Eigen::VectorXd q = Eigen::VectorXd::Constant(nv, 0.1), v = Eigen::VectorXd::Constant(nv, 0.2);
  for (const Eigen::VectorXd& bad :
       {Eigen::VectorXd(Eigen::VectorXd::Constant(nv, test::not_a_number)), Eigen::VectorXd(q.head(3))}) {
    const Command& command = controller.step(bad, v);  // the first one too
    BOOST_TEST(to_string(command.status) == "stopping");
    BOOST_TEST(command.torque.allFinite());
    BOOST_TEST(command.acceleration.allFinite());
    BOOST_TEST(std::isnan(command.clearance));
    BOOST_TEST(command.position.array().isNaN().all());  // nobody knows where the arm is
    BOOST_TEST(!controller.explain().empty());
  }
  BOOST_TEST(to_string(controller.step(q, v).status) != "stopping");
  BOOST_TEST((controller.target() - goal).norm() < 1e-12);
  const Command& command = controller.step(q, Eigen::VectorXd::Constant(nv, test::infinity));
  BOOST_TEST(to_string(command.status) == "stopping");
  BOOST_TEST((command.position - q).norm() == 0.0);
  BOOST_TEST(command.velocity.norm() == 0.0);
  BOOST_TEST(to_string(controller.step(q, v).status) != "stopping");
}

BOOST_AUTO_TEST_CASE(torque_without_inertias_needs_the_mass_matrix_in_every_step) {
  ControllerSettings settings;
  settings.synchronous = true;
  settings.output = ControllerSettings::Output::torque;
  Controller controller(covered_arm(test::arm_limits(nv), true, false), settings);
  controller.set_obstacles(Obstacles::none());
  const Eigen::VectorXd q = Eigen::VectorXd::Constant(nv, 0.1), v = Eigen::VectorXd::Zero(nv);
  BOOST_TEST(to_string(controller.step(q, v).status) == "stopping");
  BOOST_TEST(controller.explain().find("mass_matrix") != std::string::npos);
  const Eigen::MatrixXd mass = 0.3 * Eigen::MatrixXd::Identity(nv, nv);
  BOOST_TEST(to_string(controller.step(q, v, mass, Eigen::VectorXd::Constant(nv, 1.0)).status) == "ok");
  BOOST_TEST(to_string(controller.step(q, v).status) == "stopping");
}

BOOST_AUTO_TEST_CASE(goes_on_from_where_drives_say_that_they_are) {
  ControllerSettings settings;
  settings.synchronous = true;
  settings.output = ControllerSettings::Output::position;
  const Arm arm = covered_arm(test::arm_limits(nv));
  const JointLimits& limits = arm.robot().limits();
  const double T = settings.period;
  Controller controller(arm, settings);
  controller.set_obstacles(Obstacles::none());
  const Eigen::VectorXd goal = Eigen::VectorXd::Constant(nv, 0.8);
  controller.set_goal(goal);
  // The drives follow positions exactly: what they go on from, by backward differences.
  Eigen::VectorXd p = Eigen::VectorXd::Zero(nv), v = p, a = p;
  double jerk = 0.0;  // the largest as a share of its limit, after the first step
  const auto take = [&](const Command& command) {
    const Eigen::VectorXd next_v = (command.position - p) / T, next_a = (next_v - v) / T;
    jerk = std::max(jerk, (next_a - a).cwiseAbs().cwiseQuotient(T * limits.jerk).maxCoeff());
    p = command.position, v = next_v, a = next_a;
  };
  take(controller.step(p, v));
  jerk = 0.0;
  for (int k = 0; k < 4000; ++k) {
    if (k % 100 == 50) {  // 8 cycles without a command
      for (int lost = 0; lost < 8; ++lost) {
        v += T * a;
        p += T * v;
      }
      BOOST_TEST(test::allocations_of([&] { controller.continue_from(p, v, a); }) == 0U);
    }
    take(controller.step(p, v));
  }
  BOOST_TEST(jerk <= 1.0 + 1e-3);  // rounding of third differences
  BOOST_TEST((p - goal).cwiseAbs().maxCoeff() < 1e-3);
  // Numbers that are not, and outputs that drives do not track, change nothing.
  controller.continue_from(Eigen::VectorXd::Constant(nv, NAN), v, a);
  take(controller.step(p, v));
  BOOST_TEST((p - goal).cwiseAbs().maxCoeff() < 1e-3);
  settings.output = ControllerSettings::Output::acceleration;
  Controller other(arm, settings);
  other.set_obstacles(Obstacles::none());
  other.step(p, v);
  other.continue_from(0.5 * p, v, a);
  BOOST_TEST((other.step(p, v).position - p).cwiseAbs().maxCoeff() < 1e-3);
}

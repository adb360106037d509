// An arm found inside a barrier moves out, smoothly, and says so; and why a motion stops.
#include "sidestep/attractor/penetration_recovery.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <memory>

#include "sidestep/thesis/rollout.hpp"
#include "sidestep/attractor/clearance_barrier.hpp"
#include "sidestep/attractor/joint_limit_barrier.hpp"
#include "support/allocations.hpp"
#include "support/random_scene.hpp"
#include "support/serial_arm.hpp"

using namespace sidestep;
using test::Random;

namespace {

constexpr BarrierFunction barrier{0.10, 0.1, 2.0, 0.002};
constexpr double sphere = 0.08;  // radius of the only ellipsoid, at the tip [m]

/// Two joints in a plane: links of 0.3 m, a sphere of 8 cm at the end of the second.
Robot planar() {
  std::vector<Joint> joints(2);
  joints[0].name = "joint1";
  joints[1].name = "joint2";
  joints[1].parent = 0;
  joints[1].coordinate = 1;
  joints[1].X_PJ.translation().x() = 0.3;
  Frame tip{"tip", 1, Eigen::Isometry3d::Identity()};
  tip.X_JF.translation().x() = 0.3;
  return Robot("planar", joints, {tip}, {"joint1", "joint2"}, test::arm_limits(2));
}

GeometricSystem system_of(const Robot& robot, bool limits = false) {
  const Body body({"tip"}, Eigen::VectorXd::Ones(1), Eigen::Matrix3Xd::Zero(3, 1),
                  {sphere * sphere * Eigen::Matrix3d::Identity()}, Eigen::VectorXd::Ones(1));
  std::vector<std::shared_ptr<const Embedding>> embeddings = {std::make_shared<ClearanceBarrier>(robot, body, barrier)};
  if (limits) {
    embeddings.push_back(std::make_shared<JointLimitBarrier>(robot, BarrierFunction{0.1, 0.02, 2.0, 0.002}));
  }
  return GeometricSystem(robot, embeddings, {0.5 * Eigen::MatrixXd::Identity(2, 2), 1.5 * Eigen::MatrixXd::Identity(2, 2)});
}

Eigen::Vector3d tip(double q1, double q2) {
  return {0.3 * std::cos(q1) + 0.3 * std::cos(q1 + q2), 0.3 * std::sin(q1) + 0.3 * std::sin(q1 + q2), 0.0};
}

/// A point with this clearance to the tip's sphere, in the direction (dx, dy) from its centre.
Obstacles point_at(const Eigen::Vector3d& centre, double dx, double dy, double clearance) {
  const Eigen::Vector3d direction = Eigen::Vector3d(dx, dy, 0.0).normalized();
  return Obstacles(centre + (sphere + clearance) * direction, Eigen::VectorXd::Zero(1), Eigen::Matrix3Xd::Zero(3, 1));
}

}  // namespace

BOOST_AUTO_TEST_CASE(an_arm_inside_moves_out_smoothly_and_says_so) {
  const Robot robot = planar();
  const GeometricSystem system = system_of(robot);
  const Eigen::Vector2d q(0.3, 0.8);
  for (const double clearance : {0.0, -0.02, -0.06}) {
    // tangential to the second link's swing, so that the joints can leave; the goal is where it is
    const Obstacles obstacles = point_at(tip(0.3, 0.8), -0.5, 1.0, clearance);
    GeometricSystem::Workspace w(system);
    BOOST_TEST((system.acceleration(q, Eigen::VectorXd::Zero(2), q, obstacles, w) == StepStatus::inside_barrier));
    BOOST_TEST(!is_fallback(StepStatus::inside_barrier));
    BOOST_TEST(w.inside == 0);
    const Diagnosis d = system.diagnose(w);
    BOOST_TEST((d.state == MotionState::inside_barrier));
    BOOST_TEST(d.point == 0);
    BOOST_TEST(std::abs(d.clearance - clearance) < 1e-12);
    BOOST_TEST(w.clearances.gradients.col(0).dot(w.acceleration) > 0.1);  // [m/s²] outwards, from rest

    const Rollout motion = rollout(system, q, Eigen::VectorXd::Zero(2), q, obstacles, {0.001, 3000});
    double last = clearance;
    bool outside = false;
    for (Eigen::Index k = 0; k <= 3000; k += 10) {
      const Eigen::VectorXd at = motion.q.row(k);
      static_cast<void>(system.acceleration(at, motion.v.row(k).transpose(), q, obstacles, w));
      const double h = w.clearances.values[0];
      if (!outside) {
        BOOST_TEST(h >= last - 1e-12);  // never deeper
        BOOST_TEST((motion.statuses[static_cast<std::size_t>(k)] == StepStatus::inside_barrier) == (h < barrier.floor));
      }
      last = std::min(h, 1.0);
      outside = outside || h > 0.01;
    }
    BOOST_TEST(outside);
    // 2 m/s² along ∇h at most in the push; then no faster than the rebound and a goal 0.3 rad away allow
    BOOST_TEST(motion.acceleration.rowwise().norm().maxCoeff() < 15.0);
    BOOST_TEST(motion.v.rowwise().norm().maxCoeff() < 1.0);
    BOOST_TEST((motion.statuses.back() == StepStatus::ok));
  }
}

BOOST_AUTO_TEST_CASE(the_push_begins_at_zero_and_smoothly) {
  const Robot robot = planar();
  const GeometricSystem system = system_of(robot);
  GeometricSystem::Workspace w(system);
  const Eigen::Vector2d q(0.3, 0.8);
  double pushes[3];
  const double depths[3] = {-1e-9, 1e-6, 1e-5};
  for (int i = 0; i < 3; ++i) {
    static_cast<void>(
        system.acceleration(q, Eigen::VectorXd::Zero(2), q, point_at(tip(0.3, 0.8), -0.5, 1.0, barrier.floor - depths[i]), w));
    pushes[i] = w.recovery.norm();
  }
  BOOST_TEST(pushes[0] == 0.0);
  BOOST_TEST(pushes[1] < 1e-4);
  BOOST_TEST(std::abs(pushes[2] / pushes[1] - 100.0) < 1.0);  // smoothstep goes with the square of the depth
}

BOOST_AUTO_TEST_CASE(an_obstacle_that_jumps_onto_a_moving_arm_is_left) {
  const Robot robot = planar();
  const GeometricSystem system = system_of(robot);
  const Eigen::Vector2d start(-0.5, 0.8), goal(0.8, 0.8);
  const Rollout before = rollout(system, start, Eigen::VectorXd::Zero(2), goal, Obstacles::none(), {0.001, 1000});
  const Eigen::VectorXd q = before.q.row(1000), v = before.v.row(1000);
  const Obstacles jumped = point_at(tip(q[0], q[1]), v[0] > 0.0 ? -0.3 : 0.3, 1.0, -0.03);  // in its way
  const Rollout after = rollout(system, q, v, goal, jumped, {0.001, 6000});
  BOOST_TEST((after.statuses.front() == StepStatus::inside_barrier));
  BOOST_TEST((after.statuses.back() == StepStatus::ok));
  GeometricSystem::Workspace w(system);
  double least = 1.0;
  for (Eigen::Index k = 0; k <= 6000; k += 5) {
    static_cast<void>(system.acceleration(after.q.row(k).transpose(), after.v.row(k).transpose(), goal, jumped, w));
    least = std::min(least, w.clearances.values[0]);
  }
  // it stops from up to 0.3 m/s with 20 1/s: 15 mm deeper than it was found
  BOOST_TEST(least > -0.045);
  BOOST_TEST(w.clearances.values[0] > barrier.floor);
  BOOST_TEST(after.acceleration.rowwise().norm().maxCoeff() < 40.0);
}

BOOST_AUTO_TEST_CASE(a_push_does_not_drive_the_arm_through_another_barrier) {
  const Robot robot = planar();
  const GeometricSystem system = system_of(robot, true);
  // beyond the tip of a nearly stretched arm... the way out of the point turns joint 2 towards its upper limit
  const double near_limit = 2.5 - 0.01;
  const Eigen::Vector2d q(0.0, near_limit);
  const Obstacles obstacles = point_at(tip(0.0, near_limit), 0.3, 0.6, -0.02);
  const Rollout motion = rollout(system, q, Eigen::VectorXd::Zero(2), q, obstacles, {0.001, 4000});
  BOOST_TEST(motion.q.col(1).maxCoeff() < 2.5);
}

BOOST_AUTO_TEST_CASE(a_joint_found_beyond_its_limit_comes_back) {
  const Robot robot = planar();
  const GeometricSystem system = system_of(robot, true);
  const Eigen::Vector2d q(0.3, 2.52), goal(0.3, 1.0);
  GeometricSystem::Workspace w(system);
  BOOST_TEST((system.acceleration(q, Eigen::VectorXd::Zero(2), goal, Obstacles::none(), w) == StepStatus::inside_barrier));
  const Diagnosis d = system.diagnose(w);
  const CoordinateLabel& label = system.labels()[static_cast<std::size_t>(d.coordinate)];
  BOOST_TEST((label.kind == CoordinateLabel::Kind::joint_limit));
  BOOST_TEST(d.describe(label) == "joint joint2 is inside the barrier of its upper limit, 0.020 rad beyond it, and moves out");
  const Rollout motion = rollout(system, q, Eigen::VectorXd::Zero(2), goal, Obstacles::none(), {0.001, 12000});
  BOOST_TEST((motion.q.row(12000).transpose() - goal).norm() < 0.05);
}

BOOST_AUTO_TEST_CASE(a_barrier_gives_back_no_more_than_the_rebound) {
  // An obstacle leaves a resting arm at 0.5 m/s from 5 mm: dψ/dt is 7000 /s, and without the limit a joint speed.
  const Robot robot = planar();
  const GeometricSystem system = system_of(robot);
  const Eigen::Vector2d q(0.3, 0.8);
  const Eigen::Vector3d centre = tip(0.3, 0.8), direction = Eigen::Vector3d(-0.5, 1.0, 0.0).normalized();
  const Obstacles leaving(centre + (sphere + 0.005) * direction, Eigen::VectorXd::Zero(1), 0.5 * direction);
  const Rollout motion = rollout(system, q, Eigen::VectorXd::Zero(2), q, leaving, {0.0005, 4000});
  BOOST_TEST(motion.v.rowwise().norm().maxCoeff() < 1.0);

  // A slow motion among obstacles at rest is what it was; a faster one is that of a weaker barrier.
  const Obstacles resting = point_at(centre, -0.5, 1.0, 0.03);
  const Body body({"tip"}, Eigen::VectorXd::Ones(1), Eigen::Matrix3Xd::Zero(3, 1),
                  {sphere * sphere * Eigen::Matrix3d::Identity()}, Eigen::VectorXd::Ones(1));
  GeometricSystem::Workspace w(system);
  static_cast<void>(system.acceleration(q, Eigen::VectorXd::Zero(2), q, resting, w));
  const Eigen::VectorXd out = w.clearances.gradients.col(0).normalized();
  const double slope = w.jacobian_transposed.col(0).norm();
  for (const double psi_rate : {-5.0, 0.9, 4.0}) {
    const Eigen::VectorXd v = psi_rate / slope * out;  // dψ/dt = −psi_rate
    static_cast<void>(system.acceleration(q, v, q, resting, w));
    BarrierFunction weaker = barrier;
    weaker.strength /= std::max(1.0, psi_rate);
    const EmbeddingEvaluation e = evaluate(ClearanceBarrier(robot, body, weaker), q, v, resting);
    const double s = weaker.strength / barrier.strength;
    const double linear = weaker(0.03).first * e.clearances.curvatures[0];
    const Eigen::VectorXd c = Eigen::VectorXd::Constant(1, linear + s * s * (e.curvatures[0] - linear));
    BOOST_TEST((w.geodesic - geodesic_acceleration(e.jacobian, c)).norm() < 1e-12 * w.geodesic.norm());
  }
}

BOOST_AUTO_TEST_CASE(states_are_told_apart) {
  const Robot robot = planar();
  const GeometricSystem system = system_of(robot);
  GeometricSystem::Workspace w(system);
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(2);
  const auto diagnose = [&](const Eigen::Vector2d& q, const Eigen::Vector2d& goal, const Obstacles& obstacles) {
    return system.diagnose(q, rest, JointGoal(goal), obstacles, w);
  };
  const auto words = [&](const Diagnosis& d) {
    return d.describe(d.coordinate < 0 ? CoordinateLabel{} : system.labels()[static_cast<std::size_t>(d.coordinate)]);
  };
  Diagnosis d = diagnose({0.0, 0.5}, {1.0, 0.5}, Obstacles::none());
  BOOST_TEST((d.state == MotionState::free));
  BOOST_TEST(words(d) == "on the way, 1.00 rad from the goal");
  d = diagnose({0.98, 0.5}, {1.0, 0.5}, Obstacles::none());
  BOOST_TEST((d.state == MotionState::arriving));

  // A wall in the way of joint 1 alone: the pull along joint 1 is held back as far as it is along ∇h.
  const Obstacles beside = point_at(tip(0.0, 0.5), -0.2, 1.0, 0.02);
  d = diagnose({0.0, 0.5}, {1.0, 0.5}, beside);
  BOOST_TEST((d.state == MotionState::sliding));
  BOOST_TEST(d.point == 0);
  BOOST_TEST(std::abs(d.share - 1.0) < 1e-9);  // the only barrier
  BOOST_TEST(words(d) == "link tip slides along obstacle point 0, 20 mm away");

  // The goal pulls exactly along ∇h, which leaves no direction: a local minimum.
  static_cast<void>(system.acceleration(Eigen::Vector2d(0.0, 0.5), rest, Eigen::Vector2d(0.0, 0.5), beside, w));
  const Eigen::Vector2d against = -w.clearances.gradients.col(0).normalized();
  const Eigen::Vector2d goal = Eigen::Vector2d(0.0, 0.5) + 0.5 * against;
  d = diagnose({0.0, 0.5}, goal, beside);
  BOOST_TEST((d.state == MotionState::stuck || d.state == MotionState::blocked_at_goal));
  BOOST_TEST(d.blocked > 0.99);
  // The same pull at speed is not a stop.
  static_cast<void>(system.acceleration(Eigen::Vector2d(0.0, 0.5), Eigen::Vector2d(0.1, 0.0), goal, beside, w));
  BOOST_TEST((system.diagnose(w).state == MotionState::sliding));

  // The obstacle on the goal.
  const Obstacles on_goal = point_at(tip(0.6, 0.5), 0.3, -1.0, -0.08 - 0.02);
  const Rollout motion = rollout(system, Eigen::Vector2d(0.0, 0.5), rest, Eigen::Vector2d(0.6, 0.5), on_goal, {0.002, 20000});
  d = system.diagnose(motion.q.row(20000).transpose(), motion.v.row(20000).transpose(), JointGoal(Eigen::Vector2d(0.6, 0.5)),
                      on_goal, w);
  BOOST_TEST((d.state == MotionState::blocked_at_goal), name(d.state) << ", " << words(d) << ", " << d.blocked);

  // A pose that no configuration has.
  Eigen::Isometry3d far = Eigen::Isometry3d::Identity();
  far.translation() = Eigen::Vector3d(0.7, 0.0, 0.0);
  PoseGoalSettings position;
  position.position_only = true;
  const Goal unreachable = PoseGoal(robot, "tip", far, position);
  BOOST_TEST((system.acceleration(rest, rest, unreachable, Obstacles::none(), w) == StepStatus::goal_out_of_reach));
  d = system.diagnose(w);
  BOOST_TEST((d.state == MotionState::stuck));
  BOOST_TEST(words(d) == "stuck 100 mm from the goal: nothing is in the way, so the pose is out of reach");
}

BOOST_AUTO_TEST_CASE(no_goal_recovery_or_diagnosis_allocates) {
  const Robot robot = planar();
  const GeometricSystem system = system_of(robot, true);
  GeometricSystem::Workspace w(system);
  Random random(9);
  PoseGoalSettings posture;
  posture.rest = Eigen::VectorXd::Zero(2);
  posture.posture_stiffness = 0.1;
  const Vector6d twist = Vector6d::Ones();
  const std::vector<Goal> goals = {JointGoal(Eigen::Vector2d(0.1, 0.2), Eigen::Vector2d(0.1, 0.2)),
                                   PoseGoal(robot, "tip", test::random_pose(random, 0.1)),
                                   PoseGoal(robot, "tip", test::random_pose(random, 0.1), posture, twist)};
  for (const double clearance : {0.5, 0.03, -0.02}) {
    const Obstacles obstacles = point_at(tip(0.3, 0.8), -0.5, 1.0, clearance);
    for (const Goal& goal : goals) {
      const Eigen::VectorXd q = Eigen::Vector2d(0.3, 0.8), v = Eigen::Vector2d(0.1, -0.2);
      StepStatus status{};
      Diagnosis d;
      Goal moving = goal;
      BOOST_TEST(test::allocations_of([&] {
                   status = system.acceleration(q, v, goal, obstacles, w);
                   d = system.diagnose(w);
                   d = system.diagnose(q, v, goal, obstacles, w);
                   advance(moving, 0.001);
                 }) == 0u);
      BOOST_TEST(!is_fallback(status));
      BOOST_TEST((status == StepStatus::inside_barrier) == (clearance < 0.0));
    }
  }
}

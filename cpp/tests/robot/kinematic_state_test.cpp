// Kinematics of random trees against finite differences of their own poses.
#include "sidestep/robot/kinematic_state.hpp"

#include <boost/test/unit_test.hpp>

#include "sidestep/math/instruction_set.hpp"
#include "support/allocations.hpp"
#include "support/every_instruction_set.hpp"
#include "support/random_scene.hpp"

using namespace sidestep;
using test::Random;

namespace {

// Central differences: truncation h² and rounding 1e-16 / h, for lengths and speeds of about 1 to 5.
constexpr double step = 1e-5;
constexpr double of_differences = 1e-7;

Eigen::Isometry3d pose_at(const Robot& robot, const Eigen::VectorXd& q, int frame) {
  KinematicState state(robot);
  state.update(robot, q, Eigen::VectorXd::Zero(q.size()));
  return frame_pose(robot, state, frame);
}

/// Velocity of the origin and angular velocity, from the pose before and after.
Vector6d twist_between(const Eigen::Isometry3d& before, const Eigen::Isometry3d& after, double duration) {
  const Eigen::AngleAxisd turn(after.linear() * before.linear().transpose());
  Vector6d twist;
  twist << (after.translation() - before.translation()) / duration, turn.angle() / duration * turn.axis();
  return twist;
}

}  // namespace

BOOST_AUTO_TEST_CASE(jacobian_is_the_derivative_of_the_pose) {
  Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    const Robot robot = test::random_tree(random, 8);
    const Eigen::VectorXd q = random.vector(robot.num_coordinates());
    KinematicState state(robot);
    state.update(robot, q, q);
    for (int frame = 0; frame < 8; ++frame) {
      const Eigen::MatrixXd jacobian = frame_jacobian(robot, state, frame);
      for (int i = 0; i < q.size(); ++i) {
        const Eigen::VectorXd h = step * Eigen::VectorXd::Unit(q.size(), i);
        const Vector6d expected = twist_between(pose_at(robot, q - h, frame), pose_at(robot, q + h, frame), 2.0 * step);
        BOOST_TEST((jacobian.col(i) - expected).norm() < of_differences);
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(bias_acceleration_is_the_derivative_of_the_velocity) {
  Random random(2);
  for (int trial = 0; trial < 50; ++trial) {
    const Robot robot = test::random_tree(random, 8);
    const Eigen::VectorXd q = random.vector(robot.num_coordinates());
    const Eigen::VectorXd v = random.vector(robot.num_coordinates());
    KinematicState state(robot), before(robot), after(robot);
    state.update(robot, q, v);
    before.update(robot, q - step * v, v);
    after.update(robot, q + step * v, v);
    for (int frame = 0; frame < 8; ++frame) {
      const Vector6d expected =
          (frame_jacobian(robot, after, frame) * v - frame_jacobian(robot, before, frame) * v) / (2.0 * step);
      BOOST_TEST((frame_bias_acceleration(robot, state, frame) - expected).norm() < 10.0 * of_differences);
    }
  }
}

BOOST_AUTO_TEST_CASE(generalised_force_is_the_transposed_jacobian) {
  Random random(3);
  const Robot robot = test::random_tree(random, 8);
  KinematicState state(robot);
  for (int trial = 0; trial < 100; ++trial) {
    const Eigen::VectorXd q = random.vector(robot.num_coordinates());
    state.update(robot, q, q);
    const int joint = random.integer(0, 7);
    const SpatialForce wrench{random.vector(3), random.vector(3)};
    Eigen::VectorXd force = Eigen::VectorXd::Zero(q.size());
    accumulate_generalised_force(state, joint, wrench, force);
    // about the world origin here, about the frame's origin p in the Jacobian: the moment changes by −p × f
    const Eigen::Vector3d p = frame_pose(robot, state, joint).translation();
    Vector6d about_frame;
    about_frame << wrench.linear, wrench.angular - p.cross(wrench.linear);
    BOOST_TEST((force - frame_jacobian(robot, state, joint).transpose() * about_frame).norm() < 1e-12);  // rounding
  }
}

BOOST_AUTO_TEST_CASE(generalised_forces_of_many_wrenches_add_up) {
  Random random(5);
  for (int trial = 0; trial < 100; ++trial) {
    const Robot robot = test::random_tree(random, 8);
    const Eigen::VectorXd q = random.vector(robot.num_coordinates());
    KinematicState state(robot);
    state.update(robot, q, q);
    Eigen::VectorXd together = Eigen::VectorXd::Zero(q.size()), one_by_one = together;
    GeneralisedForce sum(state, together);
    for (int joint = 7; joint >= 0; --joint) {
      for (int k = random.integer(0, 2); k > 0; --k) {
        const SpatialForce wrench{random.vector(3), random.vector(3)};
        Vector6d numbers;
        numbers << wrench.angular, wrench.linear;
        sum.add(joint, numbers);
        accumulate_generalised_force(state, joint, wrench, one_by_one);
      }
    }
    sum.finish();
    BOOST_TEST((together - one_by_one).norm() < 1e-12);  // rounding
  }
}

BOOST_AUTO_TEST_CASE(every_instruction_set_agrees_with_the_product_of_poses) {
  for (const InstructionSet set : test::EveryInstructionSet()) {
    BOOST_TEST_INFO_SCOPE(name(set));
    Random random(6);
    for (int trial = 0; trial < 100; ++trial) {
      const Robot robot = test::random_tree(random, random.integer(1, 9));
      // Also after many turns: the angle is taken as it is.
      const Eigen::VectorXd q = random.magnitude(0.1, 1e7) * random.vector(robot.num_coordinates());
      KinematicState state(robot);
      state.update(robot, q, q);
      std::vector<Eigen::Isometry3d> poses;
      for (const Joint& joint : robot.joints()) {
        const double position = joint.multiplier * q[joint.coordinate] + joint.offset;
        Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
        if (joint.type == JointType::revolute) {
          X.linear() = Eigen::AngleAxisd(position, joint.axis).toRotationMatrix();
        } else {
          X.translation() = position * joint.axis;
        }
        const Eigen::Isometry3d parent =
            joint.parent < 0 ? Eigen::Isometry3d::Identity() : poses[static_cast<std::size_t>(joint.parent)];
        poses.push_back(parent * joint.X_PJ * X);
        const KinematicState::Link& link = state.link(static_cast<int>(poses.size()) - 1);
        // Rounding, of rotations and of positions: multiplier and offset may be applied in one step, which rounds once
        // less, and an angle of a million rad is known to 1e-10.
        BOOST_TEST((link.R_WL - poses.back().linear()).norm() < 1e-13 + 4e-15 * (1.0 + q.norm()));
        BOOST_TEST((link.p_WL - poses.back().translation()).norm() < 1e-13 * (1.0 + q.norm()));
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(update_allocates_nothing) {
  Random random(4);
  const Robot robot = test::random_tree(random, 8);
  const Eigen::VectorXd q = random.vector(robot.num_coordinates());
  KinematicState state(robot);
  BOOST_TEST(test::allocations_of([&] { state.update(robot, q, q); }) == 0u);
}

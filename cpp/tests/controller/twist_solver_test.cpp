// Joint velocities for a twist, alone: J v = s V.
#include <boost/test/unit_test.hpp>

#include "../../src/controller/twist_solver.hpp"
#include "support/numbers.hpp"
#include "support/stage_model.hpp"

using namespace sidestep;
using test::nv;
using Output = ControllerSettings::Output;

namespace {

/// The stage with an arm of seven joints at q, among nothing.
struct Twisting {
  explicit Twisting(const Eigen::VectorXd& q, JointLimits limits = test::arm_limits(nv))
      : model(test::covered_arm(std::move(limits)), test::straight_settings(Output::position)),
        closing(test::no_closing(model)) {
    solver.update(q, rest);
  }
  Eigen::VectorXd solve(const Vector6d& twist, bool local = false, TwistFreedom free = TwistFreedom::none) {
    const Robot& robot = model.arm.robot();
    Eigen::VectorXd wanted = rest;
    reduction = Reduction{};
    solver.solve({robot.frames()[static_cast<std::size_t>(robot.frame_index("tip"))], twist, local, free},
                 {seen, rest, closing}, bounds, wanted, reduction);
    return wanted;
  }

  const ControllerModel model;
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(nv);
  ClosingEstimate closing;
  const Clearances seen{nv, model.system->num_embedding_coordinates()};
  VelocityBounds bounds{model.arm.robot(), model.joints, model.settings, model.clearances};
  TwistSolver solver{model.arm.robot(), model.settings, model.usable};
  Reduction reduction;
};

const Eigen::VectorXd bent = (Eigen::VectorXd(nv) << -0.5, 0.9, 0.4, 1.1, -0.3, 0.8, 0.2).finished();
const Vector6d small_twist = (Vector6d() << 0.1, -0.05, 0.08, 0.1, 0.2, -0.1).finished();
constexpr double solved = 1e-12;  // |J v − s V| of eigenvectors of a 6 × 6 matrix, for twists below 1

}  // namespace

BOOST_AUTO_TEST_CASE(a_twist_within_reach_is_made_as_it_is) {
  Twisting t(bent);
  const Eigen::VectorXd v = t.solve(small_twist);
  BOOST_TEST((t.solver.frame_motion(v) - small_twist).norm() < solved);
  BOOST_TEST(t.reduction.share == 1.0);
  BOOST_TEST((t.reduction.by == Reduction::By::nothing));
  // J is that of the frame: the tip moves so.
  KinematicState later(t.model.arm.robot());
  const double step = 1e-6;
  later.update(t.model.arm.robot(), bent + step * v, t.rest);
  const int tip = t.model.arm.robot().frame_index("tip");
  const Eigen::Vector3d moved = frame_pose(t.model.arm.robot(), later, tip).translation() -
                                frame_pose(t.model.arm.robot(), test::state_at(t.model.arm.robot(), bent), tip).translation();
  BOOST_TEST((moved / step - small_twist.head<3>()).norm() < 1e-6);  // a difference over 1e-6 rad of an arm of 2 m
}

BOOST_AUTO_TEST_CASE(a_twist_in_the_axes_of_the_frame_and_one_that_leaves_rotation_free) {
  Twisting t(bent);
  const Robot& robot = t.model.arm.robot();
  const Eigen::Matrix3d R = frame_pose(robot, test::state_at(robot, bent), robot.frame_index("tip")).linear();
  t.solve(small_twist, true);
  BOOST_TEST((t.solver.asked().head<3>() - R * small_twist.head<3>()).norm() < solved);
  BOOST_TEST((t.solver.asked().tail<3>() - R * small_twist.tail<3>()).norm() < solved);
  const double whole = t.solve(small_twist).norm();
  const Eigen::VectorXd v = t.solve(small_twist, false, TwistFreedom::rotation);
  BOOST_TEST((t.solver.frame_motion(v).head<3>() - small_twist.head<3>()).norm() < solved);
  BOOST_TEST(v.norm() < whole);  // three equations less
}

BOOST_AUTO_TEST_CASE(a_twist_that_is_too_fast_is_scaled_as_a_whole_to_the_joint_that_is_slowest) {
  Twisting t(bent);
  const Vector6d twist = 30.0 * small_twist;
  const Eigen::VectorXd v = t.solve(twist);
  BOOST_TEST((t.reduction.by == Reduction::By::speed));
  BOOST_TEST(t.reduction.share < 1.0);
  BOOST_TEST((t.solver.frame_motion(v) - t.reduction.share * twist).norm() < 30.0 * solved);
  BOOST_TEST(std::abs(std::abs(v[t.reduction.joint]) - t.model.usable.velocity[t.reduction.joint]) < 1e-14);  // rounding
  BOOST_TEST((v.cwiseAbs() - t.model.usable.velocity).maxCoeff() < 1e-14);
}

BOOST_AUTO_TEST_CASE(a_stretched_arm_is_not_stretched_further_and_says_which_way_is_lost) {
  Twisting t(Eigen::VectorXd::Zero(nv));  // upright
  Vector6d up = Vector6d::Zero();
  up[2] = 0.1;
  const Eigen::VectorXd v = t.solve(up);
  BOOST_TEST((t.reduction.by == Reduction::By::singular));
  BOOST_TEST(t.reduction.share < 0.1);
  BOOST_TEST(t.reduction.lost[2] >
             0.9);  // upright the frame lacks three directions, and what is nearly lost mixes them a little
  // A direction of the singular value σ₀ may have the speed |V| / σ₀, and no less singular one has more.
  BOOST_TEST(v.cwiseAbs().maxCoeff() <= up.norm() / t.model.settings.inputs.singular);
}

BOOST_AUTO_TEST_CASE(the_other_joints_make_up_for_one_that_is_held_at_its_limit) {
  Twisting free(bent);
  const Eigen::VectorXd before = free.solve(small_twist);
  const Eigen::Index j = 2;  // it turns the elbow about the line from shoulder to wrist, as others can
  JointLimits limits = test::arm_limits(nv);
  (before[j] > 0.0 ? limits.upper : limits.lower)[j] = bent[j] + (before[j] > 0.0 ? 0.03 : -0.03);  // where it rests
  Twisting t(bent, limits);
  const Eigen::VectorXd v = t.solve(small_twist);
  BOOST_TEST(std::abs(before[j]) > 0.005);  // it would have moved
  BOOST_TEST(std::abs(v[j]) < 1e-9);        // a bound is kept to 1e-9 rad/s, see bound_rounding
  BOOST_TEST((t.solver.frame_motion(v) - small_twist).norm() < solved);
  BOOST_TEST(t.reduction.share == 1.0);
}

BOOST_AUTO_TEST_CASE(what_is_changed_of_a_twist_moves_the_frame_by_the_difference) {
  Twisting t(bent);
  const Eigen::VectorXd v = t.solve(small_twist);
  Eigen::VectorXd change = t.rest;
  t.solver.write_change(v, change);
  BOOST_TEST(change.norm() < solved);
  t.solver.write_change(0.5 * v, change);
  BOOST_TEST((t.solver.frame_motion(change) + 0.5 * small_twist).norm() < solved);
}

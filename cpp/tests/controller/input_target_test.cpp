// What an input leads the reference to, alone: a goal whose attraction is the acceleration that was asked for.
#include <boost/test/unit_test.hpp>

#include "../../src/controller/input_target.hpp"
#include "support/serial_arm.hpp"
#include "support/stage_model.hpp"

using namespace sidestep;

namespace {

constexpr double target_rounding = 1e-13;  // of accelerations near 100

/// What a damped spring without barriers makes of the target: K (q* − q) + D (v* − v) + a*.
Eigen::VectorXd attraction(const InputTarget& target, const Reference& reference, const BarrierSettings& barriers) {
  const JointGoal& goal = std::get<JointGoal>(target.attraction());
  return barriers.stiffness * (goal.position - reference.q) + barriers.damping * (goal.velocity - reference.v) +
         goal.acceleration;
}

}  // namespace

BOOST_AUTO_TEST_CASE(the_attraction_of_an_input_is_the_acceleration_that_it_asks_for) {
  const ControllerSettings settings;
  const JointLimits limits = test::arm_limits(3);
  InputTarget target(limits, settings);
  BOOST_TEST(!target.is_followed());
  // It brakes, speeds up, and turns round.
  const Reference reference = test::reference_at(Eigen::Vector3d(0.1, 0.2, 0.3), Eigen::Vector3d(1.0, 1.0, 1.0));
  const Eigen::Vector3d velocity(0.5, 2.0, -1.0), acceleration(-10.0, 20.0, -80.0);
  target.accelerate(reference, velocity, acceleration);
  BOOST_TEST(target.is_followed());
  BOOST_TEST((attraction(target, reference, settings.barriers) - acceleration).cwiseAbs().maxCoeff() < target_rounding);
  BOOST_TEST((target.desired_acceleration() == acceleration));
  // Damping has what brakes alone: down to 0.5, nothing, down to rest.
  BOOST_TEST((std::get<JointGoal>(target.attraction()).velocity == Eigen::Vector3d(0.5, 1.0, 0.0)));
  target.respond(reference, acceleration);
  BOOST_TEST(std::get<JointGoal>(target.attraction()).acceleration.isZero(0.0));
  const Eigen::VectorXd damping = settings.barriers.damping * (std::get<JointGoal>(target.attraction()).velocity - reference.v);
  BOOST_TEST((damping - acceleration).cwiseAbs().maxCoeff() < target_rounding);
}

BOOST_AUTO_TEST_CASE(a_reference_outside_its_limits_is_attracted_to_them) {
  const ControllerSettings settings;
  const JointLimits limits = test::arm_limits(1);
  InputTarget target(limits, settings);
  const Reference reference = test::reference_at(Eigen::VectorXd::Constant(1, 2.6), Eigen::VectorXd::Zero(1));
  target.accelerate(reference, reference.v, reference.v);
  BOOST_TEST(std::get<JointGoal>(target.attraction()).position[0] == 2.5);
}

BOOST_AUTO_TEST_CASE(another_arm_goes_on_with_a_target_and_a_new_step_begins_without) {
  const ControllerSettings settings;
  const JointLimits limits = test::arm_limits(1);
  InputTarget target(limits, settings), other(limits, settings);
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(1);
  target.joint_motion().position = one;
  target.accelerate(test::reference_at(one, one), one, one);
  target.wait(true);
  other.go_on_from(target);
  BOOST_TEST(other.is_followed());
  BOOST_TEST(other.waits());
  BOOST_TEST((std::get<JointGoal>(other.motion()).position == one));
  BOOST_TEST((other.desired_acceleration() == one));
  other.clear();
  BOOST_TEST(!other.is_followed());
  BOOST_TEST(!other.waits());
}

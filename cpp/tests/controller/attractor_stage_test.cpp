// The acceleration that a goal and the curved space want, alone: what takes its place, and what slows it.
#include <boost/test/unit_test.hpp>

#include "../../src/controller/attractor_stage.hpp"
#include "support/numbers.hpp"
#include "support/stage_model.hpp"

using namespace sidestep;
using Output = ControllerSettings::Output;

namespace {

constexpr double attracted_rounding = 1e-13;  // of accelerations near 10

/// The stage with an arm of two joints, far from its limits.
struct Attracting {
  Attracting() : closing(test::no_closing(model)) {}
  Eigen::VectorXd attract(const Lead& lead, const Obstacles& obstacles = Obstacles::none()) {
    Eigen::VectorXd wanted = Eigen::VectorXd::Zero(2);
    status = stage.attract(lead, model.system->activations(), reference, obstacles, closing, Tick::regular(0.001), wanted);
    return wanted;
  }

  const ControllerModel model = test::stage_model(2, test::straight_settings(Output::position));
  const ControllerSettings& settings = model.settings;
  const Goal goal = JointGoal(Eigen::Vector2d(0.5, -0.4));
  Reference reference = test::reference_at(Eigen::Vector2d(0.1, 0.2), Eigen::Vector2d(0.3, -0.6));
  const Eigen::VectorXd spring = settings.barriers.stiffness * (std::get<JointGoal>(goal).position - reference.q) -
                                 settings.barriers.damping * reference.v;
  ClosingEstimate closing;
  AttractorStage stage{model.system, settings};
  StepStatus status = StepStatus::ok;
};

}  // namespace

BOOST_AUTO_TEST_CASE(far_from_everything_a_goal_attracts_as_a_damped_spring) {
  Attracting a;
  const Eigen::VectorXd wanted = a.attract({a.goal, nullptr, nullptr});
  BOOST_TEST((a.status == StepStatus::ok));
  BOOST_TEST((wanted - a.spring).norm() < attracted_rounding);
  // At no more than a share of its speed the rest is damped like a stop.
  const Eigen::VectorXd slowed = 0.3 * a.spring - 0.7 / a.settings.stop_time * a.reference.v;
  BOOST_TEST((a.attract({a.goal, nullptr, nullptr, 0.3}) - slowed).norm() < attracted_rounding);
}

BOOST_AUTO_TEST_CASE(a_path_that_is_kept_a_way_out_and_a_stop_take_the_place_of_the_attraction) {
  Attracting a;
  const Eigen::VectorXd kept = Eigen::Vector2d(7.0, -3.0);
  BOOST_TEST((a.attract({a.goal, nullptr, &kept}) - kept).norm() < attracted_rounding);
  const AvoidanceTrajectory aside(a.model.arm.robot().limits(), a.reference.q, a.reference.v, Eigen::Vector2d(-1.0, 1.0));
  const Eigen::VectorXd followed = aside.acceleration(a.reference.q, a.reference.v, a.settings.period);
  BOOST_TEST((a.attract({a.goal, &aside, nullptr}) - followed).norm() < attracted_rounding);
  // As fast as acceleration and jerk allow, and at the end with a tenth of the stop's time constant.
  const JointLimits& limits = a.model.arm.robot().limits();
  Eigen::VectorXd stop = -a.reference.v / (0.1 * a.settings.stop_time);
  for (Eigen::Index j = 0; j < stop.size(); ++j) {
    const double most = std::min(limits.acceleration[j], std::sqrt(1.8 * limits.jerk[j] * std::abs(a.reference.v[j])));
    stop[j] = std::clamp(stop[j], -most, most);
  }
  BOOST_TEST((a.attract({a.goal, nullptr, &kept, 1.0, true}) - stop).norm() < attracted_rounding);
}

BOOST_AUTO_TEST_CASE(an_arm_inside_a_barrier_is_pushed_out_also_on_a_path_that_is_kept_and_at_no_pace) {
  Attracting a;
  a.reference.v = Eigen::Vector2d(0.0, 0.2);  // further in
  const Eigen::VectorXd kept = Eigen::VectorXd::Zero(2);
  const Obstacles near = test::ball({0.117, 0.0, 0.75}, 0.05);  // it reaches into the second link, tilted by 0.2 rad
  const Eigen::VectorXd wanted = a.attract({a.goal, nullptr, &kept}, near);
  const Eigen::VectorXd push = a.stage.at_reference().recovery;
  BOOST_TEST((a.status == StepStatus::inside_barrier));
  BOOST_TEST(push.norm() > 0.1);
  BOOST_TEST((wanted - push).norm() < attracted_rounding);
  const Eigen::VectorXd at_no_pace = a.attract({a.goal, nullptr, &kept, 0.0}, near);
  BOOST_TEST((at_no_pace - push + a.reference.v / a.settings.stop_time).norm() < attracted_rounding);
}

BOOST_AUTO_TEST_CASE(the_arm_is_looked_at_beside_the_reference) {
  Attracting a;
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(2), unknown = Eigen::VectorXd::Constant(2, test::not_a_number);
  const Obstacles near = test::ball({0.14, 0.0, 0.75}, 0.05);
  a.attract({a.goal, nullptr, nullptr}, near);
  BOOST_TEST(a.stage.look_at_arm(a.reference.q, a.reference.v, near, a.closing));
  BOOST_TEST((a.stage.at_arm().clearances.values == a.stage.at_reference().clearances.values));
  BOOST_TEST(
      a.stage.look_at_arm(rest, rest, near, a.closing));  // upright: the second link is 0.09 m away, not tilted towards it
  BOOST_TEST(a.stage.at_arm().clearances.least.minCoeff() > a.stage.at_reference().clearances.least.minCoeff());
  BOOST_TEST(!a.stage.look_at_arm(unknown, rest, near, a.closing));
  BOOST_TEST((&a.stage.clearances() == &a.stage.at_reference().clearances));  // nothing closes beside what was told
}

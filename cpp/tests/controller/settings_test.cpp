// Every setting has a default in its range, and values beyond it are refused by name.
#include "sidestep/controller/settings.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "sidestep/controller/controller.hpp"
#include "support/covered_arm.hpp"
#include "support/numbers.hpp"

using namespace sidestep;

namespace {

std::string message_of(const ControllerSettings& settings) {
  try {
    settings.validate();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

/// Checks a group of the tree; `of` gives that group of some settings.
template <class Settings, class Of>
void check_group(const std::string& group, Of of) {
  static const Settings defaults{};
  BOOST_TEST(!fields<Settings>().empty());
  for (const Field<Settings>& field : fields<Settings>()) {
    BOOST_TEST_CONTEXT(group << field.name) {
      const double value = value_of(field, defaults);
      BOOST_TEST((value >= field.least && value <= field.most));
      BOOST_TEST(std::string(field.trades).size() > 10U);
      const auto refuses = [&](double number) {
        ControllerSettings settings;
        std::visit(
            [&](auto member) {
              using Value = std::remove_reference_t<decltype(of(settings).*member)>;
              of(settings).*member = static_cast<Value>(number);
            },
            field.member);
        const std::string message = message_of(settings);
        BOOST_TEST(message.find(group + field.name) != std::string::npos, message);
        BOOST_TEST(message.find("allowed: ") != std::string::npos, message);
      };
      const bool whole = std::holds_alternative<int Settings::*>(field.member);
      const bool real = std::holds_alternative<double Settings::*>(field.member);
      if (whole || real) {
        const auto step = [&](double at) { return whole ? 1.0 : 1e-9 * (1.0 + std::abs(at)); };
        refuses(field.least - step(field.least));
        if (std::isfinite(field.most)) {
          refuses(field.most + step(field.most));
        }
      }
      if (real) {
        refuses(test::not_a_number);
      }
    }
  }
}

}  // namespace

BOOST_AUTO_TEST_CASE(every_field_has_a_default_in_its_range_and_refuses_what_is_beyond) {
  BOOST_TEST(message_of({}) == "");
  check_group<ControllerSettings>("controller: ", [](ControllerSettings& s) -> auto& { return s; });
  check_group<BarrierSettings>("controller: barriers.", [](ControllerSettings& s) -> auto& { return s.barriers; });
  check_group<SafetySettings>("controller: safety.", [](ControllerSettings& s) -> auto& { return s.safety; });
  check_group<ArrivalSettings>("controller: arrival.", [](ControllerSettings& s) -> auto& { return s.arrival; });
  check_group<SpeedLimitSettings>("controller: speed_limits.", [](ControllerSettings& s) -> auto& {
    return s.speed_limits ? *s.speed_limits : s.speed_limits.emplace();
  });
  check_group<OnlinePlannerSettings>("controller: planner.", [](ControllerSettings& s) -> auto& { return *s.planner; });
  check_group<PlannerSettings>("controller: planner.search.", [](ControllerSettings& s) -> auto& { return s.planner->search; });
  check_group<TimedPathSettings>("controller: planner.route.", [](ControllerSettings& s) -> auto& { return s.planner->route; });
  check_group<LookAheadSettings>("controller: look_ahead.", [](ControllerSettings& s) -> auto& { return *s.look_ahead; });
  check_group<LocalMinimumSettings>("controller: local_minimum.",
                                    [](ControllerSettings& s) -> auto& { return *s.local_minimum; });
}

BOOST_AUTO_TEST_CASE(what_a_controller_cannot_do_is_refused_with_name_value_and_range) {
  ControllerSettings settings;
  settings.barriers.floor = 0.02;
  settings.barriers.self_activation = 0.02;
  BOOST_TEST(message_of(settings).find("barriers.floor is 0.02") != std::string::npos);
  settings = {};
  settings.speed_limits = SpeedLimitSettings{0.25, 0.5, 1.5, 0.4};
  BOOST_TEST(message_of(settings).find("near_distance is 0.5") != std::string::npos);

  JointLimits limits = test::arm_limits(test::nv);
  limits.effort.setConstant(test::infinity);
  settings = {};
  settings.output = ControllerSettings::Output::torque;
  BOOST_CHECK_EXCEPTION(Controller(test::covered_arm(limits), settings), std::invalid_argument,
                        [](const auto& error) { return std::string(error.what()).find("effort limit") != std::string::npos; });
  settings = {};
  settings.position_margin = 0.99;
  limits = test::arm_limits(test::nv);
  limits.lower[2] = -0.5;
  limits.upper[2] = 0.5;
  BOOST_CHECK_EXCEPTION(Controller(test::covered_arm(limits), settings), std::invalid_argument, [](const auto& error) {
    const std::string text = error.what();
    return text.find("position_margin is 0.99") != std::string::npos && text.find("joint3") != std::string::npos;
  });
}

BOOST_AUTO_TEST_CASE(goals_that_cannot_be_followed_are_refused_and_the_one_before_stays) {
  ControllerSettings settings;
  settings.synchronous = true;
  const Arm arm = test::covered_arm(test::arm_limits(test::nv));
  Controller controller(arm, settings);
  const Eigen::VectorXd q = Eigen::VectorXd::Zero(test::nv), goal = Eigen::VectorXd::Constant(test::nv, 0.2);
  controller.set_goal(goal);
  Eigen::VectorXd outside = goal;
  outside[3] = 2.6;
  BOOST_CHECK_EXCEPTION(controller.set_goal(outside), std::invalid_argument, [](const auto& error) {
    const std::string text = error.what();
    return text.find("joint4") != std::string::npos && text.find("2.6") != std::string::npos &&
           text.find("2.5") != std::string::npos;
  });
  BOOST_CHECK_THROW(controller.set_goal(Eigen::VectorXd(goal.head(3))), std::invalid_argument);
  Eigen::Isometry3d nowhere = Eigen::Isometry3d::Identity();
  nowhere.translation().setConstant(test::not_a_number);
  BOOST_CHECK_THROW(controller.set_goal(PoseGoal(arm.robot(), "tip", nowhere)), std::invalid_argument);
  controller.step(q, q);
  BOOST_TEST((controller.target() - goal).norm() == 0.0);
  Eigen::VectorXd rounded = goal;
  rounded[3] = 2.5 + 1e-10;  // a limit that went through single precision or degrees
  controller.set_goal(rounded);
  controller.step(q, q);
  BOOST_TEST(controller.target()[3] == 2.5);
}

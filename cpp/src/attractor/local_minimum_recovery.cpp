#include "sidestep/attractor/local_minimum_recovery.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../math/settings.hpp"
#include "random_configuration.hpp"

namespace sidestep {
namespace {

// Share of the patience that is enough on the way to a sub-goal, which need not be reached.
constexpr double half_patience = 0.5;
constexpr double near_sub_goal = 0.2;  // Error at which a sub-goal counts as reached [rad | m].
constexpr double at_goal = 0.01;  // Error at which the goal counts as reached [rad | m]: there is nothing left to be stuck on.
constexpr double jump = 2.0;      // Growth of the squared distance in one step from which the goal counts as another one.
// Distance of a goal from that of the step before from which it counts as another one [rad | m].
constexpr double elsewhere = 0.2;

const LocalMinimumSettings& validated(const LocalMinimumSettings& settings) {
  settings.validate();
  return settings;
}

/// Falls as the goal gets nearer. Of a configuration it is known at once; of a pose it is that of the step before.
double way_left(const Goal& goal, ConstVectorRef q, double potential) noexcept {
  const auto* joint = std::get_if<JointGoal>(&goal);
  return joint == nullptr ? potential : (q - joint->position).squaredNorm();
}

/// Whether every joint, or a pose's position and rotation together, is within at_goal of the goal.
bool arrived(const Goal& goal, ConstVectorRef q, double potential) noexcept {
  if (const auto* joint = std::get_if<JointGoal>(&goal)) {
    return (q - joint->position).cwiseAbs().maxCoeff() <= at_goal;
  }
  const PoseGoalSettings& s = std::get<PoseGoal>(goal).settings;
  return potential <= 0.5 * (s.position_stiffness + (s.position_only ? 0.0 : s.orientation_stiffness)) * at_goal * at_goal;
}

}  // namespace

template <>
const std::vector<Field<LocalMinimumSettings>>& fields() {
  using S = LocalMinimumSettings;
  static const std::vector<Field<S>> all{
      {"patience", &S::patience, "s", 0.05, 60.0, "time without progress after which the arm goes to a sub-goal"},
      {"fraction", &S::fraction, "-", 1e-4, 0.99,
       "share by which the squared distance to the goal must fall to count as progress"},
      {"leg", &S::leg, "s", 0.1, 60.0, "longest duration of the motion to the first sub-goal; n times as long for the n-th"},
      {"spread", &S::spread, "rad", 0.01, 20.0,
       "largest distance of each joint of the first sub-goal from the arm; n times as far for the n-th"},
  };
  return all;
}

void LocalMinimumSettings::validate() const { check_fields("local_minimum: ", *this); }

LocalMinimumRecovery::LocalMinimumRecovery(const Robot& robot, LocalMinimumSettings settings)
    : settings_(validated(settings)),
      lower_(robot.limits().lower),
      upper_(robot.limits().upper),
      random_(settings.seed),
      stuck_(settings.patience, settings.fraction),
      halted_(half_patience * settings.patience, settings.fraction),
      sub_goal_(JointGoal(Eigen::VectorXd::Zero(robot.num_coordinates()))),
      configuration_(Eigen::VectorXd::Zero(robot.num_coordinates())) {}

const Goal& LocalMinimumRecovery::pursue(const Goal& goal, ConstVectorRef q, double potential, double period) noexcept {
  time_ += period;
  if (is_elsewhere(goal)) {
    turn(false, q);
    tries_ = 0;
  }
  if (!escaping_) {
    const double way = way_left(goal, q, turned_ ? std::numeric_limits<double>::quiet_NaN() : potential);
    turned_ = false;
    if (way > jump * way_ || arrived(goal, q, way)) {
      stuck_.reset();
      tries_ = 0;
    }
    way_ = way;
    if (!std::isnan(way) && stuck_.update(time_, way)) {
      turn(true, q);
    }
  } else {
    const double error = (q - std::get<JointGoal>(sub_goal_).position).cwiseAbs().maxCoeff();
    const bool late = time_ - since_ >= tries_ * settings_.leg;
    if (halted_.update(time_, way_left(sub_goal_, q, potential)) || error < near_sub_goal || late) {
      turn(false, q);
    }
  }
  return escaping_ ? sub_goal_ : goal;
}

bool LocalMinimumRecovery::is_elsewhere(const Goal& goal) noexcept {
  // Written so that a goal that is not finite, and the next one after it, count as elsewhere.
  const auto* joint = std::get_if<JointGoal>(&goal);
  bool here = was_pose_ == (joint == nullptr);
  was_pose_ = joint == nullptr;
  if (joint != nullptr) {
    here = here && ((joint->position - configuration_).array().abs() <= elsewhere).all();
    configuration_ = joint->position;
  } else {
    const PoseGoal& now = std::get<PoseGoal>(goal);
    here =
        here && (now.pose.translation() - pose_.translation()).norm() <= elsewhere &&
        (now.settings.position_only || Eigen::AngleAxisd(pose_.linear().transpose() * now.pose.linear()).angle() <= elsewhere);
    pose_ = now.pose;
  }
  return !here;
}

void LocalMinimumRecovery::turn(bool escape, ConstVectorRef q) noexcept {
  escaping_ = escape;
  turned_ = true;
  since_ = time_;
  stuck_.reset();
  halted_.reset();
  way_ = std::numeric_limits<double>::infinity();
  if (escape) {
    ++count_;
    ++tries_;
    random_configuration(random_, lower_, upper_, q, tries_ * settings_.spread, std::get<JointGoal>(sub_goal_).position);
  }
}

}  // namespace sidestep

#include "sidestep/dynamical_system/escape.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace sidestep {
namespace {

constexpr double half_patience = 0.5;    // a sub-goal need not be reached: half the patience is enough for it
constexpr double near_sub_goal = 0.2;    // [rad | m] is as good as there

const EscapeSettings& validated(const EscapeSettings& settings) {
  settings.validate();
  return settings;
}

/// Uniform in [0, 1), the same on every machine (the standard's distributions are not).
double uniform(std::mt19937_64& random) noexcept { return static_cast<double>(random() >> 11) * 0x1p-53; }

}  // namespace

void EscapeSettings::validate() const {
  const auto require = [](bool good, const char* name, double value, const char* allowed) {
    if (!good) {
      throw std::invalid_argument(std::string("escape: ") + name + " is " + std::to_string(value) + ", must be " + allowed);
    }
  };
  require(patience > 0.0 && std::isfinite(patience), "patience", patience, "positive and finite");
  require(leg > 0.0 && std::isfinite(leg), "leg", leg, "positive and finite");
  require(spread > 0.0 && std::isfinite(spread), "spread", spread, "positive and finite");
  require(fraction > 0.0 && fraction < 1.0, "fraction", fraction, "between 0 and 1");
}

Escape::Escape(const Robot& robot, EscapeSettings settings)
    : settings_(validated(settings)),
      lower_(robot.limits().lower),
      upper_(robot.limits().upper),
      random_(settings.seed),
      stuck_(settings.patience, settings.fraction),
      halted_(half_patience * settings.patience, settings.fraction),
      sub_goal_(JointGoal(Eigen::VectorXd::Zero(robot.num_coordinates()))) {}

const Goal& Escape::pursue(const Goal& goal, Eigen::Ref<const Eigen::VectorXd> q, double potential,
                           double period) noexcept {
  time_ += period;
  if (turned_ || std::isnan(potential)) {
    turned_ = false;
    return escaping_ ? sub_goal_ : goal;
  }
  if (!escaping_) {
    if (stuck_.update(time_, potential)) {
      turn(true, q);
    }
  } else {
    const double way = (q - std::get<JointGoal>(sub_goal_).position).cwiseAbs().maxCoeff();
    if (halted_.update(time_, potential) || way < near_sub_goal || time_ - since_ >= settings_.leg) {
      turn(false, q);
    }
  }
  return escaping_ ? sub_goal_ : goal;
}

void Escape::turn(bool escape, Eigen::Ref<const Eigen::VectorXd> q) noexcept {
  escaping_ = escape;
  turned_ = true;
  since_ = time_;
  stuck_.reset();
  halted_.reset();
  if (escape) {
    ++count_;
    Eigen::VectorXd& position = std::get<JointGoal>(sub_goal_).position;
    for (Eigen::Index j = 0; j < position.size(); ++j) {
      const double low = std::max(lower_[j], q[j] - settings_.spread);
      const double high = std::min(upper_[j], q[j] + settings_.spread);
      position[j] = std::clamp(low + uniform(random_) * (high - low), lower_[j], upper_[j]);
    }
  }
}

}  // namespace sidestep

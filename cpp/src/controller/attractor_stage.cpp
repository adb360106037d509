#include "attractor_stage.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sidestep {
namespace {

constexpr double end_of_braking = 0.1;  // Time constant with which braking ends, as a share of the stop's [-].
constexpr double braking_jerk = 0.9;    // Share of the jerk limit with which braking ends [-].
constexpr double least_periods = 5.0;   // The same at least [periods].

}  // namespace

AttractorStage::AttractorStage(std::shared_ptr<const GeometricSystem> system, const ControllerSettings& settings)
    : system_(std::move(system)),
      settings_(settings),
      reference_(*system_),
      arm_(*system_),
      corrected_(system_->robot().num_coordinates(), system_->num_embedding_coordinates()),
      arm_corrected_(corrected_),
      clearances_(&reference_.clearances),
      arm_clearances_(&arm_.clearances) {}

StepStatus AttractorStage::attract(const Lead& lead, const Eigen::VectorXd& activations, const Reference& reference,
                                   const Obstacles& obstacles, const ClosingEstimate& closing, const Tick& tick,
                                   Eigen::VectorXd& wanted) noexcept {
  reference_.activations = activations;
  reference_.horizon = arm_.horizon = lead.avoidance != nullptr ? 0.0 : Horizon::of_obstacles;
  const StepStatus status = system_->acceleration(reference.q, reference.v, lead.goal, obstacles, reference_);
  clearances_ = &closing.corrected(reference_.clearances, corrected_);
  wanted = reference_.acceleration;
  if (!is_fallback(status)) {
    if (lead.avoidance != nullptr) {
      lead.avoidance->acceleration(reference.q, reference.v, tick.period, wanted);
    } else if (lead.kept_path != nullptr) {
      wanted = *lead.kept_path + reference_.recovery;
    }
    if (lead.pace < 1.0) {
      // Damped, at no pace like a stop; the way out of a barrier is not.
      wanted = lead.pace * (wanted - reference_.recovery) - (1.0 - lead.pace) / settings_.stop_time * reference.v +
               reference_.recovery;
    }
  }
  if (lead.rests) {
    write_braking(reference.v, wanted);
  } else if (closing.changes() && lead.avoidance == nullptr && !is_fallback(status)) {
    wait_in_doubt(closing, wanted);
  }
  return status;
}

void AttractorStage::write_braking(const Eigen::VectorXd& v, Eigen::VectorXd& wanted) const noexcept {
  const JointLimits& limits = system_->robot().limits();
  const double last = std::max(end_of_braking * settings_.stop_time, least_periods * settings_.period);
  for (Eigen::Index j = 0; j < v.size(); ++j) {
    const double speed = std::abs(v[j]);
    const double most = std::min(limits.acceleration[j], std::sqrt(2.0 * braking_jerk * limits.jerk[j] * speed));
    wanted[j] = -std::copysign(std::min(most, speed / last), v[j]);
  }
}

void AttractorStage::wait_in_doubt(const ClosingEstimate& closing, Eigen::VectorXd& wanted) const noexcept {
  bool doubted = false;
  for (std::size_t k = 0; k < system_->labels().size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    if (reference_.clearances.values[at] < system_->labels()[k].floor) {
      if (!closing.is_doubted(at)) {
        return;
      }
      doubted = true;
    }
  }
  if (doubted) {
    wanted -= reference_.recovery;
  }
}

bool AttractorStage::look_at_arm(const Eigen::VectorXd& q, const Eigen::VectorXd& v, const Obstacles& obstacles,
                                 const ClosingEstimate& closing) noexcept {
  arm_.activations = reference_.activations;
  const bool usable = system_->embed(q, v, obstacles, arm_);
  arm_clearances_ = &closing.corrected(arm_.clearances, arm_corrected_);
  return usable;
}

void AttractorStage::look_at_reference(const Reference& reference, const Goal& goal, const Obstacles& obstacles) noexcept {
  static_cast<void>(system_->acceleration(reference.q, reference.v, goal, obstacles, reference_));
}

}  // namespace sidestep

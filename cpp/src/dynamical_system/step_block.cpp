#include "sidestep/dynamical_system/step_block.hpp"

#include <algorithm>
#include <limits>
#include <variant>

#include "../kinematics/kernels/in_use.hpp"
#include "kernels/step_kernel.hpp"
#include "sidestep/embedding/embedding.hpp"

namespace sidestep {
namespace {

using Lane = Eigen::Array<double, block_states, 1>;

/// For each state the weight of the harmonic acceleration; see switch.hpp.
struct Weight {
  const Lane& psi;

  Lane operator()(const Unswitched&) const noexcept { return Lane::Ones(); }
  Lane operator()(const HarmonicOnly&) const noexcept { return Lane::Ones(); }
  Lane operator()(const GeodesicOnly&) const noexcept { return Lane::Zero(); }
  Lane operator()(const BinarySwitch& s) const noexcept { return (psi <= s.threshold).cast<double>(); }
  Lane operator()(const SigmoidSwitch& s) const noexcept {
    return 1.0 - 1.0 / (1.0 + (-s.slope * (psi - s.threshold)).exp());
  }
  Lane operator()(const DistanceSwitch&) const noexcept { return Lane::Zero(); }  // see StepBlock::takes
};

kernels::TakeSteps take_steps() noexcept {
  return SIDESTEP_KERNEL_IN_USE(kernels::take_steps);
}

}  // namespace

bool StepBlock::takes(const GeometricSystem& system) noexcept {
  const GeometricSystemSettings& settings = system.settings();
  return system.embeddings().size() == 1 && system.embeddings().front()->takes_blocks() &&
         settings.pull_form == PullForm::metric && !settings.speed &&
         !std::holds_alternative<DistanceSwitch>(settings.combination);
}

StepBlock::StepBlock(const GeometricSystem& system)
    : q(static_cast<std::size_t>(system.robot().num_coordinates())),
      v(q),
      goal(q),
      acceleration(q),
      system_(system),
      stiffness_(system.settings().stiffness),
      damping_(system.settings().damping),
      kinematics_(system.robot()),
      embedding_(system.robot().num_coordinates()),
      harmonic_(q),
      alone_(system),
      q_(Eigen::VectorXd::Zero(system.robot().num_coordinates())),
      v_(q_),
      goal_(q_) {}

void StepBlock::update(const Obstacles& obstacles) noexcept {
  kinematics_.update(q, v);
  embedding_.value = embedding_.curvature = {};
  std::fill(embedding_.gradient.begin(), embedding_.gradient.end(), BlockRow{});
  system_.embeddings().front()->add_block(embedding_, kinematics_, obstacles);

  const GeometricSystemSettings& settings = system_.settings();
  const Lane weight = std::visit(Weight{Eigen::Map<const Lane>(embedding_.value.of)}, settings.combination);
  const bool adds = std::holds_alternative<Unswitched>(settings.combination);
  BlockRow fall_weight;
  Eigen::Map<Lane>(fall_weight.of) = adds ? Lane(Lane::Ones()) : Lane(1.0 - weight);
  Eigen::Map<Lane>(switch_weight.of) = weight;
  value = embedding_.value;

  const JointLimits& limits = system_.robot().limits();
  const unsigned regular =
      take_steps()({static_cast<int>(q.size()), stiffness_.data(), damping_.data(), stiffness_.is_diagonal(),
                    damping_.is_diagonal(), settings.damping_form == DampingForm::metric, limits.lower.data(),
                    limits.upper.data()},
                   {q.front().of, v.front().of, goal.front().of, embedding_.gradient.front().of, embedding_.curvature.of,
                    switch_weight.of, fall_weight.of, harmonic_.front().of, acceleration.front().of});
  for (int state = 0; state < block_states; ++state) {
    statuses[static_cast<std::size_t>(state)] = StepStatus::ok;
    if ((regular >> state & 1u) == 0) {
      take_alone(state, obstacles);
    }
  }
}

void StepBlock::take_alone(int state, const Obstacles& obstacles) noexcept {
  get(q, state, q_);
  get(v, state, v_);
  get(goal, state, goal_);
  const StepStatus status = system_.acceleration(q_, v_, goal_, obstacles, alone_);
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  statuses[static_cast<std::size_t>(state)] = status;
  set(acceleration, state, alone_.acceleration);
  value.of[state] = is_fallback(status) ? none : alone_.values[0];
  switch_weight.of[state] = is_fallback(status) ? none : alone_.switch_weights[0];
}

}  // namespace sidestep

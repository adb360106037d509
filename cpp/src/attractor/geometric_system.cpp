#include "sidestep/attractor/geometric_system.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "../math/finite.hpp"
#include "../math/settings.hpp"
#include "outside.hpp"

namespace sidestep {
namespace {

template <class... Ts>
struct Overloaded : Ts... {
  using Ts::operator()...;
};

double sigmoid(double u) noexcept { return 1.0 / (1.0 + std::exp(-u)); }

void check_gain(const Eigen::MatrixXd& gain, const char* name, int nv) {
  if (gain.rows() != nv || gain.cols() != nv) {
    throw std::invalid_argument(std::string(name) + " is " + std::to_string(gain.rows()) + " × " + std::to_string(gain.cols()) +
                                ", expected " + std::to_string(nv) + " × " + std::to_string(nv));
  }
  constexpr double tolerance = 1e-12;  // Asymmetry of a gain that is rounding, relative to its largest entry.
  const double margin = tolerance * gain.cwiseAbs().maxCoeff() + std::numeric_limits<double>::min();
  const Eigen::MatrixXd shifted = gain + margin * Eigen::MatrixXd::Identity(nv, nv);
  if (!gain.allFinite() || !((gain - gain.transpose()).cwiseAbs().maxCoeff() <= margin) ||
      shifted.llt().info() != Eigen::Success) {
    throw std::invalid_argument(std::string(name) + " must be finite, symmetric and positive semi-definite");
  }
}

void check_finite(double value, const char* name) {
  if (!std::isfinite(value)) {
    throw std::invalid_argument(std::string(name) + " must be finite");
  }
}

}  // namespace

GeometricSystem::GeometricSystem(Robot robot, std::vector<std::shared_ptr<const Embedding>> embeddings,
                                 GeometricSystemSettings settings)
    : robot_(std::move(robot)),
      embeddings_(std::move(embeddings)),
      settings_(std::move(settings)),
      stiffness_(settings_.stiffness),
      damping_(settings_.damping) {
  const int nv = robot_.num_coordinates();
  bool measures_distances = false;
  for (const auto& embedding : embeddings_) {
    if (!embedding->robot().same_joints(robot_)) {
      throw std::invalid_argument("an embedding was made for robot '" + embedding->robot().name() + "', not for '" +
                                  robot_.name() + "'");
    }
    num_embedding_coordinates_ += embedding->num_coordinates();
    for (int k = 0; k < embedding->num_coordinates(); ++k) {
      labels_.push_back(embedding->label(k));
    }
    measures_distances = measures_distances || embedding->measures_distances();
  }
  check_gain(settings_.stiffness, "stiffness", nv);
  check_gain(settings_.damping, "damping", nv);
  require_positive(settings_.fallback_rate, "fallback rate");
  settings_.recovery.validate();
  floors_ = Eigen::VectorXd::NullaryExpr(num_embedding_coordinates_,
                                         [this](Eigen::Index k) { return labels_[static_cast<std::size_t>(k)].floor; });
  activations_.resize(num_embedding_coordinates_);
  Eigen::Index start = 0;
  for (const auto& embedding : embeddings_) {
    embedding->write_activations(activations_.segment(start, embedding->num_coordinates()));
    start += embedding->num_coordinates();
  }
  std::visit(Overloaded{
                 [](const Unswitched&) {},
                 [](const HarmonicOnly&) {},
                 [](const GeodesicOnly&) {},
                 [](const BinarySwitch& s) { check_finite(s.threshold, "switch threshold"); },
                 [](const SigmoidSwitch& s) {
                   check_finite(s.threshold, "switch threshold");
                   require_positive(s.slope, "switch slope");
                 },
                 [&](const DistanceSwitch& s) {
                   require_positive(s.slope, "switch slope");
                   if (s.thresholds.size() != nv || !s.thresholds.allFinite()) {
                     throw std::invalid_argument("switch thresholds: expected " + std::to_string(nv) + " finite values, got " +
                                                 std::to_string(s.thresholds.size()));
                   }
                   if (!measures_distances) {
                     throw std::invalid_argument("a distance switch needs an embedding with a body, such as CollisionDensity");
                   }
                 },
             },
             settings_.combination);
}

bool GeometricSystem::lower_activations(ConstVectorRef q, const Obstacles& obstacles, Workspace& w,
                                        Eigen::Ref<Eigen::VectorXd> activations) const noexcept {
  if (!embed(q, w.rest_, obstacles, w)) {
    return false;
  }
  Eigen::Index start = 0;
  for (const auto& embedding : embeddings_) {
    const Eigen::Index m = embedding->num_coordinates();
    embedding->lower_activations(w.clearances.values.segment(start, m), activations.segment(start, m));
    start += m;
  }
  return true;
}

GeometricSystem::Workspace::Workspace(const GeometricSystem& system)
    : acceleration(Eigen::VectorXd::Zero(system.robot().num_coordinates())),
      harmonic(acceleration),
      geodesic(acceleration),
      attraction(acceleration),
      recovery(acceleration),
      switch_weights(acceleration),
      values(Eigen::VectorXd::Zero(system.num_embedding_coordinates())),
      curvatures(values),
      jacobian_transposed(Eigen::MatrixXd::Zero(acceleration.size(), values.size())),
      clearances(system.robot().num_coordinates(), system.num_embedding_coordinates()),
      activations(system.activations()),
      metric(system.robot().num_coordinates(), system.num_embedding_coordinates()),
      goal(system.robot().num_coordinates()),
      state_(system.robot()),
      relative_velocity_(acceleration),
      distances_(acceleration),
      rest_(acceleration),
      one_sided_(system.robot().num_coordinates(), system.num_embedding_coordinates()),
      recovery_(system.robot().num_coordinates(), system.num_embedding_coordinates()),
      joint_goal_(JointGoal(acceleration)) {}

StepStatus GeometricSystem::acceleration(ConstVectorRef q, ConstVectorRef v, ConstVectorRef goal, const Obstacles& obstacles,
                                         Workspace& w) const noexcept {
  with_size(robot_.num_coordinates(),
            [&](auto nv) { sized(std::get<JointGoal>(w.joint_goal_).position, nv) = sized(goal, nv); });
  return acceleration(q, v, w.joint_goal_, obstacles, w);
}

StepStatus GeometricSystem::acceleration(ConstVectorRef q, ConstVectorRef v, const Goal& goal, const Obstacles& obstacles,
                                         Workspace& w) const noexcept {
  return with_size(robot_.num_coordinates(), [&](auto nv) { return step(q, v, goal, obstacles, w, nv); });
}

template <class Size>
StepStatus GeometricSystem::step(ConstVectorRef q, ConstVectorRef v, const Goal& goal, const Obstacles& obstacles, Workspace& w,
                                 Size nv) const noexcept {
  if (!embed(q, v, obstacles, w)) {
    return fall_back(StepStatus::invalid_state, v, w);
  }
  const GoalFault fault = check(goal, robot_);
  w.metric.update(w.jacobian_transposed);
  if (fault == GoalFault::invalid || fault == GoalFault::outside_limits) {
    w.goal.release();  // barriers, damping and recovery go on without a goal: the arm still evades obstacles
  } else {
    w.goal.update(goal, w.state_, stiffness_);
  }

  // h = −G⁻¹ ∂U − D (v − v*), its first term perhaps one-sided, or with D (v − v*) under G⁻¹ too.
  const auto velocity = sized(v, nv);
  auto attraction = sized(w.attraction, nv), harmonic = sized(w.harmonic, nv), geodesic = sized(w.geodesic, nv);
  attraction = -sized(w.goal.gradient, nv);
  if (settings_.pull_form == PullForm::one_sided) {
    w.one_sided_.solve_in_place(w.jacobian_transposed, w.attraction);
  } else {
    w.metric.solve_in_place(w.attraction);
  }
  auto relative_velocity = sized(w.relative_velocity_, nv);
  relative_velocity = velocity - sized(w.goal.velocity, nv);
  damping_.multiply(relative_velocity, harmonic, nv);
  if (settings_.damping_form == DampingForm::metric) {
    w.metric.solve_in_place(w.harmonic);
  }
  harmonic = attraction - harmonic;
  // g = −G⁻¹ Jᵀ d²ψ/dt², in the one-sided form of recovery.hpp unless it is all there is.
  const bool falls_freely = std::holds_alternative<GeodesicOnly>(settings_.combination);
  w.inside = w.recovery_.update(settings_.recovery, floors_, w.clearances, w.jacobian_transposed, w.recovery);
  if (falls_freely) {
    w.metric.solve_pullback(w.curvatures, w.geodesic);
  } else {
    w.recovery_.solve_pullback(settings_.recovery, w.clearances, w.jacobian_transposed, w.curvatures, w.metric, w.geodesic);
  }
  geodesic = -geodesic;

  combine(obstacles, w, nv);
  auto acceleration = sized(w.acceleration, nv);
  if (!falls_freely) {
    acceleration += sized(w.recovery, nv);
  }
  if (!all_finite(acceleration)) {
    return fall_back(StepStatus::not_finite, v, w);
  }
  w.status_ = w.inside >= 0                                   ? StepStatus::inside_barrier
              : fault == GoalFault::invalid                   ? StepStatus::invalid_goal
              : fault == GoalFault::outside_limits            ? StepStatus::goal_outside_limits
              : is_outside(sized(q, nv), robot_.limits(), nv) ? StepStatus::outside_limits
              : fault == GoalFault::out_of_reach              ? StepStatus::goal_out_of_reach
                                                              : StepStatus::ok;
  return w.status_;
}

bool GeometricSystem::embed(ConstVectorRef q, ConstVectorRef v, const Obstacles& obstacles, Workspace& w) const noexcept {
  if (!with_size(robot_.num_coordinates(), [&](auto nv) { return all_finite(sized(q, nv)) && all_finite(sized(v, nv)); })) {
    return false;
  }
  w.state_.update(robot_, q, v);
  w.values.setZero();
  w.curvatures.setZero();
  w.jacobian_transposed.setZero();
  w.clearances.clear();
  Eigen::Index start = 0;
  for (const auto& embedding : embeddings_) {
    const Eigen::Index m = embedding->num_coordinates();
    embedding->add_to({{w.values.data() + start, m},
                       {w.jacobian_transposed.data() + start * q.size(), q.size(), m},
                       {w.curvatures.data() + start, m},
                       w.clearances.view(start, m),
                       {w.activations.data() + start, m},
                       w.horizon},
                      w.state_, obstacles);
    start += m;
  }
  return true;
}

bool GeometricSystem::touches(ConstVectorRef q, const Obstacles& obstacles, double depth, Workspace& w) const noexcept {
  w.state_.update(robot_, q, w.rest_);
  return std::any_of(embeddings_.begin(), embeddings_.end(),
                     [&](const auto& embedding) { return embedding->touches(w.state_, obstacles, depth); });
}

template <class Size>
void GeometricSystem::combine(const Obstacles& obstacles, Workspace& w, Size nv) const noexcept {
  const auto harmonic = sized(w.harmonic, nv), geodesic = sized(w.geodesic, nv);
  auto weights = sized(w.switch_weights, nv), acceleration = sized(w.acceleration, nv);
  const auto blend = [&] { acceleration = weights.cwiseProduct(harmonic - geodesic) + geodesic; };
  std::visit(Overloaded{
                 [&](const Unswitched&) {
                   weights.setOnes();
                   acceleration = harmonic + geodesic;
                 },
                 [&](const HarmonicOnly&) {
                   weights.setOnes();
                   acceleration = harmonic;
                 },
                 [&](const GeodesicOnly&) {
                   weights.setZero();
                   acceleration = geodesic;
                 },
                 [&](const BinarySwitch& s) {
                   weights.setConstant(w.values.sum() <= s.threshold ? 1.0 : 0.0);
                   blend();
                 },
                 [&](const SigmoidSwitch& s) {
                   weights.setConstant(1.0 - sigmoid(s.slope * (w.values.sum() - s.threshold)));
                   blend();
                 },
                 [&](const DistanceSwitch& s) {
                   w.distances_.setConstant(std::numeric_limits<double>::infinity());
                   for (const auto& embedding : embeddings_) {
                     embedding->lower_distances(w.distances_, w.state_, obstacles);
                   }
                   for (Eigen::Index i = 0; i < w.distances_.size(); ++i) {
                     weights[i] = sigmoid(s.slope * (w.distances_[i] - s.thresholds[i]));
                   }
                   blend();
                 },
             },
             settings_.combination);
}

StepStatus GeometricSystem::fall_back(StepStatus status, ConstVectorRef v, Workspace& w) const noexcept {
  for (Eigen::Index i = 0; i < v.size(); ++i) {
    const double limit = robot_.limits().acceleration[i];
    w.acceleration[i] = std::isfinite(v[i]) ? std::clamp(-settings_.fallback_rate * v[i], -limit, limit) : 0.0;
  }
  w.status_ = status;
  return status;
}

}  // namespace sidestep

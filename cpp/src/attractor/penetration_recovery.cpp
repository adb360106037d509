#include "sidestep/attractor/penetration_recovery.hpp"

#include <algorithm>
#include <cmath>

#include "../math/settings.hpp"

namespace sidestep {
namespace {

// Square ε of the gradient below which a clearance is pushed less than it asks for [(m/rad)²]: joints change it by less than
// 5 cm/rad.
constexpr double least_gradient_squared = 0.05 * 0.05;

double smoothstep(double x) noexcept {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

}  // namespace

void PenetrationRecovery::validate() const {
  require_positive(speed, "recovery: speed");
  require(rate >= 0.0 && std::isfinite(rate), "recovery: rate", rate, "finite and not negative");
  require_positive(margin, "recovery: margin");
  require(rebound >= 0.0 && std::isfinite(rebound), "recovery: rebound", rebound, "finite and not negative");
}

PenetrationRecoveryWorkspace::PenetrationRecoveryWorkspace(int nv, int m)
    : metric_(nv, m),
      one_sided_(nv, m),
      jacobian_transposed_(Eigen::MatrixXd::Zero(nv, m)),
      fades_(Eigen::VectorXd::Ones(m)),
      curvatures_(Eigen::VectorXd::Zero(m)) {}

int PenetrationRecoveryWorkspace::update(const PenetrationRecovery& settings, const Eigen::VectorXd& floors,
                                         const Clearances& clearances, const Eigen::MatrixXd& jacobian_transposed,
                                         Eigen::VectorXd& push) noexcept {
  push.setZero();
  fades_.setOnes();
  int deepest = -1;
  double depth = 0.0, total = 0.0;
  for (Eigen::Index k = 0; k < floors.size(); ++k) {
    const double below = floors[k] - clearances.values[k];
    if (!(below > 0.0)) {
      continue;
    }
    if (below > depth) {
      depth = below;
      deepest = static_cast<int>(k);
    }
    const double weight = smoothstep(below / settings.margin);
    const auto gradient = clearances.gradients.col(k);
    const double wanted = settings.rate * std::max(settings.speed - clearances.rates[k], 0.0);
    push += weight * wanted / (gradient.squaredNorm() + least_gradient_squared) * gradient;
    total += weight;
    const double length = weight * jacobian_transposed.col(k).norm();
    if (length > 1.0 - weight) {
      fades_[k] = (1.0 - weight) / length;
    }
  }
  if (deepest >= 0) {
    push /= std::max(total, 1.0);
    jacobian_transposed_ = jacobian_transposed * fades_.asDiagonal();
    one_sided_.solve_in_place(jacobian_transposed_, push);
  }
  return deepest;
}

void PenetrationRecoveryWorkspace::solve_pullback(const PenetrationRecovery& settings, const Clearances& clearances,
                                                  const Eigen::MatrixXd& jacobian_transposed, const Eigen::VectorXd& curvatures,
                                                  GraphMetric& metric, Eigen::VectorXd& result) noexcept {
  bool scaled = false;
  for (Eigen::Index k = 0; k < curvatures.size(); ++k) {
    double scale = fades_[k], curvature = curvatures[k];
    if (std::isfinite(clearances.values[k]) && clearances.rates[k] > 0.0) {
      const auto gradient = clearances.gradients.col(k);
      const double squared = gradient.squaredNorm();
      // ψ' of J = ψ' ∇h.
      const double slope = squared > 0.0 ? jacobian_transposed.col(k).dot(gradient) / squared : 0.0;
      const double psi_rate = std::abs(slope) * clearances.rates[k];
      if (psi_rate * scale > settings.rebound) {
        const double kept = settings.rebound / psi_rate;
        const double linear = slope * clearances.curvatures[k];
        curvature = linear + kept * kept * (curvature - linear);
        scale = kept;
      }
    }
    scaled = scaled || scale < 1.0;
    curvatures_[k] = scale * curvature;
    fades_[k] = scale;
  }
  if (scaled) {
    jacobian_transposed_.noalias() = jacobian_transposed * fades_.asDiagonal();
    metric_.update(jacobian_transposed_);
    metric_.solve_pullback(curvatures_, result);
  } else {
    metric.solve_pullback(curvatures, result);
  }
}

}  // namespace sidestep

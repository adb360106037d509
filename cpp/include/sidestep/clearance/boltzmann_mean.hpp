#pragma once

#include <cmath>
#include <limits>

#include "sidestep/clearance/clearance_sample.hpp"

namespace sidestep {

/// Reduces clearances h_n to one by the Boltzmann mean with temperature T, and carries its derivatives:
///
///     h = Σ_n w_n h_n / Σ_n w_n,    w_n = exp(−h_n / T).
///
/// It is smooth, does not depend on how densely a surface is sampled (unlike a soft minimum, which is low by up to
/// T log N), and exceeds the smallest clearance by about T at most where many are about equally small. Samples may come
/// in any order: the sums are kept relative to the smallest clearance so far.
class BoltzmannMean {
 public:
  /// What a mean is made of, relative to a reference: sums of w and w (h − reference) with their time derivatives.
  struct Sums {
    double s0 = 0.0, s0_dot = 0.0, s0_ddot = 0.0, s1 = 0.0, s1_dot = 0.0, s1_ddot = 0.0;

    /// The mean, less the reference, and without its gradient.
    ClearanceSample mean() const noexcept {
      const double share = 1.0 / s0, above = s1 * share, rate = (s1_dot - above * s0_dot) * share;
      return {above, rate, (s1_ddot - 2.0 * rate * s0_dot - above * s0_ddot) * share, {}};
    }
  };

  explicit BoltzmannMean(double temperature) noexcept : inverse_T_(1.0 / temperature) {}

  /// Height above the smallest sample, in temperatures, from which samples are dropped: their weight is below
  /// exp(−30) = 1e-13, which is rounding.
  static constexpr double window = 30.0;
  /// Whether a sample of this value changes the mean.
  bool matters(double value) const noexcept { return value < reference_ + window / inverse_T_; }
  bool empty() const noexcept { return !(reference_ < std::numeric_limits<double>::infinity()); }

  /// Returns whether the sample is the smallest so far.
  bool add(const ClearanceSample& sample) noexcept;

  /// The smallest sample; +inf when empty.
  double least() const noexcept { return reference_; }
  /// The mean of what was added; not to be called when empty.
  ClearanceSample result() const noexcept;

 private:
  double inverse_T_;
  double reference_ = std::numeric_limits<double>::infinity();
  Sums sums_;
  WrenchPair g0_, g1_;  // Gradients of s0 and s1.
};

/// The temperature [m] itself. Throws std::invalid_argument, which `owner` begins, unless it is positive and finite.
double checked_temperature(double temperature, const char* owner);

}  // namespace sidestep

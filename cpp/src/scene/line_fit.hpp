#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

namespace sidestep {

/// Sets that a velocity is found from, at most: the newest and five before it.
inline constexpr int most_sets = 6;

/// The straight line x(t) = a + v·t nearest to positions at up to `most_sets` times, by least squares.
///
///     v = Σ (t − t̄)(x − x̄) / Σ (t − t̄)²
template <int Dim>
struct LineFit {
  using Vector = Eigen::Matrix<double, Dim, 1>;
  using Positions = Eigen::Matrix<double, Dim, most_sets>;

  Vector velocity = Vector::Zero();  ///< [m/s]
  double scatter = 0.0;              ///< Standard deviation of the positions about the line, per axis of three [m].
  double spread = 0.0;               ///< Root of Σ (t − t̄)² [s].
  Vector mean = Vector::Zero();      ///< x̄ [m]
  double middle = 0.0;               ///< t̄ [s]

  /// Of the first `num` >= 2 positions [m] and times [s], not all equal.
  LineFit(const Positions& positions, const std::array<double, most_sets>& times, int num) {
    for (int k = 0; k < num; ++k) {
      middle += times[static_cast<std::size_t>(k)] / num;
    }
    mean = positions.leftCols(num).rowwise().mean();
    double squares = 0.0;
    for (int k = 0; k < num; ++k) {
      const double t = times[static_cast<std::size_t>(k)] - middle;
      squares += t * t;
      velocity += t * (positions.col(k) - mean);
    }
    velocity /= squares;
    spread = std::sqrt(squares);
    double off = 0.0;
    for (int k = 0; k < num; ++k) {
      off += (positions.col(k) - mean - (times[static_cast<std::size_t>(k)] - middle) * velocity).squaredNorm();
    }
    scatter = num > 2 ? std::sqrt(off / (3.0 * (num - 2))) : 0.0;
  }

  /// Its position [m] at a time [s].
  Vector at(double time) const { return mean + (time - middle) * velocity; }

  /// Standard deviation of the velocity per axis [m/s], where positions have that `noise` [m] or more.
  double deviation(double noise) const noexcept { return std::max(scatter, noise) / spread; }
};

/// Whether a line through `num` >= 3 positions is a motion rather than scatter: F test with 3 and 3·(num − 2) degrees of freedom
/// against their own scatter, of 0.5 %, or 2.5 % for what is `likely` to move, and χ² test of 0.1 % against `noise` [m], known beforehand.
template <int Dim>
bool is_motion(const LineFit<Dim>& line, int num, double noise, bool likely) noexcept {
  constexpr std::array<double, 4> strict{47.5, 12.9, 8.72, 7.23}, easy{15.4, 6.60, 5.08, 4.47};
  constexpr double surely = 16.3;
  const auto k = static_cast<std::size_t>(std::clamp(num, 3, most_sets) - 3);
  const double signal = line.velocity.squaredNorm() * line.spread * line.spread;
  return signal > 3.0 * (likely ? easy : strict)[k] * line.scatter * line.scatter && signal > surely * noise * noise;
}

}  // namespace sidestep

#pragma once

#include <Eigen/Core>
#include <array>

#include "sidestep/clearance/ellipsoid_pairs.hpp"
#include "sidestep/robot/kinematic_state.hpp"

namespace sidestep {

/// The gap between two ellipsoids and how it changes.
///
/// With centres d apart and half-widths s(n) = √(nᵀ S n) the gap is
///
///     h = max over |n| = 1 of φ(n),      φ(n) = n·d − s_a(n) − s_b(n):
///
/// the distance of ellipsoids that are apart. Of those that overlap it is less than zero: minus the depth, or where d
/// is much shorter than the semi-axes, that of a maximum near the line of centres. φ of any n is a lower bound of h.
///
/// Seen from a, whose half-widths rest, h' and h'' are those of φ with n held, plus what n gains by following the
/// maximum,
///
///     h' = φ',   h'' = φ'' + gᵀ (−∂²φ)⁻¹ g,   g = (∂φ)' across n.
struct EllipsoidGap {
  double value, rate, curvature;  ///< Gap h [m], h', and h'' at q̈ = 0.
  Eigen::Vector3d normal;         ///< Unit normal n, from a to b.
  Eigen::Vector3d contact;        ///< Point of b nearest to a [m]: if b moves by v there, the gap grows by n·v.
};

/// Gaps between ellipsoids of two links that are asked together, by Newton's method on the sphere from the line of
/// centres, in 16 steps at most.
class EllipsoidGaps {
 public:
  /// Of ellipsoids at rest that are given in one frame.
  EllipsoidGaps() noexcept = default;
  /// Where the frame of b is in that of a, in which gaps are, and how it moves there: spatial velocity at the origin of
  /// a, and its time derivative at q̈ = 0.
  EllipsoidGaps(const Eigen::Matrix3d& R_AB, const Eigen::Vector3d& p_AB, const SpatialMotion& velocity,
                const SpatialMotion& bias) noexcept;

  bool full() const noexcept { return pairs_.size == EllipsoidPairs::capacity; }
  int size() const noexcept { return pairs_.size; }
  void clear() noexcept { pairs_.size = 0; }

  /// Of a and b, each in its frame: centres (3) [m], and S (3 × 3), positive definite [m²]. Not to be called when full.
  void add(const Eigen::Vector3d& centre_a, const Eigen::Matrix3d& S_a, const Eigen::Vector3d& centre_b,
           const Eigen::Matrix3d& S_b) noexcept;
  /// To be called before gaps are read.
  void solve() noexcept;

  EllipsoidGap operator[](int k) const noexcept;

 private:
  EllipsoidPairs pairs_;
};

/// Ellipsoids of one link that gaps to an ellipsoid of another are bounded of, from below: φ of the line of centres.
class EllipsoidRow {
 public:
  static constexpr int capacity = EllipsoidColumns::capacity;

  bool full() const noexcept { return columns_.size == capacity; }
  int size() const noexcept { return columns_.size; }

  /// As in EllipsoidGaps. Not to be called when full.
  void add(const Eigen::Vector3d& centre, const Eigen::Matrix3d& S) noexcept;

  /// Writes a bound [m] for each to b, which has its centre at `centre_b` (3) here, and S in its own frame.
  void bound(const Eigen::Matrix3d& R_AB, const Eigen::Vector3d& centre_b, const Eigen::Matrix3d& S_b,
             std::array<double, capacity>& bounds) const noexcept;

 private:
  EllipsoidColumns columns_;
};

/// The gap of one pair at rest, with centres d apart.
EllipsoidGap ellipsoid_gap(const Eigen::Vector3d& d, const Eigen::Matrix3d& S_a, const Eigen::Matrix3d& S_b) noexcept;

}  // namespace sidestep

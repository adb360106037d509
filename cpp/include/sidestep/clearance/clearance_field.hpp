#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "sidestep/body/body.hpp"
#include "sidestep/body/body_ellipsoid.hpp"
#include "sidestep/clearance/clearance_group.hpp"
#include "sidestep/robot/kinematic_state.hpp"
#include "sidestep/scene/obstacles.hpp"

namespace sidestep {

/// Clearance between the calibrated ellipsoids of a body and obstacle points, one per Gaussian.
///
/// An ellipsoid is {y : (y − μ)ᵀ S⁻¹ (y − μ) ≤ 1}. With e = y − μ the clearance of a point outside is its distance,
/// found with w = (S + t I)⁻¹ e, where t > 0 is the root of wᵀ S w = 1,
///
///     h(y) = t |w| − r,      ∂h = n = w / |w|,
///
/// less the point's radius r. Inside it is the first-order distance h = (m − √m) / |u| − r with u = S⁻¹ e and m = e·u,
/// which has the same value and gradient on the surface, and one kink only, at the centre.
///
/// The points are reduced to one clearance by the Boltzmann mean (see boltzmann_mean.hpp), so that the result does not
/// depend on how densely a surface is sampled, of those within a window above the nearest; and to what approaches (see
/// stopping_clearance.hpp). What does not matter is left out in steps, by bounds from below: nodes of the tree over the
/// points by balls and boxes around them and by a ball around the ellipsoids of a link; leaves, for every ellipsoid, by
/// the plane that touches it where it is nearest to the middle of a leaf, beyond which all of the leaf's box is h ≥ n·y
/// − √(nᵀ S n); and points by the same plane of their own, with a direction and so a rate that is known as well as n
/// is. All this is done in single precision, many side by side. What is left is summed in double precision, with the
/// widest registers of the machine.
class ClearanceField final : public ClearanceGroup {
 public:
  /// Points that are farther than the nearest by `window` temperatures do not count: each would weigh less than
  /// e^−window and change the mean by window e^−window T at most, 2e-7 m at 12 and 2 mm, far below what a sensor sees.
  /// Derivatives do not know of points that come into the window; second differences see them up to about 24, where the
  /// change is 2e-12 m.
  static constexpr double default_window = 12.0;
  /// Window of the mean of what approaches, in temperatures. Its weights are not differentiated, so that points down to
  /// e⁻⁸ = 3e-4 suffice.
  static constexpr double window_ahead = 8.0;

  /// Throws std::invalid_argument if the body is not calibrated, has an unknown link or nothing that moves, the
  /// temperature [m] is not positive and finite, or the window not within 1 to 600.
  ClearanceField(const Robot& robot, const Body& body, double temperature = 0.002, double window = default_window);

  int size() const noexcept override { return static_cast<int>(ellipsoids_.size()); }
  CoordinateLabel label(int k) const override;

  /// Writes the clearances below `reach` [m] at a state into `out`, which the caller has cleared, and what approaches:
  /// of points whose distance left after a stop is below that of the horizon, wherever they are. No allocation.
  void evaluate(const KinematicState& state, const Obstacles& obstacles, double reach, const Horizon& horizon,
                ClearanceView out) const noexcept override;

  /// Whether a ball inside an ellipsoid, as large as its shortest semi-axis allows, reaches deeper than `depth` [m]
  /// into that of a point. No allocation.
  bool touches(const KinematicState& state, const Obstacles& obstacles, double depth) const noexcept override;
  bool is_seen() const noexcept override { return true; }

  /// Which component of the body ellipsoid k came from.
  int component(int k) const noexcept { return ellipsoids_[static_cast<std::size_t>(k)].body.component; }

 private:
  class Search;
  struct Ellipsoid {
    BodyEllipsoid body;
    Eigen::Matrix3d axes_T;     // Rotation into the principal axes.
    Eigen::Vector3d semi_axes;  // Semi-axes along them [m].
  };
  /// Consecutive ellipsoids of one link, with a ball around them in the frame of its child.
  struct Cluster {
    static constexpr int most = 16;  // Most ellipsoids of a cluster.

    int first, size;
    Eigen::Vector3d centre;
    double radius;
    double inner_radius;                       // Radius of a ball around the balls inside them [m].
    Eigen::Matrix<float, most, 16> principal;  // Numbers of every ellipsoid, as inner loops read them.
  };

  double temperature_, window_;
  std::vector<std::string> links_;     // Link of each component of the body.
  std::vector<Ellipsoid> ellipsoids_;  // Ellipsoids; those of one joint stand together.
  std::vector<Cluster> clusters_;
};

}  // namespace sidestep

#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>

#include "sidestep/scene/obstacles.hpp"

namespace sidestep {

/// Whether a sensor would show something at a place [m]; empty: everywhere.
using Sight = std::function<bool(const Eigen::Vector3d& place)>;

/// Velocities of obstacles that nobody told, found from one set of obstacles to the next.
///
/// Three kinds of points:
///   - **told**: a group (points of one name) with a velocity that is not zero keeps its velocities. Uncertainty 0.
///   - **shapes**: a group that the last set has under the same name with as many points, which went no farther than the largest speed
///     allows or kept their arrangement. A rigid motion between the sets gives each point its velocity, from the second set on.
///   - **clouds**: all other points. Where something rested for long is remembered, and points there rest. What is left falls into
///     clusters, and each is registered against up to five earlier sets: a trimmed nearest-neighbour translation. A line through
///     the displacements is the velocity if an F test says that it is no noise; else the cluster rests. From the third set on.
///
/// Where sets are 0.05 to 0.25 s apart, a third one comes late. If the sensor's sight is told, two are enough for a cluster that only the
/// last set has, too: it moves if it has 8 points or more, went farther than 3 cm and 6 standard deviations, and the last set would have
/// shown most of it where it is now. Such a velocity has `sets` = 2, and an uncertainty of half of it or more.
///
/// Where the sensor's noise is told, clusters of more than three points and a mean noise above `noisy` are compared by their middles from
/// the third set on: noise hides which point is the nearest, and a middle is known to noise/sqrt(number of points) as far as the same part
/// is seen. A middle moves, too, where something else than the end of the sight covers or uncovers a part.
///
/// Something whose displacement exceeds the largest speed was put elsewhere: it is new. The same points again say nothing new for up to
/// one and a half spacings of the sets; after that they rest.
///
/// Something that is connected with what rests, as nearer to it than 3 to 6 cm, is taken out of it as far as earlier sets do not have
/// its points; the others count as resting until both are apart or the rest is known for 0.2 s.
///
/// What moves out of a sensor's sight, or into it, is cut where the sight ends, and the middle of what is left moves by another velocity.
/// With the sight of each set, such clusters are compared by what both sets could show.
///
/// Clouds should have a point every 3 cm or nearer. A plane that slides along itself cannot be seen to move. May allocate: belongs in the
/// thread that sets obstacles, not into a step.
class VelocityEstimate {
 public:
  static constexpr double noisy = 0.015;  ///< Noise above which clusters are compared by their middles [m].

  struct Settings {
    double largest_speed = 2.0;  ///< of anything that is not told [m/s], > 0

    /// Throws std::invalid_argument that names the setting, its value and what is allowed.
    void validate() const;
  };

  struct Result {
    Eigen::Matrix3Xd velocities;  ///< (3 × N) [m/s]; exactly zero where nothing was found to move
    Eigen::VectorXd uncertainty;  ///< (N) how far the true velocity can be from it [m/s], 0 to `largest_speed`
    Eigen::VectorXi sets;         ///< (N) number of sets that it was seen in, 1: new, at most 6; 0: told
  };

  /// Throws std::invalid_argument if a setting is not allowed.
  explicit VelocityEstimate(const Settings& settings);
  VelocityEstimate() : VelocityEstimate(Settings()) {}
  ~VelocityEstimate();
  VelocityEstimate(VelocityEstimate&&) noexcept;
  VelocityEstimate& operator=(VelocityEstimate&&) noexcept;

  /// Compares a set, captured at `time` [s], with those before it. A time that is not later than the last one's forgets them first.
  /// sight: of the sensor at that time; kept while the set is compared. noise: (N) standard deviation of each point [m], as the sensor
  /// has it; empty: not known. Throws std::invalid_argument if the time is not finite, or noise neither empty nor N finite values >= 0.
  Result update(const Obstacles& now, double time, Sight sight = {}, const Eigen::VectorXd& noise = {});

  /// Forgets all, and takes a first look: points of which most rest, and which later sets leave out. Only the next set is compared with
  /// it: lines through later ones would bend, since they lack points of it. Names and velocities do not count. Throws as `update`.
  void begin(const Obstacles& first, double time, Sight sight = {});

  /// The next set is the first.
  void forget();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sidestep

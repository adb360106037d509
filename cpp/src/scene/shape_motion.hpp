#pragma once

#include <Eigen/Core>
#include <array>

#include "line_fit.hpp"

namespace sidestep {

/// Velocities of the points of one shape that is told again and again in the same order, by the rigid motion from set to set.
///
/// The place of the shape is x = (c, ρ θ): centroid, and radius of gyration times angles turned. A line through its last places gives
/// its velocity: the longest one that places differ from by no more than their noise. A bend, b = x₁ − the line from x₀ to x₂ at t₁, is
/// the same from set to set where the shape accelerates, and differs by the noise.
class ShapeMotion {
 public:
  ShapeMotion(Eigen::Matrix3Xd points, double time);

  /// How the newest set was taken.
  enum class Kind { same, other, elsewhere };

  /// The shape is at `points` [m] at `time` [s], later than the last. `other`: these are not the same points. `elsewhere`: it was put
  /// there, and is new.
  Kind update(const Eigen::Matrix3Xd& points, double time, double largest_speed);

  int sets() const noexcept { return num_; }
  Eigen::Matrix3Xd velocities() const;  ///< (3 × N) [m/s]
  /// (N) [m/s]: error of the velocity, its last change, and what is no rigid motion.
  Eigen::VectorXd uncertainty() const;

 private:
  using Place = Eigen::Matrix<double, 6, 1>;

  void restart(const Eigen::Matrix3Xd& points, double time);
  void remember(const Place& place, double time);
  void find_velocity();
  void learn_noise();
  Place bend(int k) const;  // of three places, the newest of them is k [m]

  Eigen::Matrix3Xd points_;
  Eigen::VectorXd residual_;                                      // of each point from the rigid motion, per time [m/s]
  LineFit<6>::Positions places_ = LineFit<6>::Positions::Zero();  // the newest first
  std::array<double, most_sets> times_{};                         // [s]
  int num_ = 1;
  double gyration_ = 0.0;           // [m]
  Place velocity_ = Place::Zero();  // [m/s]
  double error_ = 0.0;              // [m/s]
  double noise_ = 0.0;              // of a place per axis [m]
};

}  // namespace sidestep

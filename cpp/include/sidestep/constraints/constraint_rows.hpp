#pragma once

#include <Eigen/Core>
#include <vector>

#include "sidestep/constraints/acceleration_bounds.hpp"
#include "sidestep/constraints/priority.hpp"
#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// Rows of one constraint: lower <= normal·q̈ <= upper with unit normals. A row that gives way has one side only.
/// Memory is taken at construction.
struct RowBlock {
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  RowBlock(int capacity, int num_coordinates, Priority how_it_gives_way);

  void clear() noexcept;
  /// Appends gradient·q̈ >= bound (or <= bound); gradient (nv) [m/rad, or any unit per rad], bound [that unit /s²]. depth [m]:
  /// violation of the constraint, if positive. If no joint changes the gradient and zero does not meet the bound, sets
  /// `unreachable`. Appends nothing beyond the capacity.
  void at_least(ConstVectorRef gradient, double bound, double depth = 0.0) noexcept;
  void at_most(ConstVectorRef gradient, double bound, double depth = 0.0) noexcept;

  int capacity() const noexcept { return static_cast<int>(normals.rows()); }
  bool is_at_most(int k) const noexcept;
  /// Whether every acceleration in the box satisfies row k.
  bool satisfied_within(int k, const Eigen::VectorXd& box_lower, const Eigen::VectorXd& box_upper) const noexcept;
  /// The bound of row k if it reads normal·q̈ >= bound; that of the row times -1 if it reads <=.
  double required(int k) const noexcept;
  /// Shortfall of an acceleration from `required` [/s²]; negative if it exceeds it.
  double missing(int k, const Eigen::VectorXd& acceleration) const noexcept;
  /// The same in the unit of the gradient, and 0 where it is rounding. `scale`: size of the accelerations that cancel [/s²].
  double shortfall(int k, const Eigen::VectorXd& acceleration, double scale) const noexcept;
  /// Multiplier >= 0 of row k from the signed one of a quadratic program.
  double pressure(int k, double multiplier) const noexcept;

  Priority priority;
  int size = 0;
  bool unreachable = false;      ///< Whether a bound cannot be met, since no joint changes what it bounds.
  Matrix normals;                ///< Unit normals (capacity, nv).
  Eigen::VectorXd lower, upper;  ///< Bounds (capacity) [/s²].
  Eigen::VectorXd lengths;       ///< Lengths |gradient| (capacity).
  Eigen::VectorXd depths;        ///< Violation before this period (capacity) [m], else 0.
  Eigen::VectorXd multipliers;   ///< Cost of each row to the task in the last solution (capacity), >= 0.

 private:
  bool append(ConstVectorRef gradient, double depth) noexcept;
};

/// An interval of accelerations per joint.
struct Box {
  explicit Box(int num_coordinates)
      : lower(Eigen::VectorXd::Zero(num_coordinates)), upper(Eigen::VectorXd::Zero(num_coordinates)) {}
  Eigen::VectorXd lower, upper;  ///< Bounds (nv) [/s²].
};

/// Interval of the torque less the bias, M q̈, and the limit that sets each end.
struct TorqueWindow {
  explicit TorqueWindow(int num_coordinates);

  /// Clamps a further interval of joint i into this one, so that a torque is always left.
  void narrow(Eigen::Index i, double least, double most, Limit least_limit, Limit most_limit) noexcept;

  Eigen::VectorXd lower, upper;  ///< Bounds (nv) [Nm | N].
  std::vector<Limit> lower_limit, upper_limit;
};

/// Bounds of all joints: each constraint in turn reads and narrows them.
struct Bounds {
  explicit Bounds(int num_coordinates)
      : box(num_coordinates), firm_jerk(num_coordinates), wide(num_coordinates), torque(num_coordinates) {}

  AccelerationBounds box;  ///< Joint limits: with jerk (smooth), without it, and of position alone.
  Box firm_jerk;  ///< Bounds that the jerk limits leave if torques keep a rate, even after jerk gave way; infinite otherwise.
  Box wide;       ///< Bounds after a priority gave way, see Constraint::widen.
  TorqueWindow torque;
};

}  // namespace sidestep

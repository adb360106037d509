#pragma once

#include <vector>

#include "sidestep/constraints/constraint_rows.hpp"
#include "sidestep/math/quadratic_program.hpp"

namespace sidestep {

struct MotionSolution;

/// Consecutive rows or variables of a quadratic program.
struct Span {
  int begin = 0, size = 0;
  int operator[](int k) const noexcept { return begin + k; }
};

/// Hands out the rows or variables of a quadratic program, one span after the other.
class SpanCounter {
 public:
  Span take(int size) noexcept { return {(count_ += size) - size, size}; }
  int count() const noexcept { return count_; }

 private:
  int count_ = 0;
};

/// One span per block of this priority, an empty one for the others.
std::vector<Span> spans_of(const std::vector<RowBlock>& blocks, Priority priority, SpanCounter& counter);
/// Most rows of this priority.
int capacity_of(const std::vector<RowBlock>& blocks, Priority priority) noexcept;

/// Writes the rows of a block that the box does not satisfy; the others get no bounds. slack: index of the variable that may
/// violate them; -1: none.
void write_rows(const RowBlock& block, Span at, const Eigen::VectorXd& box_lower, const Eigen::VectorXd& box_upper, int slack,
                QuadraticProgramData& data) noexcept;
/// Writes the bounds of M q̈.
void write_torque(const Eigen::MatrixXd& mass, const TorqueWindow& window, Span at, QuadraticProgramData& data) noexcept;
/// Reads the multipliers of a block's rows.
void read_multipliers(const QuadraticProgram& program, Span at, RowBlock& block) noexcept;

/// Multipliers of one joint at the upper and lower end of its interval, and of its torque.
struct JointMultipliers {
  double at_upper, at_lower, at_torque;
};
/// Adds the limits in the way of joint i to solution.active; smooth: those of an interval with the jerk limit.
void add_active(const Bounds& bounds, bool smooth, int i, const JointMultipliers& multipliers,
                MotionSolution& solution) noexcept;

}  // namespace sidestep

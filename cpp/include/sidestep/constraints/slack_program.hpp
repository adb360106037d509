#pragma once

#include "sidestep/constraints/hard_program.hpp"
#include "sidestep/constraints/short_rows.hpp"

namespace sidestep {

/// Program in which comfort gives way: over q̈, one slack per joint, and one slack for all rows of comfort, within a wide box. The
/// price of slack is far above that of the task. Clearance rows are lowered by the shortfalls granted.
class SlackProgram {
 public:
  SlackProgram(int num_coordinates, const std::vector<RowBlock>& blocks, double slack_weight);

  /// `hard`: where cost and torque rows are taken from. Writes acceleration and active limits, and the multipliers of the blocks.
  bool solve(const QuadraticProgramData& hard, const TrackingCost& cost, const Bounds& bounds, const ShortRows& short_rows,
             bool rounded, std::vector<RowBlock>& blocks, MotionSolution& solution) noexcept;

 private:
  void write(const QuadraticProgramData& hard, const TrackingCost& cost, const Bounds& bounds) noexcept;
  void read(const Bounds& bounds, const ShortRows& short_rows, std::vector<RowBlock>& blocks,
            MotionSolution& solution) noexcept;

  double slack_weight_;
  SpanCounter variables_, counter_;
  Span acceleration_, slacks_, shared_slack_;
  Span upper_, lower_, torque_, short_;
  std::vector<Span> comfort_, never_;  // Rows of each block, by priority.
  QuadraticProgramData data_;
  QuadraticProgram program_;
};

}  // namespace sidestep

#pragma once

#include "sidestep/constraints/hard_program.hpp"
#include "sidestep/constraints/short_rows.hpp"

namespace sidestep {

/// Programs of the least shortfalls r of clearance rows: min Σ w r² with w = |∇h|²/(|∇h|² + ε²), first for rows that are not
/// violated yet, then for those that are, with w times their depth over the largest.
///
/// Opposing rows share the shortfall, and an arm that cannot get out comes to rest. If the torque cannot reach the box, the box is
/// first widened in the least-squares sense. So there always is a solution.
class ShortfallProgram {
 public:
  ShortfallProgram(int num_coordinates, const std::vector<RowBlock>& blocks);

  /// Result of a search: `any` is false if rows that never give way contradict each other.
  struct Found {
    bool any = true;
    bool within_box = true;  ///< Whether the box sufficed; otherwise it was widened.
  };
  /// Writes the granted shortfalls, an acceleration within them, and the multipliers.
  Found solve(const TrackingCost& cost, Bounds& bounds, std::vector<RowBlock>& blocks, ShortRows& short_rows,
              MotionSolution& solution) noexcept;

 private:
  /// Over x = (q̈, r): the torque rows, normals q̈ + r >= required for up to `capacity` rows.
  struct Program {
    Program(int num_coordinates, int capacity, const std::vector<RowBlock>& blocks);
    SpanCounter counter;
    Span torque, short_rows;
    std::vector<Span> never;
    QuadraticProgramData data;
    QuadraticProgram program;
  };

  void write(Program& program, const TrackingCost& cost, const Bounds& bounds, const std::vector<RowBlock>& blocks,
             const ShortRows& short_rows, double deepest) noexcept;
  /// of_lost: of the rows that are violated already, while the others keep what they have.
  bool solve(Program& program, bool of_lost, const TrackingCost& cost, const Bounds& bounds, ShortRows& short_rows,
             MotionSolution& solution) noexcept;
  bool widen(const TrackingCost& cost, const std::vector<RowBlock>& blocks, Bounds& bounds, MotionSolution& solution) noexcept;

  int nv_;
  std::vector<Program> programs_;  // Programs by number of rows, so that the usual few stay cheap.
  SpanCounter counter_;            // Spans of the widening: over q̈ and its excess over the box.
  Span box_, torque_;
  std::vector<Span> never_;
  QuadraticProgramData widening_data_;
  QuadraticProgram widening_;
  Box everywhere_;  // Box without bounds.
};

}  // namespace sidestep

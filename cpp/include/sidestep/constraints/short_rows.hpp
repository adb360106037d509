#pragma once

#include "sidestep/constraints/program_rows.hpp"

namespace sidestep {

/// Rows of priority clearance that a box does not satisfy, and the shortfall granted to each.
class ShortRows {
 public:
  explicit ShortRows(const std::vector<RowBlock>& blocks);

  struct Row {
    RowBlock* block = nullptr;
    int k = 0;
    double allowed = 0.0;  ///< Shortfall granted [/s²], >= 0.

    bool lost() const noexcept { return block->depths[k] > 0.0; }
    /// Requirement of the row, less the shortfall granted. rounded: also if that is negligible.
    double lowered(bool rounded) const noexcept;
  };

  void collect(std::vector<RowBlock>& blocks, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) noexcept;
  void forbid_all() noexcept;

  int capacity() const noexcept { return static_cast<int>(rows_.size()); }
  int size() const noexcept { return size_; }
  Row& operator[](int n) noexcept { return rows_[static_cast<std::size_t>(n)]; }
  const Row& operator[](int n) const noexcept { return rows_[static_cast<std::size_t>(n)]; }

 private:
  std::vector<Row> rows_;
  int size_ = 0;
};

/// Writes row k of the block as row `at` of a program, with the bound `required`.
void write_required(const RowBlock& block, int k, int at, double required, QuadraticProgramData& data) noexcept;

/// Whether a row that is violated already bends the last solution. Then the least shortfalls are computed even if all rows could
/// be met: a demand that needs the last bit of an acceleration limit would otherwise come and go from step to step.
bool presses_for_lost(const std::vector<RowBlock>& blocks) noexcept;
/// Whether a row that is not violated yet falls short.
bool others_fall_short(const std::vector<RowBlock>& blocks, const Eigen::VectorXd& acceleration) noexcept;

}  // namespace sidestep

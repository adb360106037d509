#include "sidestep/constraints/short_rows.hpp"

#include <cmath>

#include "../math/settings.hpp"
#include "tolerances.hpp"

namespace sidestep {
namespace {

// Largest shortfall that is not granted, relative to 1 /s^2 plus what is asked for: it may be due to the regularisation alone.
// Shortfalls of recovery are granted all the same: to avoid them, joints of no leverage would be flung about.
constexpr double shortfall_tolerance = 1e-4;

}  // namespace

ShortRows::ShortRows(const std::vector<RowBlock>& blocks)
    : rows_(static_cast<std::size_t>(capacity_of(blocks, Priority::clearance))) {}

double ShortRows::Row::lowered(bool rounded) const noexcept {
  const double asked = block->required(k), size = 1.0 + std::abs(asked);
  const double counts = lost() ? 0.0 : shortfall_tolerance * size;
  return rounded ? asked - allowed - slack_tolerance * size : allowed > counts ? asked - allowed : asked;
}

void ShortRows::collect(std::vector<RowBlock>& blocks, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) noexcept {
  size_ = 0;
  for (RowBlock& block : blocks) {
    for (int k = 0; block.priority == Priority::clearance && k < block.size; ++k) {
      if (!block.satisfied_within(k, lower, upper)) {
        (*this)[size_++] = {&block, k, 0.0};
      }
    }
  }
}

void ShortRows::forbid_all() noexcept {
  for (int n = 0; n < size_; ++n) {
    (*this)[n].allowed = 0.0;
  }
}

void write_required(const RowBlock& block, int k, int at, double required, QuadraticProgramData& data) noexcept {
  const bool at_most = block.is_at_most(k);
  data.row_lower[at] = at_most ? -infinity : required;
  data.row_upper[at] = at_most ? -required : infinity;
}

bool presses_for_lost(const std::vector<RowBlock>& blocks) noexcept {
  for (const RowBlock& block : blocks) {
    for (int k = 0; block.priority == Priority::clearance && k < block.size; ++k) {
      if (block.depths[k] > 0.0 && block.multipliers[k] > 0.0) {
        return true;
      }
    }
  }
  return false;
}

bool others_fall_short(const std::vector<RowBlock>& blocks, const Eigen::VectorXd& acceleration) noexcept {
  for (const RowBlock& block : blocks) {
    for (int k = 0; block.priority == Priority::clearance && k < block.size; ++k) {
      if (block.depths[k] == 0.0 &&
          block.missing(k, acceleration) > shortfall_tolerance * (1.0 + std::abs(block.required(k)))) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace sidestep

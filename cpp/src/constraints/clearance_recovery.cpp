// How clearances give way to jerk limits, and to the recovery of a lost clearance.
#include <algorithm>

#include "sidestep/constraints/clearance_constraints.hpp"
#include "smooth_stop.hpp"
#include "tolerances.hpp"

namespace sidestep {
namespace {

// Depth of a clearance that is not lost [m], so that its recovery ranks with that of lost ones: after what others must keep.
constexpr double least_depth = 1e-6;
// Share of its margin that a clearance keeps if it opposes the way out of a lost one [-].
constexpr double of_margin = 0.2;

}  // namespace

bool ClearanceConstraints::relax_to_braking(double period, RowBlock& rows) noexcept {
  bool any = false;
  for (int row = 0; row < rows.size; ++row) {
    const Reserve& reserve = reserves_[static_cast<std::size_t>(row)];
    const double asked = rows.lower[row] * rows.lengths[row];
    // Between links, which no sensor sees, most of the margin is a reserve as well.
    const double distance_left = reserve.distance_left + (reserve.seen ? 0.0 : (1.0 - of_margin) * reserve.margin);
    const auto fits = [&](double x) {
      const double slowing = x + reserve.curvature;
      return distance_left > 0.0 ? smooth_stop_fits(distance_left, reserve.closing_speed, slowing,
                                                    std::max(reserve.hardest, 0.0), reserve.jerk, period)
                                 : std::max(reserve.closing_speed, reserve.closing_speed - slowing * period) <= creeping;
    };
    asked_[row] = rows.lower[row];
    if (along_path_[static_cast<std::size_t>(row)] != 0 || reserve.jerk <= 0.0 || !fits(asked)) {
      continue;
    }
    const double least = std::min(reserve.before - reserve.jerk * period, asked);
    rows.lower[row] = std::min(rows.lower[row], least_that_fits(least, asked, fits) / rows.lengths[row]);
    any = true;
  }
  return any;
}

void ClearanceConstraints::defer_recovery(double period, RowBlock& rows) noexcept {
  asked_.head(rows.size) = rows.lower.head(rows.size);
  int spare = rows.capacity() - rows.size;
  for (int row = 0; row < rows.size && spare > 0; ++row) {
    const Reserve& reserve = reserves_[static_cast<std::size_t>(row)];
    if (along_path_[static_cast<std::size_t>(row)] != 0 || rows.depths[row] > 0.0 || reserve.seen ||
        reserve.distance_left > 0.0 || !opposes_lost(rows, row)) {
      continue;
    }
    const double distance_left = reserve.distance_left + (1.0 - of_margin) * reserve.margin;
    const double needed =
        demanded_deceleration(distance_left, reserve.closing_speed, reserve.limits, period) - reserve.curvature;
    if (needed / rows.lengths[row] < rows.lower[row]) {
      rows.lower[row] = needed / rows.lengths[row];
      --spare;
    }
  }
  add_recovery(rows);
}

bool ClearanceConstraints::opposes_lost(const RowBlock& rows, int row) const noexcept {
  for (int lost = 0; lost < rows.size; ++lost) {
    if (rows.depths[lost] > 0.0 && rows.normals.row(row).dot(rows.normals.row(lost)) < 0.0) {
      return true;
    }
  }
  return false;
}

void ClearanceConstraints::restore(RowBlock& rows) noexcept { rows.lower.head(rows.size) = asked_.head(rows.size); }

bool ClearanceConstraints::add_recovery(RowBlock& rows) noexcept {
  bool any = false;
  for (int row = 0, asked = rows.size; row < asked; ++row) {
    const auto at = static_cast<std::size_t>(row);
    if (reserves_[at].distance_left > 0.0 || rows.lower[row] >= asked_[row]) {
      continue;
    }
    any = true;
    if (rows.depths[row] > 0.0) {
      rows.lower[row] = asked_[row];
    } else if (rows.size < rows.capacity()) {
      const auto added = static_cast<std::size_t>(rows.size);
      rows.normals.row(rows.size) = rows.normals.row(row);
      rows.lower[rows.size] = asked_[row];
      rows.lengths[rows.size] = rows.lengths[row];
      rows.depths[rows.size] = least_depth;
      coordinates_[added] = coordinates_[at];
      nearest_[added] = nearest_[at];
      along_path_[added] = 0;
      ++rows.size;
    }
  }
  return any;
}

}  // namespace sidestep

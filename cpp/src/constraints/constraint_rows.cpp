#include "sidestep/constraints/constraint_rows.hpp"

#include <algorithm>
#include <cmath>

#include "../math/settings.hpp"
#include "largest_product.hpp"
#include "sidestep/constraints/constraint.hpp"
#include "tolerances.hpp"

namespace sidestep {

RowBlock::RowBlock(int capacity, int num_coordinates, Priority how_it_gives_way)
    : priority(how_it_gives_way),
      normals(Matrix::Zero(capacity, num_coordinates)),
      lower(Eigen::VectorXd::Constant(capacity, -infinity)),
      upper(Eigen::VectorXd::Constant(capacity, infinity)),
      lengths(Eigen::VectorXd::Zero(capacity)),
      depths(lengths),
      multipliers(lengths) {}

void RowBlock::clear() noexcept {
  size = 0;
  unreachable = false;
  multipliers.setZero();
}

bool RowBlock::append(ConstVectorRef gradient, double depth) noexcept {
  const double length = gradient.norm();
  if (size == capacity() || !(length > shortest_gradient)) {
    return false;
  }
  normals.row(size) = gradient.transpose() / length;
  lower[size] = -infinity;
  upper[size] = infinity;
  lengths[size] = length;
  depths[size] = depth;
  multipliers[size] = 0.0;
  ++size;
  return true;
}

void RowBlock::at_least(ConstVectorRef gradient, double bound, double depth) noexcept {
  if (append(gradient, depth)) {
    lower[size - 1] = bound / lengths[size - 1];
  } else if (size < capacity()) {
    unreachable = unreachable || bound > 0.0;
  }
}

void RowBlock::at_most(ConstVectorRef gradient, double bound, double depth) noexcept {
  if (append(gradient, depth)) {
    upper[size - 1] = bound / lengths[size - 1];
  } else if (size < capacity()) {
    unreachable = unreachable || bound < 0.0;
  }
}

bool RowBlock::is_at_most(int k) const noexcept { return lower[k] == -infinity; }

bool RowBlock::satisfied_within(int k, const Eigen::VectorXd& box_lower, const Eigen::VectorXd& box_upper) const noexcept {
  return (lower[k] == -infinity || -largest_product(-normals.row(k).transpose(), box_lower, box_upper) >= lower[k]) &&
         (upper[k] == infinity || largest_product(normals.row(k).transpose(), box_lower, box_upper) <= upper[k]);
}

double RowBlock::required(int k) const noexcept { return is_at_most(k) ? -upper[k] : lower[k]; }

double RowBlock::missing(int k, const Eigen::VectorXd& acceleration) const noexcept {
  const double along = normals.row(k).dot(acceleration.transpose());
  return is_at_most(k) ? along - upper[k] : lower[k] - along;
}

double RowBlock::shortfall(int k, const Eigen::VectorXd& acceleration, double scale) const noexcept {
  const double amount = missing(k, acceleration);
  return amount <= slack_tolerance * (1.0 + std::abs(required(k)) + scale) ? 0.0 : lengths[k] * amount;
}

double RowBlock::pressure(int k, double multiplier) const noexcept {
  return is_at_most(k) ? std::max(multiplier, 0.0) : upper[k] == infinity ? std::max(-multiplier, 0.0) : std::abs(multiplier);
}

TorqueWindow::TorqueWindow(int num_coordinates)
    : lower(Eigen::VectorXd::Constant(num_coordinates, -infinity)),
      upper(Eigen::VectorXd::Constant(num_coordinates, infinity)),
      lower_limit(static_cast<std::size_t>(num_coordinates), Limit::none),
      upper_limit(lower_limit) {}

void TorqueWindow::narrow(Eigen::Index i, double least, double most, Limit least_limit, Limit most_limit) noexcept {
  const double low = lower[i], high = upper[i];
  lower[i] = std::clamp(least, low, high);
  upper[i] = std::clamp(most, lower[i], high);
  const auto at = static_cast<std::size_t>(i);
  lower_limit[at] = lower[i] > low ? least_limit : lower_limit[at];
  upper_limit[at] = upper[i] < high ? most_limit : upper_limit[at];
}

void Constraint::report(const Moment&, const Bounds&, const RowBlock& rows, const Eigen::VectorXd& wanted,
                        MotionSolution& solution) const noexcept {
  for (int k = 0; k < rows.size; ++k) {
    if (rows.priority == Priority::comfort && rows.shortfall(k, solution.acceleration, wanted.norm()) > 0.0) {
      solution.status = std::max(solution.status, ProgramStatus::relaxed);
    }
  }
}

}  // namespace sidestep

#include "checked_places.hpp"

#include <algorithm>
#include <cmath>

#include "../math/settings.hpp"

namespace sidestep {
namespace {

constexpr double exact_within = 0.03;    // Distance below which a check is exact [m]; above, a lower bound will do.
constexpr double farthest = 1.0;         // Largest distance left that a check tells [m]: no stop is as long.
constexpr double farthest_moving = 0.1;  // The same where something moves [m]: it stays as far for as long as a stop takes.
constexpr double usable_share = 0.75;    // Share of its distance left up to which a place serves.

}  // namespace

CheckedPlaces::CheckedPlaces(const ClearanceQuery& body, double spacing)
    : body_(body),
      spacing_(spacing),
      places_(Eigen::MatrixXd::Zero(body.robot().num_coordinates(), capacity)),
      distance_left_(Eigen::VectorXd::Zero(capacity)) {}

double CheckedPlaces::check(ConstVectorRef q, int at, const Obstacles& obstacles, const Eigen::VectorXd& floors,
                            ClearanceQuery::Workspace& workspace) noexcept {
  const double far = obstacles.tree().moves() ? farthest_moving : farthest;
  const double distance_left = body_.distance_left(q, obstacles, floors, exact_within, far, workspace);
  if (distance_left >= 0.0) {
    places_.col(at) = q;
  }
  distance_left_[at] = distance_left;
  stale_[static_cast<std::size_t>(at)] = false;
  return distance_left;
}

double CheckedPlaces::distance_left_by(int at, const Eigen::VectorXd& q) const noexcept {
  const Eigen::VectorXd& reach = body_.reach();
  const double there = distance_left_[at] < 0.0 ? 0.0 : std::max(distance_left_[at], spacing_);
  const double least = (1.0 - usable_share) * there;
  double rest = there;
  for (Eigen::Index j = 0; j < q.size() && rest > least; ++j) {
    rest -= reach[j] * std::abs(q[j] - places_(j, at));
  }
  return rest > least ? rest : -infinity;
}

double CheckedPlaces::distance_left_at(const Eigen::VectorXd& q, const Obstacles& obstacles, const Eigen::VectorXd& floors,
                                       ClearanceQuery::Workspace& workspace) noexcept {
  const int num = std::min(num_, capacity);
  for (int n = 0; n < num; ++n) {
    const int at = last_ + n < num ? last_ + n : last_ + n - num;
    double distance_left = distance_left_by(at, q);
    if (distance_left > 0.0 && stale_[static_cast<std::size_t>(at)] && rechecks_left_ > 0) {
      --rechecks_left_;
      check(places_.col(at), at, obstacles, floors, workspace);
      distance_left = distance_left_by(at, q);
    }
    if (distance_left > 0.0) {
      last_ = at;
      return distance_left;
    }
  }
  const int at = num_ % capacity;
  const double distance_left = check(q, at, obstacles, floors, workspace);
  if (distance_left >= 0.0) {
    num_ = num_ + 1 < 2 * capacity ? num_ + 1 : capacity;
    last_ = at;
  }
  return distance_left;
}

}  // namespace sidestep

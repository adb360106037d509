#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "sidestep/clearance/clearances.hpp"

namespace sidestep {

constexpr double lifted_clearance = 0.005;  // clearance from which on what rested is lifted [m]

/// Clearances of an object that rests on obstacles, which it may keep until it is lifted.
class RestingClearances {
 public:
  /// From `clearance` [m] on the whole ellipsoid of a coordinate is free.
  struct One {
    Eigen::Index coordinate;
    double clearance;
  };
  void add(One one) { all_.push_back(one); }
  const std::vector<One>& all() const noexcept { return all_; }
  /// Whether all of them are free at the reference and, where it is elsewhere, at the arm (null: it is not).
  bool is_lifted(const Clearances& at_reference, const Clearances* at_arm) const noexcept {
    return std::all_of(all_.begin(), all_.end(), [&](const One& one) {
      return at_reference.least[one.coordinate] >= one.clearance &&
             (at_arm == nullptr || at_arm->least[one.coordinate] >= one.clearance);
    });
  }

 private:
  std::vector<One> all_;
};

}  // namespace sidestep

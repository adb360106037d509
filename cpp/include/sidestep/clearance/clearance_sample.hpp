#pragma once

#include "sidestep/clearance/clearances.hpp"
#include "sidestep/robot/kinematic_state.hpp"

namespace sidestep {

/// Wrenches about the world origin on up to two links, as the gradient of a clearance.
struct WrenchPair {
  SpatialForce first, second;

  void add(double factor, const WrenchPair& other) noexcept {
    first.angular += factor * other.first.angular;
    first.linear += factor * other.first.linear;
    second.angular += factor * other.second.angular;
    second.linear += factor * other.second.linear;
  }
  void scale(double factor) noexcept {
    first.angular *= factor, first.linear *= factor;
    second.angular *= factor, second.linear *= factor;
  }
};

/// A clearance with its first and second time derivative and its gradient.
struct ClearanceSample {
  double value, rate, curvature;
  WrenchPair gradient;
};

/// Writes a sample as entry k, its wrenches on the links of two joints; -1: on none, or the world.
void write(const ClearanceSample& sample, const KinematicState& state, int first_joint, int second_joint, Eigen::Index k,
           ClearanceStateView& out) noexcept;

/// The same of a sample, and of what approaches, with wrenches on the link of one joint.
void write(const ClearanceSample& sample, const ClearanceSample& approach, const KinematicState& state, int joint,
           Eigen::Index k, ClearanceView& out) noexcept;

}  // namespace sidestep

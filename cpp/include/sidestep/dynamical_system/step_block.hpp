#pragma once

#include <array>
#include <memory>
#include <vector>

#include "sidestep/dynamical_system/geometric_system.hpp"
#include "sidestep/kinematics/kinematic_block.hpp"

namespace sidestep {

/// Steps of a system at `block_states` states side by side, each towards a configuration at rest of its own.
///
/// What GeometricSystem::acceleration computes, within rounding, in a fraction of the time: where one state leaves a register
/// half empty and waits for what one number after another needs, eight states fill it. Whatever is out of the ordinary
/// about a state, anything but StepStatus::ok, GeometricSystem itself decides.
///
/// For many states or motions at once; no quicker for one. Not for every system, see `takes`.
class StepBlock {
 public:
  /// Whether blocks can be taken of the system: it has a single embedding coordinate that takes blocks, pulls by the metric,
  /// and neither a distance switch nor a speed regulator.
  static bool takes(const GeometricSystem& system) noexcept;

  /// For a system that `takes` is true of; it must outlive this.
  explicit StepBlock(const GeometricSystem& system);

  std::vector<BlockRow> q, v, goal;                ///< (nv) the states and where they go: to be set
  std::vector<BlockRow> acceleration;              ///< (nv) [rad/s²]
  BlockRow value, switch_weight;                   ///< ψ and s; NaN where the step fell back
  std::array<StepStatus, block_states> statuses{};

  const GeometricSystem& system() const noexcept { return system_; }

  /// One step at each state. No allocation.
  void update(const Obstacles& obstacles) noexcept;

  /// Column `state` of rows, or of a matrix with a row for each of them.
  template <class Vector>
  static void set(std::vector<BlockRow>& rows, int state, const Vector& x) noexcept {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      rows[i].of[state] = x[static_cast<Eigen::Index>(i)];
    }
  }
  template <class Vector>
  static void get(const std::vector<BlockRow>& rows, int state, Vector&& x) noexcept {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      x[static_cast<Eigen::Index>(i)] = rows[i].of[state];
    }
  }

 private:
  void take_alone(int state, const Obstacles& obstacles) noexcept;

  const GeometricSystem& system_;
  Gain stiffness_, damping_;
  KinematicBlock kinematics_;
  EmbeddingBlock embedding_;
  std::vector<BlockRow> harmonic_;
  GeometricSystem::Workspace alone_;
  Eigen::VectorXd q_, v_, goal_;  // of a state alone
};

}  // namespace sidestep

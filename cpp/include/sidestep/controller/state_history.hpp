#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sidestep/math/vectors.hpp"

namespace sidestep {

/// Where an arm was at the times of its last steps: for images that were captured a while ago.
///
/// One thread writes and waits for nobody; any number of threads read. Keeps the last `capacity` steps.
class StateHistory {
 public:
  static constexpr std::size_t capacity = 4096;  ///< Number of states: 4 s at 1 kHz.

  explicit StateHistory(int num_coordinates);

  /// Adds the positions q (nv) at a time [s]. No allocation. A time that is not later than the last one forgets what was before.
  void put(double time, ConstVectorRef q) noexcept;

  /// Writes the positions at a time [s] to q (nv), linear between two states. After the last state they are those of it, before the first
  /// kept one there are none: false, and q is as it was.
  bool at(double time, Eigen::Ref<Eigen::VectorXd> q) const noexcept;

  /// Time of the last state [s]; NaN before the first.
  double last_time() const noexcept;

 private:
  /// A state with the number of its last change: odd while it is being written.
  struct Slot {
    std::atomic<std::uint64_t> version{0};
    std::atomic<double> time{0.0};
  };
  bool read(std::uint64_t number, double& time, Eigen::Ref<Eigen::VectorXd> q) const noexcept;
  bool read_time(std::uint64_t number, double& time) const noexcept;

  std::size_t nv_;
  std::vector<Slot> slots_;
  std::vector<std::atomic<double>> positions_;    // of all slots, nv each
  std::atomic<std::uint64_t> first_{0}, end_{0};  // Numbers of the first state that counts, and of the one after the last.
};

}  // namespace sidestep

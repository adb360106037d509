#pragma once

#include <cstddef>

namespace sidestep::test {

/// Number of heap allocations made by this thread since the program started, by malloc and its relatives or by
/// operator new (Eigen calls malloc, so operator new alone would see nothing). Works with and without sanitizers.
std::size_t num_allocations() noexcept;

/// Number of heap allocations that `action` makes.
template <typename Action>
std::size_t allocations_of(Action&& action) {
  const std::size_t before = num_allocations();
  action();
  return num_allocations() - before;
}

}  // namespace sidestep::test

#pragma once

#include <limits>
#include <vector>

#include "sidestep/math/fields.hpp"

namespace sidestep {

/// How a Loop runs, and when it ends. Units and meaning of each number: `fields<LoopSettings>()`.
struct LoopSettings {
  double duration = std::numeric_limits<double>::infinity();
  bool until_arrived = false;
  double hold = 0.2;
  int priority = 60;
  bool lock_memory = true;
  double start_timeout = 5.0, state_timeout = 0.1, longest_gap = 0.1, silent_timeout = 10.0, stop_timeout = 3.0;
  bool start_in_contact = false;
  int kept_times = 60'000;

  /// Throws std::invalid_argument that names the setting, its value and what is allowed.
  void validate() const;
};

template <> const std::vector<Field<LoopSettings>>& fields();

}  // namespace sidestep

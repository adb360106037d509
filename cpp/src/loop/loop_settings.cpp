#include "sidestep/loop/loop_settings.hpp"

#include <limits>

namespace sidestep {

template <>
const std::vector<Field<LoopSettings>>& fields() {
  using S = LoopSettings;
  constexpr double inf = std::numeric_limits<double>::infinity();
  static const std::vector<Field<S>> all{
      {"duration", &S::duration, "s", 0.0, inf, "longest time of a run, counted in cycles; then the arm is brought to rest"},
      {"until_arrived", &S::until_arrived, "-", 0, 1, "the run ends when the arm has been at its goal for `hold`"},
      {"hold", &S::hold, "s", 0.0, 60.0, "time for which the arm must be at its goal before the run ends"},
      {"priority", &S::priority, "-", 0, 99,
       "priority of the loop's thread among real-time threads (SCHED_FIFO), where the machine permits it; 0: none. Higher is later less often, and lets other threads wait"},
      {"lock_memory", &S::lock_memory, "-", 0, 1,
       "keeps the program's memory from being swapped out, where the machine permits it"},
      {"start_timeout", &S::start_timeout, "s", 0.0, 600.0, "longest wait for the robot's first state and the first obstacles"},
      {"state_timeout", &S::state_timeout, "s", 0.001, 10.0,
       "time without a new state after which it counts as lost: the arm is braked without it, and the run ends. Longer bridges more lost messages, and brakes later"},
      {"longest_gap", &S::longest_gap, "s", 0.001, 10.0,
       "longest delay of the loop itself, and largest jump of the states' clock; beyond it the run ends. Longer bears a busier machine, and leaves the robot alone for longer"},
      {"silent_timeout", &S::silent_timeout, "s", 0.0, inf,
       "time for which the arm waits at rest for a source of obstacles that has fallen silent; then the run ends"},
      {"stop_timeout", &S::stop_timeout, "s", 0.0, 60.0, "longest time for coming to rest at the end of a run"},
      {"start_in_contact", &S::start_in_contact, "-", 0, 1,
       "begins also where the covering body of the arm overlaps something: the arm leads itself out"},
      {"kept_times", &S::kept_times, "-", 1, 100'000'000, "number of the last cycles whose times are kept; 16 bytes each"},
  };
  return all;
}

void LoopSettings::validate() const { check_fields("loop: ", *this); }

}  // namespace sidestep

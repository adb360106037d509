#pragma once

#include <exception>
#include <functional>

namespace sidestep {

/// Predicate that long work calls now and then, in the thread that began it: true if its result is no longer wanted.
using Interrupted = std::function<bool()>;
inline bool never_interrupted() { return false; }

/// Thrown by work that was interrupted and has no result.
struct Interruption : std::exception {
  const char* what() const noexcept override { return "interrupted"; }
};

}  // namespace sidestep

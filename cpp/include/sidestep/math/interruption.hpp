#pragma once

#include <exception>
#include <functional>

namespace sidestep {

/// Asked now and then by work that takes long, in the thread that began it, whether what is worked on is no longer
/// wanted.
using Interrupted = std::function<bool()>;
inline bool never_interrupted() { return false; }

/// Thrown by work that was interrupted and has no result.
struct Interruption : std::exception {
  const char* what() const noexcept override { return "interrupted"; }
};

}  // namespace sidestep

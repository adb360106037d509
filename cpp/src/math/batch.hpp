#pragma once

#include <Eigen/Core>
#include <functional>

#include "sidestep/math/interruption.hpp"

namespace sidestep {

/// How many rows of so many bytes each of as many motions may have, so that their records have 8 GiB together.
Eigen::Index most_rows(double bytes_per_row, Eigen::Index motions) noexcept;

/// Calls work(k, halted) for each k from 0 to num − 1 once, on `threads` threads (0: one per processor), where halted()
/// says whether to end at once: at an error, or an interruption, which the calling thread asks for. Throws the first
/// error, std::invalid_argument if threads is not from 0 to 1024, and Interruption if interrupted.
void share(Eigen::Index num, int threads, const Interrupted& interrupted,
           const std::function<void(Eigen::Index k, const Interrupted& halted)>& work);

}  // namespace sidestep

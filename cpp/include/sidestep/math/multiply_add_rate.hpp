#pragma once

namespace sidestep {

/// Peak rate of floating-point operations of one core [1/s]: multiply-adds of doubles in the widest registers of the
/// instruction set in use, the best of many short runs within `duration` [s]. For benchmarks. Throws std::invalid_argument
/// unless the duration is positive and finite.
double multiply_add_rate(double duration);

}  // namespace sidestep

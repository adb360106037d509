#pragma once

namespace sidestep {

/// Floating-point operations a second [1/s] of one core that does nothing but multiply and add doubles in the widest
/// registers of the instruction set in use: the most of many short runs within `duration` [s]. For benchmarks. Throws
/// std::invalid_argument unless the duration is positive and finite.
double multiply_add_rate(double duration);

}  // namespace sidestep

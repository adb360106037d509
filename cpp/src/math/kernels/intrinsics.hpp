#pragma once

// The intrinsics of the instruction set that the including file is compiled for, where it has any.
#if defined(__SSE2__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

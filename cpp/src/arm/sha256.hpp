#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>

namespace sidestep {

using Sha256 = std::array<std::byte, 32>;

/// The SHA-256 of some bytes (FIPS 180-4).
Sha256 sha256(std::span<const std::byte> bytes);

/// Its 64 hexadecimal digits.
std::string hexadecimal(const Sha256& hash);

}  // namespace sidestep

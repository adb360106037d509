#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "sidestep/math/binary.hpp"

namespace sidestep::recording {

using binary::Bytes;
using binary::Decoder;
using binary::Encoder;
using binary::little_endian;

/// What a byte makes of the checksum with 0 to 7 bytes between it and the end.
constexpr std::array<std::array<std::uint32_t, 256>, 8> crc_tables = [] {
  std::array<std::array<std::uint32_t, 256>, 8> tables{};
  for (std::uint32_t n = 0; n < 256; ++n) {
    std::uint32_t c = n;
    for (int k = 0; k < 8; ++k) {
      c = (c & 1u) != 0u ? 0xedb88320u ^ (c >> 1) : c >> 1;
    }
    tables[0][n] = c;
  }
  for (std::size_t t = 1; t < 8; ++t) {
    for (std::size_t n = 0; n < 256; ++n) {
      tables[t][n] = tables[0][tables[t - 1][n] & 0xffu] ^ (tables[t - 1][n] >> 8);
    }
  }
  return tables;
}();

/// CRC-32 of zlib and ISO 3309.
inline std::uint32_t crc32(std::span<const std::byte> bytes) noexcept {
  std::uint32_t c = 0xffffffffu;
  const auto at = [&](std::size_t k) { return static_cast<std::uint32_t>(bytes[k]); };
  std::size_t k = 0;
  for (; k + 8 <= bytes.size(); k += 8) {  // eight bytes at once
    c ^= at(k) | at(k + 1) << 8 | at(k + 2) << 16 | at(k + 3) << 24;
    c = crc_tables[7][c & 0xffu] ^ crc_tables[6][(c >> 8) & 0xffu] ^ crc_tables[5][(c >> 16) & 0xffu] ^ crc_tables[4][c >> 24] ^
        crc_tables[3][at(k + 4)] ^ crc_tables[2][at(k + 5)] ^ crc_tables[1][at(k + 6)] ^ crc_tables[0][at(k + 7)];
  }
  for (; k < bytes.size(); ++k) {
    c = crc_tables[0][(c ^ at(k)) & 0xffu] ^ (c >> 8);
  }
  return c ^ 0xffffffffu;
}

}  // namespace sidestep::recording

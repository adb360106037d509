#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sidestep/arm/arm.hpp"

namespace sidestep {

/// What an arm is made of, as the file has it.
struct ArmParts {
  const Robot& robot;
  const Body& body;
  const std::vector<LinkPair>& pairs;
  const std::vector<PairDistanceTable>& tables;
  const std::vector<Inertial>& inertials;
  const ArmDetails& details;
};

/// The sections of everything but the provenance: what the content hash is taken of.
std::vector<std::byte> encode_content(const ArmParts& parts);

/// A whole file: header, content, provenance.
std::vector<std::byte> encode_arm(const ArmParts& parts);

/// Reads a whole file. Throws std::invalid_argument that says what is wrong and what to do.
Arm decode_arm(std::span<const std::byte> file);

}  // namespace sidestep

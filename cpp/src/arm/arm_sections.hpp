#pragma once

#include "arm_bytes.hpp"
#include "arm_file.hpp"

namespace sidestep {

/// Appends the sections of everything but the provenance.
void write_content(ArmWriter& out, const ArmParts& arm);
/// Appends the last section.
void write_provenance(ArmWriter& out, const Provenance& from);
/// Reads all sections, of a file of this format version. Throws std::invalid_argument that says what is wrong.
Arm read_sections(ArmReader& in, std::uint32_t of_version);

}  // namespace sidestep

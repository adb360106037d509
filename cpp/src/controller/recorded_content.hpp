#pragma once

#include <cstdint>

#include "recording_content.hpp"
#include "request.hpp"

namespace sidestep {

/// What was set, as a recording keeps it.
recording::RequestRecord to_record(std::uint64_t number, const Request& request);

}  // namespace sidestep

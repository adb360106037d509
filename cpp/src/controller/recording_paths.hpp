#pragma once

#include <string>

namespace sidestep {

/// A name with what file systems do not like in it replaced.
std::string file_stem(const std::string& name);
/// Date and time in UTC down to milliseconds, for example "20261127-223706-123": names in the order of time.
std::string date_and_time();

}  // namespace sidestep

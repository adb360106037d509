#pragma once

#include <filesystem>
#include <string>

#include "sidestep/link/address.hpp"

namespace sidestep::link {

/// A secret of 32 hexadecimal digits.
std::string random_token();
/// Whether both are equal, in a time that does not tell where they differ. An empty token is never right.
bool is_token(const std::string& token, const std::string& given) noexcept;
/// Where a server at this address leaves its token: ARM.token beside ARM.sock; for a port in `socket_folder`.
std::filesystem::path default_token_file(const Address& address);
/// Writes a token into a file of this user alone (0600). Throws std::system_error where it cannot be written.
void write_token(const std::filesystem::path& file, const std::string& token);
/// The token in a file. Throws std::system_error where it cannot be read, std::runtime_error where others may read it.
std::string read_token(const std::filesystem::path& file);

}  // namespace sidestep::link

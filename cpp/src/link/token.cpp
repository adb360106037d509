#include "sidestep/link/token.hpp"

#include <cstdio>
#include <fstream>
#include <random>
#include <stdexcept>
#include <system_error>

#include "posix.hpp"
#include "sidestep/link/descriptor.hpp"

namespace sidestep::link {

std::string random_token() {
  std::random_device device;
  std::string token;
  for (int k = 0; k < 4; ++k) {
    char digits[9];
    std::snprintf(digits, sizeof digits, "%08x", static_cast<unsigned>(device()));
    token += digits;
  }
  return token;
}

bool is_token(const std::string& token, const std::string& given) noexcept {
  if (token.empty() || given.size() != token.size()) {
    return false;
  }
  unsigned different = 0;
  for (std::size_t k = 0; k < token.size(); ++k) {
    different |= static_cast<unsigned char>(token[k]) ^ static_cast<unsigned char>(given[k]);
  }
  return different == 0;
}

std::filesystem::path default_token_file(const Address& address) {
  if (address.is_port()) {
    return socket_folder() / ("tcp-" + address.host + "-" + std::to_string(address.port) + ".token");
  }
  std::filesystem::path file = address.path;
  return file.replace_extension(".token");
}

#ifdef SIDESTEP_POSIX

void write_token(const std::filesystem::path& file, const std::string& token) {
  ::unlink(file.c_str());  // never into a file that somebody else has opened or linked
  const Descriptor opened(::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600));
  const std::string line = token + "\n";
  if (!opened || ::write(opened.number(), line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
    throw std::system_error(errno, std::generic_category(), "the token cannot be written to " + file.string());
  }
}

std::string read_token(const std::filesystem::path& file) {
  struct stat found{};
  if (::stat(file.c_str(), &found) != 0) {
    throw std::system_error(errno, std::generic_category(), "there is no token in " + file.string());
  }
  if ((found.st_mode & 077) != 0) {
    throw std::runtime_error("the token in " + file.string() + " can be read by others: chmod 600 it, or serve again");
  }
  std::ifstream stream(file);
  std::string token;
  if (!(stream >> token)) {
    throw std::runtime_error("there is no token in " + file.string());
  }
  return token;
}

#else

void write_token(const std::filesystem::path&, const std::string&) { throw std::runtime_error(no_sockets); }
std::string read_token(const std::filesystem::path&) { throw std::runtime_error(no_sockets); }

#endif

}  // namespace sidestep::link

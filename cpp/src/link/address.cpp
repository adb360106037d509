#include "sidestep/link/address.hpp"

#include <charconv>
#include <cstdlib>
#include <stdexcept>
#include <string_view>

#include "posix.hpp"

namespace sidestep::link {
namespace {

[[noreturn]] void raise_address(const std::string& text, const std::string& why) {
  throw std::invalid_argument("address '" + text + "': " + why +
                              "; allowed are a name such as arm, unix:/PATH, tcp:PORT and tcp:127.0.0.1:PORT");
}

std::uint16_t read_port(const std::string& text, std::string_view digits) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
  if (digits.empty() || error != std::errc() || end != digits.data() + digits.size()) {
    raise_address(text, "'" + std::string(digits) + "' is no port, which is a number from 0 to 65535");
  }
  return port;
}

/// Whether a host is one of the loopback's, as 127.0.0.1.
bool is_loopback(const std::string& host) {
  int numbers = 0, value = -1;
  for (const char c : host + ".") {
    if (c == '.') {
      if (value < 0 || value > 255 || (numbers == 0 && value != 127)) {
        return false;
      }
      ++numbers;
      value = -1;
    } else if (c >= '0' && c <= '9' && value < 256) {
      value = 10 * (value < 0 ? 0 : value) + (c - '0');
    } else {
      return false;
    }
  }
  return numbers == 4;
}

}  // namespace

Address::Address(const std::string& text) {
  constexpr std::string_view unix_kind = "unix:", tcp_kind = "tcp:";
  if (text.starts_with(tcp_kind)) {
    const std::string_view rest = std::string_view(text).substr(tcp_kind.size());
    const std::size_t colon = rest.rfind(':');
    host = colon == std::string_view::npos ? "127.0.0.1" : std::string(rest.substr(0, colon));
    if (host == "localhost") {
      host = "127.0.0.1";
    }
    if (!is_loopback(host)) {
      raise_address(text, "'" + host + "' is no address of this machine's loopback; other machines are reached by Zenoh");
    }
    port = read_port(text, colon == std::string_view::npos ? rest : rest.substr(colon + 1));
    return;
  }
  if (text.starts_with(unix_kind)) {
    path = text.substr(unix_kind.size());
  } else if (text.find('/') != std::string::npos) {
    path = text;
  } else {
    if (text.empty() || text.find_first_of(": \t\n\\") != std::string::npos || text.starts_with('.')) {
      raise_address(text, "this is no name");
    }
    path = socket_folder() / (text + ".sock");
  }
  if (path.empty()) {
    raise_address(text, "the path is missing");
  }
  if (path.native().size() > longest_socket_path) {
    raise_address(text, "the path of a socket has at most " + std::to_string(longest_socket_path) + " bytes, and '" +
                            path.string() + "' has " + std::to_string(path.native().size()));
  }
}

std::string Address::text() const { return is_port() ? "tcp:" + host + ":" + std::to_string(port) : "unix:" + path.string(); }

std::filesystem::path socket_folder() {
#ifdef SIDESTEP_POSIX
  const char* const runtime = std::getenv("XDG_RUNTIME_DIR");
  const std::filesystem::path folder = runtime != nullptr && *runtime == '/' ? std::filesystem::path(runtime) / "sidestep"
                                                                             : std::filesystem::temp_directory_path() /
                                                                                   ("sidestep-" + std::to_string(::getuid()));
  if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) {
    throw std::system_error(errno, std::generic_category(), "the folder of sockets, " + folder.string() + ", cannot be made");
  }
  struct stat found{};
  if (::lstat(folder.c_str(), &found) != 0 || !S_ISDIR(found.st_mode) || found.st_uid != ::getuid() ||
      (found.st_mode & 077) != 0) {
    throw std::runtime_error("the folder of sockets, " + folder.string() +
                             ", must be a folder of this user that nobody else may enter (mode 0700)");
  }
  return folder;
#else
  throw std::runtime_error(no_sockets);
#endif
}

}  // namespace sidestep::link

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace sidestep::link {

/// Where a program listens: a Unix domain socket, or a port of this machine's loopback. Nothing else: other machines come by Zenoh.
struct Address {
  std::filesystem::path path;  ///< of the socket; empty: a port
  std::string host;            ///< "127.0.0.1" or another one in 127.0.0.0/8
  std::uint16_t port = 0;      ///< 0, for a listener: one that is free

  /// "unix:/run/arm.sock" or a path with a slash; "tcp:5555" or "tcp:127.0.0.1:5555"; else a name, "arm", whose socket is in
  /// `socket_folder`. Throws std::invalid_argument that names the address and what is allowed.
  explicit Address(const std::string& text);

  bool is_port() const noexcept { return path.empty(); }
  /// As text that the constructor takes.
  std::string text() const;
};

/// Folder that only this user may enter (0700), for sockets and tokens: sidestep in $XDG_RUNTIME_DIR, or sidestep-UID in the folder
/// for temporary files. It is made where it is missing. Throws std::runtime_error where it belongs to somebody else or others may
/// enter it, and where the system has no such sockets.
std::filesystem::path socket_folder();

}  // namespace sidestep::link

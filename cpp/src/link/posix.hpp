#pragma once

#include <cstddef>

#if defined(__unix__) || defined(__APPLE__)
#define SIDESTEP_POSIX
#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#endif

namespace sidestep::link {

/// Words of the error on a system without POSIX sockets.
inline constexpr const char* no_sockets = "links between programs need POSIX sockets (Linux, macOS), which this system lacks";

#ifdef SIDESTEP_POSIX
/// Longest path of a Unix domain socket, without the byte that ends it.
inline constexpr std::size_t longest_socket_path = sizeof(sockaddr_un::sun_path) - 1;
#else
inline constexpr std::size_t longest_socket_path = 107;
#endif

}  // namespace sidestep::link

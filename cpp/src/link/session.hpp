#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <utility>

#include "sidestep/link/report_messages.hpp"
#include "sidestep/link/server.hpp"
#include "sidestep/link/socket.hpp"

namespace sidestep::link {

/// One client as the server's thread holds it.
struct Session {
  static constexpr std::size_t longest_before_token = 65536;  ///< payload of a client that has not shown the token [B]
  static constexpr std::size_t most_replies = 4
                                              << 20;  ///< that may wait to be sent [B]; a client that takes no more is given up
  static constexpr std::size_t most_cycles = 256 << 10;  ///< beyond this many waiting bytes cycles are left out

  Session(Descriptor socket, std::uint32_t number, double now) : connection(std::move(socket)), began(now) {
    connection.accept_at_most(longest_before_token);
    info.number = number;
  }

  /// Queues a message, its words shortened to what one may hold. A client that takes none is given up.
  template <Message M>
  void tell(M message, std::uint64_t sequence) {
    if constexpr (requires { message.words; }) {
      message.words = shortened(std::move(message.words));
    }
    bytes_.bytes.clear();
    encode(bytes_, message, sequence);
    if (!connection.queue(bytes_.bytes, most_replies)) {
      connection.close();
    }
  }

  Connection connection;
  ClientInfo info;
  double began;                                              ///< [s]
  bool said_hello = false, ends = false;                     ///< ends: once all is sent
  double due = std::numeric_limits<double>::infinity();      ///< when the next cycle is to be sent [s]
  double spacing = std::numeric_limits<double>::infinity();  ///< between two cycles [s]; inf: none are sent
  bool asks_explanation = false;
  std::uint64_t explain_sequence = 0;
  double asked = 0.0;  ///< when it asked [s]

 private:
  binary::Bytes bytes_;
};

}  // namespace sidestep::link

#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sidestep/link/address.hpp"
#include "sidestep/link/descriptor.hpp"
#include "sidestep/link/message.hpp"

namespace sidestep::link {

/// How an attempt to receive a message ended.
enum class Received {
  message,  ///< there is one
  nothing,  ///< none came within the timeout
  refused,  ///< the peer sent what the protocol forbids, see `trouble`; nothing more can be read
  closed,   ///< the connection has ended, see `trouble`
};

/// A connection that carries whole messages both ways, for one thread. It never blocks longer than it is told.
class Connection {
 public:
  /// Connects. Throws std::system_error that names the address where nobody listens.
  explicit Connection(const Address& address);
  /// Of a descriptor that is connected, as Listener::accept gives.
  explicit Connection(Descriptor socket);

  /// The next message, waiting for at most `timeout` [s]; 0: what there is. `raw` is valid until the next call. Allocates only where a
  /// message is longer than all before it.
  Received receive(RawMessage& raw, double timeout) noexcept;
  /// Writes all bytes, waiting for the peer to take them for at most `timeout` [s]. False: it did not, or has gone; then the
  /// connection is closed, because half a message may be on its way.
  bool send(std::span<const std::byte> bytes, double timeout) noexcept;
  /// Encodes and sends a message, with the next sequence number; see `send` and `encode`.
  template <Message M>
  bool send(const M& message, double timeout = default_timeout) {
    return send_as(message, ++sequence_, timeout);
  }
  /// The same with the sequence number of the request that it answers.
  template <Message M>
  bool send_as(const M& message, std::uint64_t sequence, double timeout = default_timeout) {
    out_.bytes.clear();
    encode(out_, message, sequence);
    return send(out_.bytes, timeout);
  }

  /// From now on longer payloads [B] break the protocol, whatever their type allows.
  void accept_at_most(std::size_t payload) noexcept { longest_ = payload; }

  // For a thread that serves several connections: nothing waits.
  /// Adds bytes to what is to be sent. False, and nothing is added: that would be more than `most` bytes.
  bool queue(std::span<const std::byte> bytes, std::size_t most);
  /// Sends what the peer takes of it. False: the connection has ended.
  bool flush() noexcept;
  std::size_t queued() const noexcept { return pending_.size() - sent_; }

  bool is_open() const noexcept { return static_cast<bool>(socket_); }
  int descriptor() const noexcept { return socket_.number(); }
  std::uint64_t sequence() const noexcept { return sequence_; }  ///< of the last message sent
  /// Why the last `receive` or `send` failed; empty: it did not.
  const std::string& trouble() const noexcept { return trouble_; }
  void close() noexcept { socket_.close(); }

  static constexpr double default_timeout = 1.0;  ///< [s]

 private:
  bool next(RawMessage& raw);
  Received fill() noexcept;
  std::ptrdiff_t write_some(std::span<const std::byte> bytes) noexcept;
  void fail(const char* what, int error) noexcept;

  Descriptor socket_;
  std::vector<std::byte> in_;
  std::size_t begin_ = 0, end_ = 0;  // Bytes of in_ that are not yet read.
  binary::Bytes out_;
  std::vector<std::byte> pending_;
  std::size_t sent_ = 0;  // Bytes of pending_ that are sent.
  std::uint64_t sequence_ = 0;
  std::size_t longest_ = static_cast<std::size_t>(-1);
  std::string trouble_;
};

/// Takes connections at an address.
class Listener {
 public:
  /// Throws std::system_error that names the address where it is taken. A socket file that nobody listens at is replaced.
  explicit Listener(const Address& address);
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  ~Listener();

  /// The next connection, waiting for at most `timeout` [s]; empty: none came.
  Descriptor accept(double timeout) noexcept;
  /// With the port that was free.
  const Address& address() const noexcept { return address_; }
  int descriptor() const noexcept { return socket_.number(); }

 private:
  Address address_;
  Descriptor socket_;
};

}  // namespace sidestep::link

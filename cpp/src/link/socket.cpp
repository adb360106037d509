#include "sidestep/link/socket.hpp"

#include <cstring>
#include <stdexcept>
#include <system_error>

#include "polling.hpp"
#include "posix.hpp"

namespace sidestep::link {

#ifdef SIDESTEP_POSIX

namespace {

/// An address as the system has it.
struct SystemAddress {
  sockaddr_storage storage{};
  socklen_t size = 0;

  explicit SystemAddress(const Address& address) {
    if (address.is_port()) {
      sockaddr_in in{};
      in.sin_family = AF_INET;
      in.sin_port = htons(address.port);
      ::inet_pton(AF_INET, address.host.c_str(), &in.sin_addr);
      std::memcpy(&storage, &in, size = sizeof in);
    } else {
      sockaddr_un un{};
      un.sun_family = AF_UNIX;
      const std::string path = address.path.string();
      std::memcpy(un.sun_path, path.c_str(), path.size() + 1);
      std::memcpy(&storage, &un, size = sizeof un);
    }
  }
  const sockaddr* get() const noexcept { return reinterpret_cast<const sockaddr*>(&storage); }
};

[[noreturn]] void raise_system(const Address& address, const char* what) {
  throw std::system_error(errno, std::generic_category(), std::string(what) + " " + address.text());
}

Descriptor open_socket(const Address& address) {
  Descriptor opened(::socket(address.is_port() ? AF_INET : AF_UNIX, SOCK_STREAM, 0));
  if (!opened) {
    raise_system(address, "no socket for");
  }
  ::fcntl(opened.number(), F_SETFD, FD_CLOEXEC);
  return opened;
}

void prepare_stream(int descriptor) noexcept {
  ::fcntl(descriptor, F_SETFL, ::fcntl(descriptor, F_GETFL) | O_NONBLOCK);
  const int on = 1;
  ::setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);  // fails for Unix domain sockets, which need it not
#ifdef SO_NOSIGPIPE
  ::setsockopt(descriptor, SOL_SOCKET, SO_NOSIGPIPE, &on, sizeof on);
#endif
}

#ifdef MSG_NOSIGNAL
constexpr int send_flags = MSG_NOSIGNAL;
#else
constexpr int send_flags = 0;
#endif

constexpr std::size_t first_buffer = 65536;  // [B]

}  // namespace

Connection::Connection(const Address& address) : socket_(open_socket(address)), in_(first_buffer) {
  const SystemAddress to(address);
  while (::connect(socket_.number(), to.get(), to.size) != 0) {
    if (errno != EINTR) {
      raise_system(address, "nobody can be reached at");
    }
  }
  prepare_stream(socket_.number());
}

Connection::Connection(Descriptor socket) : socket_(std::move(socket)), in_(first_buffer) { prepare_stream(socket_.number()); }

void Connection::fail(const char* what, int error) noexcept {
  socket_.close();
  try {
    trouble_ = error == 0 ? std::string(what) : what + (": " + std::generic_category().message(error));
  } catch (...) {
    trouble_.clear();
  }
}

Received Connection::fill() noexcept {
  const auto got = ::recv(socket_.number(), in_.data() + end_, in_.size() - end_, 0);
  if (got > 0) {
    end_ += static_cast<std::size_t>(got);
    return Received::message;
  }
  if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) {
    return Received::nothing;
  }
  fail(got == 0 ? "the other side has closed the connection" : "the connection was lost", got == 0 ? 0 : errno);
  return Received::closed;
}

bool Connection::next(RawMessage& raw) {
  const std::size_t there = end_ - begin_;
  std::size_t wanted = Header::size;
  if (there >= Header::size) {
    raw.header = read_header(std::span<const std::byte, Header::size>(in_.data() + begin_, Header::size));
    if (raw.header.payload > longest_) {
      throw ProtocolError("a message of " + std::to_string(raw.header.payload) +
                          " bytes is too long for a client without the token; at most " + std::to_string(longest_) +
                          " are allowed");
    }
    wanted += raw.header.payload;
    if (there >= wanted) {
      raw.payload = std::span<const std::byte>(in_).subspan(begin_ + Header::size, raw.header.payload);
      begin_ += wanted;
      return true;
    }
  }
  if (begin_ > 0 && in_.size() - begin_ < wanted) {
    std::memmove(in_.data(), in_.data() + begin_, there);
    begin_ = 0;
    end_ = there;
  }
  if (in_.size() < wanted) {
    in_.resize(wanted);
  }
  return false;
}

Received Connection::receive(RawMessage& raw, double timeout) noexcept {
  if (!socket_) {
    return Received::closed;
  }
  trouble_.clear();
  const auto deadline = deadline_in(timeout);
  try {
    for (;;) {
      if (begin_ == end_) {
        begin_ = end_ = 0;
      }
      if (next(raw)) {
        return Received::message;
      }
      const Received filled = fill();
      if (filled == Received::closed) {
        return filled;
      }
      if (filled == Received::nothing) {
        const double left = time_left(deadline);
        if (left <= 0.0) {
          return Received::nothing;
        }
        wait_readable(socket_.number(), left);
      }
    }
  } catch (const std::exception& error) {  // broken protocol, or no memory
    trouble_ = error.what();
    return Received::refused;
  }
}

std::ptrdiff_t Connection::write_some(std::span<const std::byte> bytes) noexcept {
  const auto sent = ::send(socket_.number(), bytes.data(), bytes.size(), send_flags);
  if (sent >= 0) {
    return sent;
  }
  if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) {
    return 0;
  }
  fail("the connection was lost", errno);
  return -1;
}

bool Connection::send(std::span<const std::byte> bytes, double timeout) noexcept {
  if (!socket_) {
    return false;
  }
  trouble_.clear();
  const auto deadline = deadline_in(timeout);
  while (!bytes.empty()) {
    const std::ptrdiff_t sent = write_some(bytes);
    if (sent < 0) {
      return false;
    }
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
    if (!bytes.empty()) {
      const double left = time_left(deadline);
      if (left <= 0.0) {
        fail("the other side takes no messages", 0);
        return false;
      }
      pollfd waits{socket_.number(), POLLOUT, 0};
      poll_for(std::span(&waits, 1), left);
    }
  }
  return true;
}

bool Connection::queue(std::span<const std::byte> bytes, std::size_t most) {
  if (queued() + bytes.size() > most) {
    return false;
  }
  if (sent_ == pending_.size()) {
    pending_.clear();
    sent_ = 0;
  }
  pending_.insert(pending_.end(), bytes.begin(), bytes.end());
  return true;
}

bool Connection::flush() noexcept {
  while (socket_ && queued() > 0) {
    const std::ptrdiff_t sent = write_some(std::span<const std::byte>(pending_).subspan(sent_));
    if (sent <= 0) {
      break;
    }
    sent_ += static_cast<std::size_t>(sent);
  }
  return is_open();
}

Listener::Listener(const Address& address) : address_(address), socket_(open_socket(address)) {
  const SystemAddress at(address);
  if (address.is_port()) {
    const int on = 1;
    ::setsockopt(socket_.number(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  } else if (const Descriptor trial = open_socket(address); ::connect(trial.number(), at.get(), at.size) == 0) {
    errno = EADDRINUSE;
    raise_system(address, "another program listens at");
  } else if (errno == ECONNREFUSED) {  // left by a program that was killed
    ::unlink(address.path.c_str());
  }
  if (::bind(socket_.number(), at.get(), at.size) != 0 || ::listen(socket_.number(), 16) != 0) {
    raise_system(address, "cannot listen at");
  }
  if (address.is_port()) {
    sockaddr_in in{};
    socklen_t size = sizeof in;
    ::getsockname(socket_.number(), reinterpret_cast<sockaddr*>(&in), &size);
    address_.port = ntohs(in.sin_port);
  } else {
    ::chmod(address.path.c_str(), 0600);
  }
  ::fcntl(socket_.number(), F_SETFL, ::fcntl(socket_.number(), F_GETFL) | O_NONBLOCK);
}

Listener::~Listener() {
  if (socket_ && !address_.is_port()) {
    ::unlink(address_.path.c_str());
  }
}

Descriptor Listener::accept(double timeout) noexcept {
  const auto deadline = deadline_in(timeout);
  for (;;) {
    Descriptor accepted(::accept(socket_.number(), nullptr, nullptr));
    const double left = time_left(deadline);
    if (accepted || left <= 0.0) {
      if (accepted) {
        ::fcntl(accepted.number(), F_SETFD, FD_CLOEXEC);
      }
      return accepted;
    }
    wait_readable(socket_.number(), left);
  }
}

#else

Connection::Connection(const Address&) { throw std::runtime_error(no_sockets); }
Connection::Connection(Descriptor) { throw std::runtime_error(no_sockets); }
Received Connection::receive(RawMessage&, double) noexcept { return Received::closed; }
bool Connection::send(std::span<const std::byte>, double) noexcept { return false; }
bool Connection::queue(std::span<const std::byte>, std::size_t) { return false; }
bool Connection::flush() noexcept { return false; }
Listener::Listener(const Address& address) : address_(address) { throw std::runtime_error(no_sockets); }
Listener::~Listener() = default;
Descriptor Listener::accept(double) noexcept { return {}; }

#endif

}  // namespace sidestep::link

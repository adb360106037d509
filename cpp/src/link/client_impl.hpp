#pragma once

#include <condition_variable>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "polling.hpp"
#include "sidestep/link/client.hpp"
#include "sidestep/link/socket.hpp"
#include "sidestep/link/waker.hpp"

namespace sidestep::link {

/// The connection of a client, and the thread that reads it.
class Client::Impl {
 public:
  Impl(Connection connected, const ClientSettings& settings);
  ~Impl() { close(); }
  void close() noexcept;

  /// Sends a request and waits for its answer, whose fields are read into `answer`.
  template <Message M, Message Answer>
  void ask(const M& request, Answer& answer) {
    const std::vector<std::byte> payload =
        exchange([&] { return connection_.send(request, settings.timeout); }, Answer::info.type);
    decode(payload, answer);
  }
  /// The same of a request that is answered by Done; its words.
  template <Message M>
  std::string ask(const M& request) {
    Done done;
    ask(request, done);
    const std::lock_guard lock(mutex);
    followed = std::max(followed, done.cycle + 1);
    return done.words;
  }

  const ClientSettings settings;
  Welcome welcome;
  // Guarded by mutex.
  mutable std::mutex mutex;
  mutable std::condition_variable changed;
  CycleMessage newest;         // cycle 0: none came yet
  std::uint64_t followed = 0;  // number of the last cycle that may not follow the last request
  std::vector<Notice> notices;
  std::string ended, lost;  // why the run has ended, and the connection; empty: it has not
  std::uint32_t in_command = 0;

 private:
  struct Answer {
    MessageType type{};
    std::vector<std::byte> payload;
    bool came = false;
  };

  std::vector<std::byte> exchange(const std::function<bool()>& send, MessageType wanted);
  void read();
  void take(const RawMessage& raw);
  void take(const Notice& notice);

  Connection connection_;  // guarded by mutex
  std::map<std::uint64_t, Answer> awaited_;
  CycleMessage draft_;  // Of the thread.
  Waker waker_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace sidestep::link

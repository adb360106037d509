#include "client_impl.hpp"

#include <algorithm>
#include <chrono>

#include "sidestep/link/request_messages.hpp"

namespace sidestep::link {

Client::Impl::Impl(Connection connected, const ClientSettings& given) : settings(given), connection_(std::move(connected)) {
  thread_ = std::thread([this] { read(); });
  try {
    ask(Hello{settings.name, settings.token}, welcome);
    if (settings.rate != 0.0) {  // what is no rate the server refuses
      ask(Subscribe{settings.rate});
    }
  } catch (...) {
    close();
    throw;
  }
}

void Client::Impl::close() noexcept {
  {
    const std::lock_guard lock(mutex);
    stopping_ = true;
  }
  waker_.wake();
  if (thread_.joinable()) {
    thread_.join();
  }
}

std::vector<std::byte> Client::Impl::exchange(const std::function<bool()>& send, MessageType wanted) {
  std::unique_lock lock(mutex);
  if (!lost.empty()) {
    throw ConnectionLost(lost);
  }
  if (!send()) {
    lost = connection_.trouble();
    throw ConnectionLost(lost);
  }
  const std::uint64_t sequence = connection_.sequence();
  const auto found = awaited_.emplace(sequence, Answer{}).first;
  const auto came = [&] { return found->second.came || !lost.empty(); };
  const bool in_time = changed.wait_until(lock, deadline_in(settings.timeout), came);
  const Answer answer = std::move(found->second);
  awaited_.erase(found);
  if (!answer.came) {
    throw ConnectionLost(in_time ? lost : "the server has not answered within " + std::to_string(settings.timeout) + " s");
  }
  if (answer.type == MessageType::refused) {
    Refused refused;
    decode(answer.payload, refused);
    throw std::invalid_argument(refused.words);
  }
  if (answer.type != wanted) {
    throw ConnectionLost("the server has answered by a message of type " + std::to_string(static_cast<int>(answer.type)));
  }
  return answer.payload;
}

void Client::Impl::read() {
  for (;;) {
    {
      std::unique_lock lock(mutex);
      RawMessage raw;
      Received received = Received::nothing;
      while (!stopping_ && (received = connection_.receive(raw, 0.0)) == Received::message) {
        try {
          take(raw);
        } catch (const std::exception& error) {
          lost = error.what();
          stopping_ = true;
        }
      }
      if (received == Received::closed || received == Received::refused) {
        lost = lost.empty() ? connection_.trouble() : lost;
        stopping_ = true;
      }
      changed.notify_all();
      if (stopping_) {
        lost = lost.empty() ? "the client has ended" : lost;
        connection_.close();
        return;
      }
    }
    constexpr double longest_wait = 1.0;  // [s]; whoever ends this thread wakes it
    wait_readable(connection_.descriptor(), longest_wait, waker_.descriptor());
    waker_.calm();
  }
}

void Client::Impl::take(const RawMessage& raw) {
  switch (raw.header.type) {
    case MessageType::cycle:
      decode(raw.payload, draft_);
      std::swap(draft_, newest);
      in_command = newest.in_command;
      break;
    case MessageType::notice: {
      Notice notice;
      decode(raw.payload, notice);
      take(notice);
      break;
    }
    default:
      if (const auto found = awaited_.find(raw.header.sequence); found != awaited_.end()) {
        found->second = {raw.header.type, {raw.payload.begin(), raw.payload.end()}, true};
      } else if (raw.header.type == MessageType::refused) {  // of no request: the connection ends
        Refused refused;
        decode(raw.payload, refused);
        lost = refused.words;
      }
  }
}

void Client::Impl::take(const Notice& notice) {
  constexpr std::size_t most_notices = 1000;  // Older ones are forgotten where nobody asks for them.
  switch (notice.kind) {
    case Notice::Kind::command_taken: in_command = notice.client; break;
    case Notice::Kind::command_free: in_command = 0; break;
    case Notice::Kind::run_began: ended.clear(); break;
    case Notice::Kind::run_ended: ended = notice.words; break;
    case Notice::Kind::closing: lost = notice.words; break;
    case Notice::Kind::image_refused: break;
  }
  if (notices.size() == most_notices) {
    notices.erase(notices.begin());
  }
  notices.push_back(notice);
}

}  // namespace sidestep::link

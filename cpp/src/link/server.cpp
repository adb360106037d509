// The server's thread: it waits at its sockets, sends cycles, and hands requests on.
#include "sidestep/link/server.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../loop/real_time_thread.hpp"
#include "server_impl.hpp"
#include "sidestep/link/token.hpp"

namespace sidestep::link {
namespace {

constexpr std::size_t ring_size = 256;   // Cycles that may wait for the server's thread.
constexpr double server_pause = 0.1;     // Longest time between two looks at what has a timeout [s].
constexpr double hello_timeout = 5.0;    // A connection that does not say Hello within it is closed [s].
constexpr double explain_timeout = 1.0;  // [s]
constexpr int messages_at_once = 64;     // Of one client, before the others have their turn.
constexpr double never = std::numeric_limits<double>::infinity();

void require_clients(int most) {
  if (most < 1 || most > 1000) {
    throw std::invalid_argument("most_clients is " + std::to_string(most) + "; allowed: 1 to 1000");
  }
}

}  // namespace

Server::Impl::Impl(Controller& controller, const ServerSettings& given, Perception* perception)
    : settings(given),
      listener(Address(given.address)),
      token_file(given.token_file.empty() ? default_token_file(listener.address()) : given.token_file),
      controller_(controller),
      token_(given.token.empty() ? random_token() : given.token),
      ring_(controller.num_coordinates(), ring_size),
      next_due_(never),
      perception_(perception) {
  require_clients(settings.most_clients);
  write_token(token_file, token_);
  if (perception != nullptr) {
    images_ = std::make_unique<ImageWorker>(*perception, [this](std::uint32_t client, const std::string& words) {
      announce({Notice::Kind::image_refused, client, words});
    });
  }
  thread_ = std::thread([this] { run(); });
}

Server::Impl::~Impl() {
  stopping_.store(true);
  waker_.wake();
  thread_.join();
  images_.reset();
  std::error_code ignored;
  std::filesystem::remove(token_file, ignored);
}

void Server::Impl::observe(const RobotState& state, const Command& command, double now) noexcept {
  const std::uint64_t cycle = cycles_.load(std::memory_order_relaxed) + 1;
  cycles_.store(cycle, std::memory_order_release);
  bool wakes = desk_.answer(controller_, now);
  if (now >= next_due_.load(std::memory_order_relaxed)) {
    ring_.push(cycle, state, command, now);
    wakes = true;
  }
  if (wakes) {
    waker_.wake();
  }
}

void Server::Impl::announce(Notice notice) {
  {
    const std::lock_guard lock(shared);
    notices_.push_back(std::move(notice));
  }
  waker_.wake();
}

void Server::Impl::run() noexcept {
  while (!stopping_.load()) {
    try {
      while (turn()) {
      }
    } catch (const std::exception&) {  // no memory: all clients are lost
      sessions_.clear();
      controller_.clear_goal();
      in_command_ = 0;
      clients_changed_ = true;
    }
  }
  for (const auto& session : sessions_) {
    session->tell(Notice{Notice::Kind::closing, 0, "the server ends"}, 0);
    session->connection.flush();
  }
  if (in_command_ != 0 && !keeps_goal_) {
    controller_.clear_goal();
  }
}

/// False: the thread is to end.
bool Server::Impl::turn() {
  poller_.clear();
  poller_.add(listener.descriptor(), false);
  poller_.add(waker_.descriptor(), false);
  for (const auto& session : sessions_) {
    poller_.add(session->connection.descriptor(), session->connection.queued() > 0);
  }
  poller_.wait(server_pause);
  waker_.calm();
  if (stopping_.load()) {
    return false;
  }
  const double now = monotonic_time();
  publish();
  const std::size_t count = sessions_.size();
  for (std::size_t k = 0; k < count; ++k) {
    if (poller_.is_readable(k + 2)) {
      read(*sessions_[k]);
    }
  }
  if (poller_.is_readable(0)) {
    accept(now);
  }
  say_notices();
  answer_explanations(now);
  for (const auto& session : sessions_) {
    session->connection.flush();
  }
  remove_ended(now);
  double next = never;
  for (const auto& session : sessions_) {
    next = std::min(next, session->due);
  }
  next_due_.store(next, std::memory_order_relaxed);
  show_clients();
  return true;
}

void Server::Impl::publish() {
  while (CycleMessage* const cycle = ring_.front()) {
    publish(*cycle);
    ring_.pop();
  }
}

void Server::Impl::publish(CycleMessage& cycle) {
  encoded_.bytes.clear();
  for (const auto& session : sessions_) {
    if (cycle.now < session->due) {
      continue;
    }
    // From one due time to the next, so that the mean rate is the one asked for; not in a burst after a gap.
    session->due = std::max(session->due + session->spacing, cycle.now - session->spacing);
    if (encoded_.bytes.empty()) {
      cycle.in_command = in_command_;
      encode(encoded_, cycle, cycle.cycle);
    }
    if (!session->connection.queue(encoded_.bytes, Session::most_cycles)) {
      ++session->info.left_out;
      clients_changed_ = true;
    }
  }
}

void Server::Impl::say_notices() {
  std::vector<Notice> now;
  {
    const std::lock_guard lock(shared);
    now.swap(notices_);
  }
  for (const Notice& notice : now) {
    if (notice.kind == Notice::Kind::run_began || notice.kind == Notice::Kind::run_ended) {
      run_ = notice;
    }
    tell_all(notice);
  }
}

void Server::Impl::tell_all(const Notice& notice) {
  for (const auto& session : sessions_) {
    if (session->said_hello) {
      session->tell(notice, 0);
    }
  }
}

void Server::Impl::answer_explanations(double now) {
  Explanation explanation;
  const bool is_answered = desk_.take(explanation.words);
  bool asks = false;
  for (const auto& session : sessions_) {
    if (!session->asks_explanation) {
      continue;
    }
    if (is_answered) {
      session->tell(explanation, session->explain_sequence);
    } else if (now - session->asked > explain_timeout) {
      session->tell(Refused{"no run is under way that could say what it does"}, session->explain_sequence);
    } else {
      asks = true;
      continue;
    }
    session->asks_explanation = false;
  }
  if (asks) {
    desk_.ask();
  }
}

void Server::Impl::accept(double now) {
  while (Descriptor socket = listener.accept(0.0)) {
    auto session = std::make_unique<Session>(std::move(socket), ++last_client_, now);
    if (sessions_.size() >= static_cast<std::size_t>(settings.most_clients)) {
      session->tell(Refused{"there are " + std::to_string(sessions_.size()) + " clients, as many as are allowed"}, 0);
      session->connection.flush();
      continue;
    }
    sessions_.push_back(std::move(session));
    clients_changed_ = true;
  }
}

void Server::Impl::read(Session& session) {
  RawMessage raw;
  for (int k = 0; k < messages_at_once && !session.ends; ++k) {
    switch (session.connection.receive(raw, 0.0)) {
      case Received::message: try { handle(session, raw);
        } catch (const std::exception&) {  // no memory for the answer: this client is lost
          session.connection.close();
          return;
        }
        break;
      case Received::refused:
        session.tell(Refused{session.connection.trouble()}, 0);
        session.ends = true;
        break;
      case Received::nothing:
      case Received::closed: return;
    }
  }
}

void Server::Impl::remove_ended(double now) {
  const auto ended = [&](const std::unique_ptr<Session>& session) {
    const bool is_late = !session->said_hello && now - session->began > hello_timeout;
    return !session->connection.is_open() || is_late || (session->ends && session->connection.queued() == 0);
  };
  const auto first = std::stable_partition(sessions_.begin(), sessions_.end(), [&](const auto& one) { return !ended(one); });
  std::vector<std::unique_ptr<Session>> gone(std::make_move_iterator(first), std::make_move_iterator(sessions_.end()));
  sessions_.erase(first, sessions_.end());
  for (const auto& session : gone) {
    clients_changed_ = true;
    if (session->info.number == in_command_) {
      leave_command("the connection to " + session->info.name + " has ended");
    }
  }
}

void Server::Impl::show_clients() {
  if (!std::exchange(clients_changed_, false)) {
    return;
  }
  std::vector<ClientInfo> shown;
  for (const auto& session : sessions_) {
    shown.push_back(session->info);
    shown.back().in_command = session->info.number == in_command_;
  }
  const std::lock_guard lock(shared);
  clients.swap(shown);
}

Server::Server(Controller& controller, const ServerSettings& settings, Perception* perception)
    : impl_(std::make_unique<Impl>(controller, settings, perception)) {}
Server::~Server() = default;

void Server::observe(const RobotState& state, const Command& command, double now) noexcept {
  impl_->observe(state, command, now);
}
const Address& Server::address() const noexcept { return impl_->listener.address(); }
const std::filesystem::path& Server::token_file() const noexcept { return impl_->token_file; }
std::vector<ClientInfo> Server::clients() const {
  const std::lock_guard lock(impl_->shared);
  return impl_->clients;
}
void Server::run_began() { impl_->announce({Notice::Kind::run_began, 0, "a run has begun"}); }
void Server::run_ended(const std::string& why) { impl_->announce({Notice::Kind::run_ended, 0, why}); }
std::optional<std::string> Server::take_stop() {
  const std::lock_guard lock(impl_->shared);
  return std::exchange(impl_->stop_asked, std::nullopt);
}
bool Server::take_resume() noexcept { return impl_->resume_asked.exchange(false); }

}  // namespace sidestep::link

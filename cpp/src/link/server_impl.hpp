#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "cycle_ring.hpp"
#include "explanation_desk.hpp"
#include "image_worker.hpp"
#include "poller.hpp"
#include "session.hpp"
#include "sidestep/link/request_messages.hpp"
#include "sidestep/link/server.hpp"
#include "sidestep/link/waker.hpp"

namespace sidestep::link {

/// The thread of a server, and what other threads share with it.
class Server::Impl {
 public:
  Impl(Controller& controller, const ServerSettings& settings, Perception* perception);
  ~Impl();

  void observe(const RobotState& state, const Command& command, double now) noexcept;
  /// To all clients, in the server's thread soon.
  void announce(Notice notice);

  const ServerSettings settings;
  Listener listener;
  std::filesystem::path token_file;
  mutable std::mutex shared;  // guards what follows
  std::vector<ClientInfo> clients;
  std::optional<std::string> stop_asked;
  std::atomic<bool> resume_asked{false};

 private:
  // server.cpp: the thread.
  void run() noexcept;
  bool turn();
  void publish();
  void publish(CycleMessage& cycle);
  void say_notices();
  void answer_explanations(double now);
  void accept(double now);
  void read(Session& session);
  void remove_ended(double now);
  void show_clients();

  // server_requests.cpp: what a message leads to.
  void handle(Session& session, const RawMessage& raw);
  void dispatch(Session& session, const RawMessage& raw);
  template <Message M>
  void carry_out(Session& session, const RawMessage& raw);
  void say_hello(Session& session, const Hello& hello, std::uint64_t sequence);
  void subscribe(Session& session, const Subscribe& request);
  void take_command(Session& session, const TakeCommand& request);
  void leave_command(const std::string& why);
  void require_token(const Session& session) const;
  void require_command(const Session& session) const;
  Welcome welcome(const Session& session) const;
  void tell_all(const Notice& notice);
  std::string name_of(std::uint32_t client) const;

  Controller& controller_;
  std::string token_;
  CycleRing ring_;
  ExplanationDesk desk_;
  Waker waker_;
  std::atomic<double> next_due_;          // when a client wants a cycle [s]; inf: none does
  std::atomic<std::uint64_t> cycles_{0};  // that the loop has made
  std::vector<Notice> notices_;           // guarded by `shared`

  // Of the server's thread.
  std::vector<std::unique_ptr<Session>> sessions_;
  std::uint32_t last_client_ = 0, in_command_ = 0;  // 0: nobody
  std::optional<Notice> run_;                       // that a run has begun, or ended; for those who come later
  bool keeps_goal_ = false, clients_changed_ = false;
  Poller poller_;
  binary::Bytes encoded_;

  std::atomic<bool> stopping_{false};
  std::unique_ptr<ImageWorker> images_;  // null: there is no perception
  const Perception* perception_;
  std::thread thread_;
};

}  // namespace sidestep::link

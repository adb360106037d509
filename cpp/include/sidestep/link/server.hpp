#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sidestep/controller/controller.hpp"
#include "sidestep/link/address.hpp"
#include "sidestep/loop/cycle_observer.hpp"
#include "sidestep/perception/perception.hpp"

namespace sidestep::link {

struct ServerSettings {
  std::string address = "arm";            ///< see Address
  std::filesystem::path token_file = {};  ///< is written, for this user alone (0600); empty: ARM.token beside the socket
  std::string token = {};                 ///< of clients that move the arm; empty: a random one
  int most_clients = 16;
};

/// A client as the server sees it.
struct ClientInfo {
  std::uint32_t number = 0;
  std::string name;
  bool may_command = false, in_command = false;
  double rate = 0.0;           ///< of cycles that it is sent [Hz]; inf: every cycle
  std::uint64_t left_out = 0;  ///< cycles that it was not sent because it reads too slowly
};

/// Lets other programs of this machine move an arm: it takes the messages of request_messages.hpp and obstacle_messages.hpp, and sends
/// those of report_messages.hpp.
///
/// It has a thread of its own, in which it tells the controller what clients ask for. Every client may look. Who has the token may send
/// obstacles and images, pause the arm and stop the run. One of these is in command: it alone sets goals and resumes. Where it leaves or
/// its connection is lost, its goal is cleared unless it said otherwise, and its obstacles grow old as any source's do.
///
/// As an observer of a Loop it only copies each cycle into a ring. One exception: an explanation that a client asks for, at most ten
/// times a second, is put into words in the loop's thread, which alone may; that allocates.
class Server final : public CycleObserver {
 public:
  /// Listens from now on. Controller and perception (null: images are refused) must outlive this. Throws std::invalid_argument on a
  /// setting at fault, std::system_error where the address is taken or the token cannot be written.
  explicit Server(Controller& controller, const ServerSettings& settings = {}, Perception* perception = nullptr);
  ~Server() override;
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  void observe(const RobotState& state, const Command& command, double now) noexcept override;
  void observe_before_motion(const RobotState& state, const Command& command, double now) noexcept override {
    observe(state, command, now);
  }

  const Address& address() const noexcept;
  const std::filesystem::path& token_file() const noexcept;
  std::vector<ClientInfo> clients() const;

  // For the owner of the loop, from any thread.
  /// Tells clients that a run has begun.
  void run_began();
  /// Tells clients that it has ended, and why.
  void run_ended(const std::string& why);
  /// Whether a client has asked to stop the run since the last call, and why. Between two runs a later `resume` takes that back.
  std::optional<std::string> take_stop();
  /// Whether the client in command has asked to resume since the last call.
  bool take_resume() noexcept;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sidestep::link

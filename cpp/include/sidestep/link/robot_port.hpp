#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sidestep/link/robot_messages.hpp"
#include "sidestep/link/socket.hpp"

namespace sidestep::link {

/// What a driver says to a robot.
struct RobotRequest {
  enum class Kind {
    start,    ///< control by `output` begins
    command,  ///< `values` of `output`
    stop,     ///< control ends
    gone,     ///< the connection of the driver in control has ended
  };

  Kind kind = Kind::stop;
  ControllerSettings::Output output = ControllerSettings::Output::torque;
  std::uint64_t sequence = 0;  ///< of the message
  std::uint64_t cycle = 0;     ///< of the state that a command answers
  Eigen::VectorXd values;      ///< (nv) finite
};

/// Short name, for example "command".
const char* to_string(RobotRequest::Kind kind) noexcept;

/// Robot's side of a link: tells everybody who connects what the robot is and how it is, and hears the one who controls it. For one
/// thread. Who breaks the protocol, or sends a command of another size or output, is told why and cut off. Who reads too slowly misses
/// states.
class RobotPort {
 public:
  static constexpr std::size_t most_connections = 8;
  static constexpr std::size_t most_queued = std::size_t{1} << 18;  ///< for one that reads too slowly [B]

  /// Listens. Throws std::invalid_argument for an address or a hello that is not allowed, std::system_error where the address is taken.
  RobotPort(const std::string& address, RobotHello hello);

  /// The next thing that a driver says, waiting for at most `timeout` [s]; meanwhile new connections are taken.
  std::optional<RobotRequest> receive(double timeout);
  void send(const RobotStateMessage& state);
  /// To all but the driver in control, which has no use for them.
  void send(const RobotObjects& objects);
  /// The robot has stopped itself: tells the driver in control, whose control has ended.
  void stop(const std::string& words);

  /// As text, with the port that was free.
  std::string address() const { return listener_.address().text(); }
  int num_connections() const noexcept { return static_cast<int>(connections_.size()); }
  bool is_controlled() const noexcept { return control_ != nullptr; }
  /// Why connections were cut off so far, the last ones first; at most 16.
  const std::deque<std::string>& refusals() const noexcept { return refusals_; }

 private:
  bool accept_all();
  /// The next request that has arrived, from each connection in turn.
  std::optional<RobotRequest> next();
  std::optional<RobotRequest> next(Connection& connection);
  std::optional<RobotRequest> take(Connection& from, const RawMessage& raw);
  void refuse(Connection& connection, const std::string& words);
  /// Sends RobotStop.
  void tell(Connection& connection, const std::string& words);
  void broadcast(const Connection* except = nullptr);
  void remove_closed();

  RobotHello hello_;
  Listener listener_;
  std::vector<std::unique_ptr<Connection>> connections_;
  std::size_t served_ = 0;               // The connection that was served last.
  bool has_more_ = false;                // A connection may have more messages than its turn allowed.
  const Connection* control_ = nullptr;  // Of the driver in control.
  ControllerSettings::Output output_ = ControllerSettings::Output::torque;
  bool lost_control_ = false;  // The one in control has gone, and nobody was told.
  binary::Bytes out_;
  std::deque<std::string> refusals_;
};

}  // namespace sidestep::link

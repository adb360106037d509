#include "sidestep/link/robot_port.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "polling.hpp"

namespace sidestep::link {
namespace {

constexpr std::size_t most_refusals = 16;
constexpr int messages_in_turn = 64;  // Of one connection, before the others have their turn.

/// A hello that may be sent.
RobotHello checked_hello(RobotHello hello) {
  hello.check();
  return hello;
}

}  // namespace

const char* to_string(RobotRequest::Kind kind) noexcept {
  switch (kind) {
    case RobotRequest::Kind::start: return "start";
    case RobotRequest::Kind::command: return "command";
    case RobotRequest::Kind::stop: return "stop";
    case RobotRequest::Kind::gone: return "gone";
  }
  return "";
}

RobotPort::RobotPort(const std::string& address, RobotHello hello)
    : hello_(checked_hello(std::move(hello))), listener_(Address(address)) {}

std::optional<RobotRequest> RobotPort::receive(double timeout) {
  const auto deadline = deadline_in(timeout);
  for (;;) {
    while (accept_all()) {
    }
    if (auto request = next()) {
      return request;
    }
    const double left = time_left(deadline);
    if (left <= 0.0) {
      return std::nullopt;
    }
    if (has_more_) {
      continue;
    }
    std::array<int, most_connections + 1> descriptors{};
    std::size_t count = 0;
    descriptors[count++] = listener_.descriptor();
    for (const auto& connection : connections_) {
      descriptors[count++] = connection->descriptor();
    }
    wait_readable(std::span(descriptors).first(count), left);
  }
}

bool RobotPort::accept_all() {
  Descriptor socket = listener_.accept(0.0);
  if (!socket) {
    return false;
  }
  auto connection = std::make_unique<Connection>(std::move(socket));
  if (connections_.size() >= most_connections) {
    refuse(*connection, "the robot has " + std::to_string(most_connections) + " connections already");
    return true;
  }
  out_.bytes.clear();
  encode(out_, hello_, 0);
  if (connection->queue(out_.bytes, most_queued) && connection->flush()) {
    connections_.push_back(std::move(connection));
  }
  return true;
}

std::optional<RobotRequest> RobotPort::next() {
  std::optional<RobotRequest> found;
  has_more_ = false;
  for (std::size_t k = 0; k < connections_.size() && !found; ++k) {
    served_ = (served_ + 1) % connections_.size();  // after the one that was served last
    found = next(*connections_[served_]);
  }
  remove_closed();
  if (!found && std::exchange(lost_control_, false)) {
    found.emplace();
    found->kind = RobotRequest::Kind::gone;
  }
  return found;
}

std::optional<RobotRequest> RobotPort::next(Connection& connection) {
  RawMessage raw;
  for (int k = 0; k < messages_in_turn; ++k) {
    switch (connection.receive(raw, 0.0)) {
      case Received::message: break;
      case Received::refused: refuse(connection, connection.trouble()); return std::nullopt;
      case Received::nothing:
      case Received::closed: return std::nullopt;
    }
    try {
      if (auto found = take(connection, raw)) {
        return found;
      }
    } catch (const std::invalid_argument& error) {
      refuse(connection, error.what());
      return std::nullopt;
    }
  }
  has_more_ = true;
  return std::nullopt;
}

std::optional<RobotRequest> RobotPort::take(Connection& from, const RawMessage& raw) {
  RobotRequest request;
  request.sequence = raw.header.sequence;
  switch (raw.header.type) {
    case MessageType::robot_start: {
      RobotStart start;
      decode(raw.payload, start);
      if (control_ != nullptr && control_ != &from) {
        tell(from, "another driver controls the robot");
        return std::nullopt;
      }
      if (std::ranges::find(hello_.outputs, start.output) == hello_.outputs.end()) {
        throw std::invalid_argument("the robot does not take this output");
      }
      control_ = &from;
      request.kind = RobotRequest::Kind::start;
      request.output = output_ = start.output;
      return request;
    }
    case MessageType::robot_command: {
      RobotCommandMessage command;
      decode(raw.payload, command);
      if (control_ != &from) {
        return std::nullopt;  // of before a stop of the robot
      }
      require_size("values", command.values.size(), static_cast<Eigen::Index>(hello_.joints.size()));
      if (command.output != output_) {
        throw std::invalid_argument("RobotCommandMessage: output is another one than that of RobotStart");
      }
      request.kind = RobotRequest::Kind::command;
      request.output = command.output;
      request.cycle = command.cycle;
      request.values = std::move(command.values);
      return request;
    }
    case MessageType::robot_stop:
      if (control_ != &from) {
        return std::nullopt;
      }
      control_ = nullptr;
      request.kind = RobotRequest::Kind::stop;
      return request;
    default: return std::nullopt;  // of a newer side: skipped, see read_header
  }
}

void RobotPort::refuse(Connection& connection, const std::string& words) {
  refusals_.push_front(words);
  if (refusals_.size() > most_refusals) {
    refusals_.pop_back();
  }
  tell(connection, words);
  connection.close();
}

void RobotPort::tell(Connection& connection, const std::string& words) {
  out_.bytes.clear();
  encode(out_, RobotStop{shortened(words)}, 0);
  connection.queue(out_.bytes, most_queued + out_.bytes.size());
  connection.flush();
}

void RobotPort::send(const RobotStateMessage& state) {
  out_.bytes.clear();
  encode(out_, state, state.cycle);
  broadcast();
}

void RobotPort::send(const RobotObjects& objects) {
  out_.bytes.clear();
  encode(out_, objects, 0);
  broadcast(control_);
}

void RobotPort::stop(const std::string& words) {
  for (const auto& connection : connections_) {
    if (connection.get() == control_) {
      tell(*connection, words);
    }
  }
  control_ = nullptr;
}

void RobotPort::broadcast(const Connection* except) {
  for (const auto& connection : connections_) {
    if (connection.get() != except) {
      connection->queue(out_.bytes, most_queued);
      connection->flush();
    }
  }
  remove_closed();
}

void RobotPort::remove_closed() {
  std::erase_if(connections_, [this](const auto& connection) {
    const bool closed = !connection->is_open();
    if (closed && connection.get() == control_) {
      control_ = nullptr;
      lost_control_ = true;
    }
    return closed;
  });
}

}  // namespace sidestep::link

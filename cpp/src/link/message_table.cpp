#include "sidestep/link/message_table.hpp"

#include <algorithm>

#include "sidestep/link/obstacle_messages.hpp"
#include "sidestep/link/report_messages.hpp"
#include "sidestep/link/request_messages.hpp"
#include "sidestep/link/robot_messages.hpp"

namespace sidestep::link {
namespace {

/// Calls visit(M{}) for every message, by their numbers.
void each_message(auto&& visit) {
  visit(RobotHello{});
  visit(RobotStart{});
  visit(RobotStateMessage{});
  visit(RobotCommandMessage{});
  visit(RobotStop{});
  visit(RobotObjects{});
  visit(Hello{});
  visit(Subscribe{});
  visit(TakeCommand{});
  visit(ReleaseCommand{});
  visit(SetJointGoal{});
  visit(SetPoseGoal{});
  visit(SetVelocity{});
  visit(SetTwist{});
  visit(SetTrajectory{});
  visit(ClearGoal{});
  visit(Restart{});
  visit(SetObstacles{});
  visit(AddObstacle{});
  visit(MoveObstacle{});
  visit(RemoveObstacle{});
  visit(RemoveObstacles{});
  visit(DepthImageMessage{});
  visit(Pause{});
  visit(Resume{});
  visit(StopRun{});
  visit(Explain{});
  visit(Ping{});
  visit(ExpectObstacles{});
  visit(Welcome{});
  visit(Done{});
  visit(Refused{});
  visit(CycleMessage{});
  visit(Explanation{});
  visit(Notice{});
}

/// What a field is, for people.
template <class T>
std::string kind_in_words() {
  if constexpr (std::is_same_v<T, bool>) {
    return "bool";
  } else if constexpr (std::is_enum_v<T>) {
    return kind_in_words<std::underlying_type_t<T>>();
  } else if constexpr (std::is_integral_v<T>) {
    return (std::is_signed_v<T> ? "int" : "uint") + std::to_string(8 * sizeof(T));
  } else if constexpr (std::is_floating_point_v<T>) {
    return "float64";
  } else if constexpr (std::is_same_v<T, std::string>) {
    return "text";
  } else if constexpr (std::is_base_of_v<Eigen::EigenBase<T>, T>) {
    return T::ColsAtCompileTime == 1 ? "vector" : "matrix";
  } else if constexpr (std::is_class_v<typename T::value_type> && !std::is_same_v<typename T::value_type, std::string>) {
    return "list";
  } else {
    return "list of " + kind_in_words<typename T::value_type>();
  }
}

}  // namespace

const std::vector<MessageInfo>& all_messages() {
  static const std::vector<MessageInfo> all = [] {
    std::vector<MessageInfo> found;
    each_message([&found](const auto& message) { found.push_back(message.info); });
    return found;
  }();
  return all;
}

const MessageInfo* find_message(MessageType type) noexcept {
  const std::vector<MessageInfo>& all = all_messages();
  const auto found = std::ranges::find(all, type, &MessageInfo::type);
  return found == all.end() ? nullptr : &*found;
}

std::vector<FieldInfo> fields_of(MessageType type) {
  std::vector<FieldInfo> fields;
  each_message([&](auto message) {
    if (message.info.type == type) {
      each_field(message, [&fields](const char* name, auto& value, const char* meaning) {
        fields.push_back({name, kind_in_words<std::remove_cvref_t<decltype(value)>>(), meaning});
      });
    }
  });
  return fields;
}

void check_payload(MessageType type, std::span<const std::byte> payload) {
  if (find_message(type) == nullptr) {
    throw std::invalid_argument("there is no message of type " + std::to_string(static_cast<int>(type)));
  }
  each_message([&](auto message) {
    if (message.info.type == type) {
      decode(payload, message);
    }
  });
}

std::vector<std::vector<std::byte>> default_messages() {
  std::vector<std::vector<std::byte>> all;
  each_message([&](const auto& message) {
    binary::Bytes out;
    encode(out, message, all.size() + 1);
    all.push_back(std::move(out.bytes));
  });
  return all;
}

}  // namespace sidestep::link

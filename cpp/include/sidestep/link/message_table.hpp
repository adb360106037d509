#pragma once

#include <string>
#include <vector>

#include "sidestep/link/message.hpp"

namespace sidestep::link {

/// Longest payload of a type that is unknown, which is skipped [B].
constexpr std::size_t longest_unknown = 65536;

/// A field of a message, for people.
struct FieldInfo {
  std::string name, kind, meaning;
};

/// All messages, by their numbers.
const std::vector<MessageInfo>& all_messages();
/// Null: there is no such type.
const MessageInfo* find_message(MessageType type) noexcept;
/// Fields of a message in the order in which they are sent.
std::vector<FieldInfo> fields_of(MessageType type);
/// Reads a payload of a type, and drops it. Throws std::invalid_argument as `decode` does, and where there is no such type.
void check_payload(MessageType type, std::span<const std::byte> payload);
/// A message of each type with its fields as they are by default, in their order; for tests.
std::vector<std::vector<std::byte>> default_messages();

}  // namespace sidestep::link

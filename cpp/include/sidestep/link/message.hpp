#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "sidestep/math/binary.hpp"

// Messages between programs: a header of fixed size, then the fields of one struct, all little-endian. The structs are in
// robot_messages.hpp (robot and driver), request_messages.hpp (client to server) and report_messages.hpp (server to client);
// message_table.hpp lists them all.
namespace sidestep::link {

/// Raised by one whenever a message changes. Both sides must speak the same.
constexpr std::uint16_t protocol_version = 1;
/// The first four bytes of every message, "SDST".
constexpr std::uint32_t magic = 0x54534453;
/// Most joints of an arm in a message.
constexpr std::size_t most_joints = 64;
/// Longest text of a message [B].
constexpr std::size_t longest_text = 4096;

/// Bytes of `count` vectors of joints.
constexpr std::size_t joint_vectors(std::size_t count) noexcept { return count * (4 + 8 * most_joints); }

/// Which struct a message holds; its number in the header.
enum class MessageType : std::uint16_t {
  // Robot and driver.
  robot_hello = 1,
  robot_start = 2,
  robot_state = 3,
  robot_command = 4,
  robot_stop = 5,
  robot_objects = 6,
  // Client to server.
  hello = 16,
  subscribe = 17,
  take_command = 18,
  release_command = 19,
  set_joint_goal = 20,
  set_pose_goal = 21,
  set_velocity = 22,
  set_twist = 23,
  set_trajectory = 24,
  clear_goal = 25,
  restart = 26,
  set_obstacles = 27,
  add_obstacle = 28,
  move_obstacle = 29,
  remove_obstacle = 30,
  remove_obstacles = 31,
  depth_image = 32,
  pause = 33,
  resume = 34,
  stop_run = 35,
  explain = 36,
  ping = 37,
  expect_obstacles = 38,
  // Server to client.
  welcome = 64,
  done = 65,
  refused = 66,
  cycle = 67,
  explanation = 68,
  notice = 69,
};

/// Who sends a message.
enum class Sender : std::uint8_t { robot, driver, either_side_of_robot, client, server };

/// In words, for example "client".
const char* to_string(Sender sender) noexcept;

/// What is known of a message without its content.
struct MessageInfo {
  MessageType type;
  const char* name;
  Sender sender;
  std::size_t largest;  ///< payload [B]; a longer one is refused unread
  const char* meaning;  ///< one sentence
};

/// Header of a message, 20 bytes.
struct Header {
  static constexpr std::size_t size = 20, payload_at = 8;

  std::uint32_t magic = link::magic;
  std::uint16_t version = protocol_version;
  MessageType type{};
  std::uint32_t payload = 0;   ///< bytes that follow
  std::uint64_t sequence = 0;  ///< Counts the messages of a sender; a reply has that of its request.
};
/// The struct M, or const M: what a function for both directions takes.
template <class T, class M>
concept Of = std::is_same_v<std::remove_const_t<T>, M>;
void describe(auto& archive, Of<Header> auto& h) { archive(h.magic, h.version, h.type, h.payload, h.sequence); }

/// A message as it came: valid until the next one is received.
struct RawMessage {
  Header header;
  std::span<const std::byte> payload;
};

/// A message that breaks the protocol, so that nothing after it can be read: the connection ends.
class ProtocolError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// Reads a header. Throws ProtocolError that names the value and what is allowed: another beginning, another protocol version, a
/// payload longer than its type allows. A type that is unknown is none of these: it is left to the receiver, which skips it.
Header read_header(std::span<const std::byte, Header::size> bytes);

/// A struct with `static constexpr MessageInfo info` and each_field(message, visit), which calls visit(name, field, meaning).
template <class M>
concept Message = requires { M::info.type; };

/// Reads or writes all fields, in their order.
template <Message M>
void describe_fields(auto& archive, M& message) {
  each_field(message, [&archive](const char*, auto& field, const char*) { archive(field); });
}

/// Writes header and fields after what `out` holds. Allocates only where its capacity is too small. Throws std::length_error if the
/// message is longer than its type allows.
template <Message M>
void encode(binary::Bytes& out, const M& message, std::uint64_t sequence) {
  const std::size_t begin = out.bytes.size();
  binary::Encoder<binary::Bytes> archive(out);
  Header header;
  header.type = M::info.type;
  header.sequence = sequence;
  describe(archive, header);
  describe_fields(archive, message);
  const std::size_t payload = out.bytes.size() - begin - Header::size;
  if (payload > M::info.largest) {
    out.bytes.resize(begin);
    throw std::length_error(std::string(M::info.name) + " would have " + std::to_string(payload) + " bytes; at most " +
                            std::to_string(M::info.largest) + " are allowed");
  }
  const auto stored = binary::little_endian(static_cast<std::uint32_t>(payload));
  std::memcpy(out.bytes.data() + begin + Header::payload_at, &stored, sizeof stored);
}

/// Reads the fields of a payload into `message`. Allocates only where a field grows. Throws std::invalid_argument that names the
/// message and says what is wrong with it; its fields are then unspecified. The connection can go on.
template <Message M>
void decode(std::span<const std::byte> payload, M& message) {
  try {
    binary::Decoder archive(payload);
    describe_fields(archive, message);
    if (!archive.rest().empty()) {
      throw std::invalid_argument(std::to_string(archive.rest().size()) + " bytes too many");
    }
    if constexpr (requires { message.check(); }) {
      message.check();
    }
  } catch (const std::exception& error) {
    throw std::invalid_argument(std::string(M::info.name) + ": " + error.what());
  }
}

// What checks of messages share. Each throws std::invalid_argument that names the field, the value and what is allowed.
void require_finite(const char* field, Eigen::Ref<const Eigen::MatrixXd> values);
void require_size(const char* field, Eigen::Index size, Eigen::Index wanted);
void require_at_most(const char* field, std::size_t size, std::size_t most);
/// A text of messages for humans and names: not longer than `longest_text`, valid UTF-8 without zero bytes.
void require_text(const char* field, const std::string& text);
/// As much of a text as a message may hold, cut between two characters.
std::string shortened(std::string text);

}  // namespace sidestep::link

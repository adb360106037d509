#include "sidestep/link/message.hpp"

#include <cstdio>
#include <string_view>

#include "sidestep/link/message_table.hpp"

namespace sidestep::link {
namespace {

std::string in_hex(std::uint32_t value) {
  char text[16];
  std::snprintf(text, sizeof text, "0x%08x", value);
  return text;
}

/// Length of the UTF-8 character at the beginning of a text that is not empty; 0: it is none.
std::size_t character_length(std::string_view text) noexcept {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const unsigned first = byte(0);
  if (first < 0x80) {
    return first == 0 ? 0 : 1;
  }
  const std::size_t length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4 || text.size() < length) {
    return 0;
  }
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(k) & 0xc0u) != 0x80u) {
      return 0;
    }
  }
  // Longer than needed, surrogates, and beyond the last character.
  const unsigned second = byte(1);
  const bool wrong = (first == 0xe0 && second < 0xa0) || (first == 0xed && second > 0x9f) || (first == 0xf0 && second < 0x90) ||
                     (first == 0xf4 && second > 0x8f);
  return wrong ? 0 : length;
}

}  // namespace

const char* to_string(Sender sender) noexcept {
  switch (sender) {
    case Sender::robot: return "robot";
    case Sender::driver: return "driver";
    case Sender::either_side_of_robot: return "robot or driver";
    case Sender::client: return "client";
    case Sender::server: return "server";
  }
  return "?";
}

Header read_header(std::span<const std::byte, Header::size> bytes) {
  binary::Decoder archive(bytes);
  Header header;
  describe(archive, header);
  if (header.magic != magic) {
    throw ProtocolError("this is no message of Sidestep: it begins with " + in_hex(header.magic) + " in place of " +
                        in_hex(magic));
  }
  if (header.version != protocol_version) {
    throw ProtocolError("the message has protocol version " + std::to_string(header.version) + "; this side speaks version " +
                        std::to_string(protocol_version) + ": use the same version of Sidestep on both sides");
  }
  const MessageInfo* const info = find_message(header.type);
  const std::size_t most = info == nullptr ? longest_unknown : info->largest;
  if (header.payload > most) {
    const std::string name =
        info == nullptr ? "type " + std::to_string(static_cast<int>(header.type)) : std::string(info->name);
    throw ProtocolError("a message " + name + " of " + std::to_string(header.payload) + " bytes is too long; at most " +
                        std::to_string(most) + " are allowed");
  }
  return header;
}

void require_finite(const char* field, Eigen::Ref<const Eigen::MatrixXd> values) {
  for (Eigen::Index j = 0; j < values.cols(); ++j) {
    for (Eigen::Index i = 0; i < values.rows(); ++i) {
      if (!std::isfinite(values(i, j))) {
        const std::string at = values.cols() == 1 ? std::to_string(i) : std::to_string(i) + ", " + std::to_string(j);
        throw std::invalid_argument(std::string(field) + "[" + at + "] is " + std::to_string(values(i, j)) +
                                    "; finite numbers are allowed");
      }
    }
  }
}

void require_size(const char* field, Eigen::Index size, Eigen::Index wanted) {
  if (size != wanted) {
    throw std::invalid_argument(std::string(field) + " has " + std::to_string(size) + " entries, not " +
                                std::to_string(wanted));
  }
}

void require_at_most(const char* field, std::size_t size, std::size_t most) {
  if (size > most) {
    throw std::invalid_argument(std::string(field) + " has " + std::to_string(size) + " entries; at most " +
                                std::to_string(most) + " are allowed");
  }
}

void require_text(const char* field, const std::string& text) {
  require_at_most(field, text.size(), longest_text);
  for (std::string_view left = text; !left.empty();) {
    const std::size_t length = character_length(left);
    if (length == 0) {
      throw std::invalid_argument(std::string(field) + " is no text in UTF-8, from its byte " +
                                  std::to_string(text.size() - left.size()) + " on");
    }
    left.remove_prefix(length);
  }
}

std::string shortened(std::string text) {
  if (text.size() > longest_text) {
    std::size_t end = longest_text;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0u) == 0x80u) {  // in the middle of a character
      --end;
    }
    text.resize(end);
  }
  return text;
}

}  // namespace sidestep::link

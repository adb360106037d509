// Messages: what is sent comes back, and nothing else is taken.
#include <boost/test/unit_test.hpp>
#include <set>

#include "sidestep/link/message_table.hpp"
#include "sidestep/link/robot_messages.hpp"

using namespace sidestep;
using namespace sidestep::link;

namespace {

template <Message M>
std::vector<std::byte> sent(const M& message, std::uint64_t sequence = 7) {
  binary::Bytes out;
  encode(out, message, sequence);
  return out.bytes;
}

Header header_of(const std::vector<std::byte>& bytes) {
  return read_header(std::span<const std::byte, Header::size>(bytes.data(), Header::size));
}

std::span<const std::byte> payload_of(const std::vector<std::byte>& bytes) {
  return std::span<const std::byte>(bytes).subspan(Header::size);
}

/// Words of the error that `action` throws.
template <class Action>
std::string words_of(Action&& action) {
  try {
    action();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no error";
}

RobotStateMessage a_state() {
  RobotStateMessage state;
  state.cycle = 41;
  state.time = 12.5;
  state.q = Eigen::Vector3d(0.1, -0.2, 0.3);
  state.v = Eigen::Vector3d(1.0, 2.0, 3.0);
  state.torque = state.told_position = state.told_velocity = state.told_acceleration =
      Eigen::VectorXd::Constant(3, std::numeric_limits<double>::quiet_NaN());
  state.lost_cycles = 2;
  return state;
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_state_comes_back_as_it_was_sent) {
  const std::vector<std::byte> bytes = sent(a_state());
  const Header header = header_of(bytes);
  BOOST_TEST(static_cast<int>(header.type) == 3);
  BOOST_TEST(header.sequence == 7u);
  BOOST_TEST(header.payload + Header::size == bytes.size());
  RobotStateMessage back;
  decode(payload_of(bytes), back);
  BOOST_TEST(back.cycle == 41u);
  BOOST_TEST(back.time == 12.5);
  BOOST_TEST(back.q == a_state().q);
  BOOST_TEST(back.v == a_state().v);
  BOOST_TEST(back.told_velocity.size() == 3);
  BOOST_TEST(std::isnan(back.told_velocity[2]));
  BOOST_TEST(back.lost_cycles == 2);
}

BOOST_AUTO_TEST_CASE(the_header_is_laid_out_as_it_is_documented) {
  const std::vector<std::byte> bytes = sent(RobotStart{ControllerSettings::Output::velocity}, 0x0102030405060708);
  const unsigned char expected[] = {'S', 'D', 'S', 'T', 1, 0, 2, 0, 4, 0, 0, 0, 8, 7, 6, 5, 4, 3, 2, 1, 3, 0, 0, 0};
  const auto* const begin = reinterpret_cast<const unsigned char*>(bytes.data());
  BOOST_TEST(std::vector<unsigned char>(begin, begin + bytes.size()) ==
                 std::vector<unsigned char>(std::begin(expected), std::end(expected)),
             boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(a_header_that_breaks_the_protocol_is_refused_with_the_value) {
  std::vector<std::byte> bytes = sent(RobotStart{});
  std::vector<std::byte> other = bytes;
  other[0] = std::byte{'X'};
  BOOST_TEST(words_of([&] { header_of(other); }) ==
             "this is no message of Sidestep: it begins with 0x54534458 in place of 0x54534453");
  other = bytes;
  other[4] = std::byte{9};
  BOOST_TEST(words_of([&] { header_of(other); }).find("version 9; this side speaks version 1") != std::string::npos);
  other = bytes;
  other[10] = std::byte{1};
  BOOST_TEST(words_of([&] { header_of(other); }) == "a message RobotStart of 65540 bytes is too long; at most 64 are allowed");
}

BOOST_AUTO_TEST_CASE(fields_that_cannot_be_are_refused_by_name) {
  RobotCommandMessage command;
  command.values = Eigen::Vector2d(0.0, std::numeric_limits<double>::quiet_NaN());
  RobotCommandMessage back;
  BOOST_TEST(words_of([&] { decode(payload_of(sent(command)), back); }) ==
             "RobotCommandMessage: values[1] is nan; finite numbers are allowed");
  RobotStart start{static_cast<ControllerSettings::Output>(9)};
  BOOST_TEST(words_of([&] { decode(payload_of(sent(start)), start); }).find("output is 9; allowed are 1 torque") !=
             std::string::npos);
  RobotStateMessage state = a_state();
  state.v = Eigen::Vector2d(1.0, 2.0);
  BOOST_TEST(words_of([&] { decode(payload_of(sent(state)), state); }) == "RobotStateMessage: v has 2 entries, not 3");
  RobotStop stop{"a\xff"};
  BOOST_TEST(words_of([&] { decode(payload_of(sent(stop)), stop); }) ==
             "RobotStop: words is no text in UTF-8, from its byte 1 on");
  std::vector<std::byte> bytes = sent(RobotStop{"enough"});
  bytes.push_back(std::byte{0});
  BOOST_TEST(words_of([&] { decode(payload_of(bytes), stop); }) == "RobotStop: 1 bytes too many");
}

BOOST_AUTO_TEST_CASE(a_message_that_is_too_long_is_not_sent) {
  binary::Bytes out;
  BOOST_TEST(words_of([&] { encode(out, RobotStop{std::string(5000, 'x')}, 1); }) ==
             "RobotStop would have 5004 bytes; at most 4104 are allowed");
  BOOST_TEST(out.bytes.empty());
}

BOOST_AUTO_TEST_CASE(every_type_is_in_the_table_once) {
  std::set<int> types;
  std::set<std::string> names;
  for (const MessageInfo& info : all_messages()) {
    types.insert(static_cast<int>(info.type));
    names.insert(info.name);
    BOOST_TEST(find_message(info.type)->name == info.name);
    BOOST_TEST(find_message(info.type)->largest == info.largest);
  }
  BOOST_TEST(types.size() == all_messages().size());
  BOOST_TEST(names.size() == all_messages().size());
  BOOST_TEST(find_message(static_cast<MessageType>(999)) == nullptr);
}

BOOST_AUTO_TEST_CASE(a_text_is_cut_between_characters) {
  BOOST_TEST(shortened("a few words") == "a few words");
  BOOST_TEST(shortened(std::string(longest_text, 'x')).size() == longest_text);
  BOOST_TEST(shortened(std::string(longest_text + 1, 'x')).size() == longest_text);
  const std::string before(longest_text - 2, 'x');
  BOOST_TEST(shortened(before + "×") == before + "×");   // two bytes fit
  BOOST_TEST(shortened(before + "€") == before);         // of three not
  BOOST_TEST(shortened(before + "y€") == before + "y");  // nor one of them
}

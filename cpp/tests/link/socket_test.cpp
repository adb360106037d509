// Sockets: whole messages, in pieces or together, over both kinds of sockets.
#include <boost/test/unit_test.hpp>
#include <chrono>
#include <filesystem>
#include <system_error>
#include <thread>

#include "sidestep/link/robot_messages.hpp"
#include "sidestep/link/socket.hpp"
#include "support/allocations.hpp"
#include "support/link_address.hpp"

using namespace sidestep;
using namespace sidestep::link;
using test::LinkAddress;

namespace {

/// Both ends of a connection.
struct Pair {
  explicit Pair(const Address& address) : listener(address), one(listener.address()), two(listener.accept(1.0)) {}
  Listener listener;
  Connection one, two;
};

}  // namespace

BOOST_AUTO_TEST_CASE(messages_pass_over_both_kinds_of_sockets) {
  for (const Address& address : {Address(LinkAddress().text()), Address("tcp:0")}) {
    Pair pair(address);
    BOOST_TEST(pair.one.send(RobotStop{"first"}));
    BOOST_TEST(pair.one.send(RobotStop{"second"}));
    RobotStop stop;
    for (const char* const words : {"first", "second"}) {
      RawMessage raw;
      BOOST_TEST((pair.two.receive(raw, 1.0) == Received::message));
      decode(raw.payload, stop);
      BOOST_TEST(stop.words == words);
    }
    RawMessage raw;
    BOOST_TEST((pair.two.receive(raw, 0.0) == Received::nothing));
    BOOST_TEST(pair.two.send_as(RobotStop{"reply"}, 99));
    BOOST_TEST((pair.one.receive(raw, 1.0) == Received::message));
    BOOST_TEST(raw.header.sequence == 99u);
  }
}

BOOST_AUTO_TEST_CASE(a_message_in_single_bytes_is_put_together) {
  Pair pair(Address(LinkAddress().text()));
  binary::Bytes bytes;
  encode(bytes, RobotStop{"a few words"}, 5);
  RawMessage raw;
  for (const std::byte byte : bytes.bytes) {
    BOOST_TEST((pair.two.receive(raw, 0.0) == Received::nothing));
    BOOST_TEST(pair.one.send(std::span(&byte, 1), 1.0));
  }
  BOOST_TEST((pair.two.receive(raw, 1.0) == Received::message));
  BOOST_TEST(raw.header.sequence == 5u);
}

BOOST_AUTO_TEST_CASE(a_peer_that_is_gone_is_told_of) {
  Pair pair(Address(LinkAddress().text()));
  pair.one.close();
  RawMessage raw;
  BOOST_TEST((pair.two.receive(raw, 1.0) == Received::closed));
  BOOST_TEST(pair.two.trouble() == "the other side has closed the connection");
  BOOST_TEST(!pair.two.send(RobotStop{"to nobody"}));
}

BOOST_AUTO_TEST_CASE(a_peer_that_does_not_read_is_given_up) {
  Pair pair(Address(LinkAddress().text()));
  const std::string words(4000, 'x');
  int count = 0;
  while (pair.one.send(RobotStop{words}, 0.01)) {
    BOOST_REQUIRE(++count < 10000);
  }
  BOOST_TEST(count > 0);
  BOOST_TEST(pair.one.trouble() == "the other side takes no messages");
}

BOOST_AUTO_TEST_CASE(what_is_no_message_is_refused_with_words) {
  Pair pair(Address(LinkAddress().text()));
  const std::string text = "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n";
  BOOST_TEST(pair.one.send(std::as_bytes(std::span(text)), 1.0));
  RawMessage raw;
  BOOST_TEST((pair.two.receive(raw, 1.0) == Received::refused));
  BOOST_TEST(pair.two.trouble().starts_with("this is no message of Sidestep: it begins with 0x20544547"));
}

BOOST_AUTO_TEST_CASE(states_are_sent_and_received_without_allocation) {
  Pair pair(Address(LinkAddress().text()));
  RobotStateMessage state, back;
  state.q = state.v = state.torque = state.told_position = state.told_velocity = state.told_acceleration =
      Eigen::VectorXd::Ones(7);
  RawMessage raw;
  const auto pass = [&] {
    bool good = pair.one.send(state) && pair.two.receive(raw, 1.0) == Received::message;
    decode(raw.payload, back);
    return good;
  };
  BOOST_TEST(pass());
  bool good = true;
  BOOST_TEST(test::allocations_of([&] {
               for (int k = 0; k < 100; ++k) {
                 good = pass() && good;
               }
             }) == 0u);
  BOOST_TEST(good);
}

BOOST_AUTO_TEST_CASE(addresses_are_read_and_others_refused) {
  BOOST_TEST(Address("tcp:5555").text() == "tcp:127.0.0.1:5555");
  BOOST_TEST(Address("tcp:127.0.0.2:1").text() == "tcp:127.0.0.2:1");
  BOOST_TEST(Address("/tmp/arm.sock").text() == "unix:/tmp/arm.sock");
  BOOST_TEST(Address("left").path == socket_folder() / "left.sock");
  for (const char* const wrong : {"", "tcp:", "tcp:70000", "tcp:-1", "tcp:0.0.0.0:5", "tcp:10.0.0.1:5", "tcp:127.0.0.1.1:5",
                                  "tcp:127.1:5", "a b", "http:5", "unix:", "..", ".hidden"}) {
    BOOST_CHECK_THROW(Address{wrong}, std::invalid_argument);
  }
  BOOST_CHECK_THROW(Address("/" + std::string(200, 'x')), std::invalid_argument);
}

BOOST_AUTO_TEST_CASE(a_socket_that_is_left_is_replaced_and_one_in_use_is_not) {
  const Address address = Address(LinkAddress().text()), left = Address(LinkAddress().text());
  {
    const Listener first(address);
    BOOST_CHECK_THROW(Listener{address}, std::system_error);
    BOOST_TEST((std::filesystem::status(address.path).permissions() ==
                (std::filesystem::perms::owner_read | std::filesystem::perms::owner_write)));
    std::filesystem::create_hard_link(address.path, left.path);  // as a program leaves it that is killed
  }
  BOOST_TEST(!std::filesystem::exists(address.path));
  BOOST_CHECK_THROW(Connection{address}, std::system_error);
  BOOST_TEST(std::filesystem::exists(left.path));
  const Listener second(left);
  BOOST_TEST(Connection(left).is_open());
}

BOOST_AUTO_TEST_CASE(only_the_user_may_enter_the_folder_of_sockets) {
  BOOST_TEST((std::filesystem::status(socket_folder()).permissions() == std::filesystem::perms::owner_all));
}

// Messages from nowhere: random bytes, and messages that were changed, are refused and crash nothing.
#include <boost/test/unit_test.hpp>
#include <random>

#include "sidestep/link/message_table.hpp"
#include "sidestep/link/obstacle_messages.hpp"
#include "sidestep/link/report_messages.hpp"
#include "sidestep/link/request_messages.hpp"
#include "sidestep/link/robot_messages.hpp"
#include "sidestep/link/server.hpp"
#include "sidestep/link/socket.hpp"
#include "support/covered_arm.hpp"
#include "support/link_address.hpp"
#include "support/numbers.hpp"

using namespace sidestep;
using namespace sidestep::link;

namespace {

using Random = std::mt19937;

std::size_t below(Random& random, std::size_t count) {
  return std::uniform_int_distribution<std::size_t>(0, count - 1)(random);
}

template <Message M>
std::vector<std::byte> bytes_of(const M& message) {
  binary::Bytes out;
  encode(out, message, 1);
  return out.bytes;
}

/// Messages with something in every kind of field.
std::vector<std::vector<std::byte>> full_messages() {
  const Eigen::VectorXd q = Eigen::VectorXd::Constant(test::nv, 0.1);
  const Obstacles ball =
      Obstacles(Eigen::Vector3d(0.5, 0.1, 0.2), Eigen::VectorXd::Constant(1, 0.05), Eigen::Vector3d(0.0, 0.1, 0.0))
          .named({"ball"}, {1});
  CycleMessage cycle(test::nv);
  DepthImageMessage image{"front", 1.0, 0.001, 2, 2, DepthImageMessage::Pixel::uint16, {}, std::string(8, '\1')};
  RobotHello hello{"arm", {"a"}, JointLimits::unlimited(1), {ControllerSettings::Output::torque}, 0.001, true, true, "holds"};
  return {bytes_of(SetJointGoal{q, q, q}),
          bytes_of(SetPoseGoal{{PoseTarget{"tip", Eigen::Matrix4d::Identity(), Vector6d::Zero(), true, q, 1.0}}}),
          bytes_of(SetVelocity{q}),
          bytes_of(SetTwist{"tip", Vector6d::Ones(), true, true}),
          bytes_of(SetTrajectory{q.replicate(1, 3), Eigen::Vector3d(1.0, 2.0, 3.0), true}),
          bytes_of(SetObstacles{"camera", 1.0, 1.0, false, ObstacleSet(ball)}),
          bytes_of(AddObstacle{"camera", ObstacleSet(ball)}),
          bytes_of(MoveObstacle{"ball", "camera"}),
          bytes_of(image),
          bytes_of(hello),
          bytes_of(cycle)};
}

/// One to four random changes: bytes, numbers that are no numbers, something cut out or put in.
std::vector<std::byte> changed(std::vector<std::byte> bytes, std::size_t from, Random& random) {
  for (std::size_t k = 1 + below(random, 4); k > 0; --k) {
    if (bytes.size() <= from) {
      break;
    }
    const std::size_t at = from + below(random, bytes.size() - from);
    const auto place = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    switch (below(random, 5)) {
      case 0: *place = static_cast<std::byte>(below(random, 256)); break;
      case 1: *place ^= static_cast<std::byte>(1u << below(random, 8)); break;
      case 2: bytes.erase(place, place + static_cast<std::ptrdiff_t>(1 + below(random, bytes.size() - at))); break;
      case 3: bytes.insert(place, 1 + below(random, 16), static_cast<std::byte>(below(random, 256))); break;
      default:
        for (std::size_t j = at; j < std::min(at + 8, bytes.size()); ++j) {
          bytes[j] = std::byte{0xff};  // not a number, or very many
        }
    }
  }
  return bytes;
}

/// The payload size in the header set right, so that the content is read.
void mend(std::vector<std::byte>& bytes) {
  const auto size = static_cast<std::uint32_t>(bytes.size() - Header::size);
  std::memcpy(bytes.data() + Header::payload_at, &size, sizeof size);
}

}  // namespace

BOOST_AUTO_TEST_CASE(payloads_are_read_or_refused) {
  Random random(20261127);
  std::vector<std::vector<std::byte>> seeds = full_messages();
  for (auto& message : default_messages()) {
    seeds.push_back(std::move(message));
  }
  int read = 0, refused = 0, other = 0;
  const auto try_payload = [&](MessageType type, std::span<const std::byte> payload) {
    try {
      check_payload(type, payload);
      ++read;
    } catch (const std::invalid_argument&) {
      ++refused;
    } catch (...) {
      ++other;
    }
  };
  for (const auto& seed : seeds) {
    const MessageType type = read_header(std::span<const std::byte, Header::size>(seed.data(), Header::size)).type;
    for (int k = 0; k < 400; ++k) {
      const std::vector<std::byte> bytes = changed(seed, Header::size, random);
      try_payload(type, std::span(bytes).subspan(Header::size));
    }
    for (int k = 0; k < 100; ++k) {
      std::vector<std::byte> bytes(below(random, 300));
      std::ranges::generate(bytes, [&] { return static_cast<std::byte>(random()); });
      try_payload(type, bytes);
    }
  }
  BOOST_TEST_MESSAGE(read << " read, " << refused << " refused");
  BOOST_TEST(read > 1000);     // changes of single numbers give other messages
  BOOST_TEST(refused > 5000);  // most break one
  BOOST_TEST(other == 0);
}

BOOST_AUTO_TEST_CASE(headers_are_read_or_refused) {
  Random random(7);
  int read = 0, refused = 0;
  const std::vector<std::byte> good = bytes_of(RobotStop{"a"});
  for (int k = 0; k < 20000; ++k) {
    std::vector<std::byte> bytes = changed(good, 0, random);
    bytes.resize(Header::size);
    try {
      read_header(std::span<const std::byte, Header::size>(bytes.data(), Header::size));
      ++read;
    } catch (const ProtocolError&) {
      ++refused;
    }
  }
  BOOST_TEST(read > 1000);
  BOOST_TEST(refused > 1000);
}

BOOST_AUTO_TEST_CASE(a_server_outlives_what_it_is_sent) {
  Controller controller(test::covered_arm(test::arm_limits(test::nv)));
  controller.set_obstacles(Obstacles::none());
  const test::LinkAddress address;
  Server server(controller, {.address = address.text(), .token = "secret"});
  Random random(11);
  std::vector<std::vector<std::byte>> seeds = full_messages();
  for (auto& message : default_messages()) {
    seeds.push_back(std::move(message));
  }
  const auto answer = [](Connection& connection) {
    RawMessage raw;
    Received received;
    while ((received = connection.receive(raw, 2.0)) == Received::message && raw.header.type != MessageType::done &&
           raw.header.type != MessageType::refused && raw.header.type != MessageType::welcome &&
           raw.header.type != MessageType::explanation) {
    }
    return received == Received::message ? raw.header.type : MessageType::notice;
  };
  Connection good(server.address());
  good.send(Hello{"good", "secret"});
  BOOST_TEST((answer(good) == MessageType::welcome));
  int refused = 0, done = 0;
  for (int k = 0; k < 400; ++k) {
    Connection bad(server.address());
    if (k % 4 == 0) {  // no message at all
      std::vector<std::byte> bytes(1 + below(random, 2000));
      std::ranges::generate(bytes, [&] { return static_cast<std::byte>(random()); });
      bad.send(bytes, 1.0);
    } else {
      bad.send(Hello{"bad", "secret"});
      bad.send(TakeCommand{true, false});
      for (int n = 0; n < 10; ++n) {
        std::vector<std::byte> bytes = changed(seeds[below(random, seeds.size())], Header::size, random);
        if (n < 9) {
          mend(bytes);  // the last one may tear the connection
        }
        bad.send(bytes, 1.0);
      }
      BOOST_TEST((answer(bad) == MessageType::welcome));
      for (int n = 0; n < 10; ++n) {
        const MessageType type = answer(bad);
        refused += type == MessageType::refused;
        done += type == MessageType::done;
      }
    }
    if (k % 50 == 0) {
      good.send(Ping{});
      BOOST_TEST((answer(good) == MessageType::done));
    }
  }
  BOOST_TEST_MESSAGE(done << " done, " << refused << " refused");
  BOOST_TEST(done > 300);
  BOOST_TEST(refused > 1000);
  good.send(Ping{});
  BOOST_TEST((answer(good) == MessageType::done));
  const Command& command = controller.step(Eigen::VectorXd::Zero(test::nv), Eigen::VectorXd::Zero(test::nv));
  BOOST_TEST(command.velocity.allFinite());
}

// Commands on their way: the robot is where they have moved it when the next one arrives.
#include <boost/test/unit_test.hpp>
#include <random>
#include <vector>

#include "sidestep/link/commands_in_flight.hpp"

using namespace sidestep::link;

namespace {

constexpr double period = 0.001;

Eigen::VectorXd value(double x) { return Eigen::VectorXd::Constant(1, x); }

}  // namespace

BOOST_AUTO_TEST_CASE(without_delay_a_state_stays_as_it_is) {
  CommandsInFlight commands(1, period);
  for (std::uint64_t cycle = 1; cycle < 50; ++cycle) {
    Eigen::VectorXd q = value(0.3), v = value(0.2);
    if (cycle > 1) {
      commands.taken(cycle - 1, cycle - 1);  // applied in the cycle that it answers
    }
    BOOST_TEST(commands.predict(cycle, q, v) == 0);
    BOOST_TEST(q[0] == 0.3);
    BOOST_TEST(v[0] == 0.2);
    commands.sent(cycle, cycle, value(5.0));
  }
  BOOST_TEST(commands.delay() == 0.0);
}

BOOST_AUTO_TEST_CASE(with_a_fixed_delay_the_prediction_is_exact) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> draw(-5.0, 5.0);
  for (const std::uint64_t there : {0u, 2u, 5u}) {   // cycles from the driver to the robot
    for (const std::uint64_t back : {0u, 1u, 4u}) {  // and back
      CommandsInFlight commands(1, period);
      constexpr std::uint64_t cycles = 200;
      std::vector<double> q(cycles + 1, 0.1), v(cycles + 1, -0.2), sent(cycles, 0.0);
      double largest = 0.0;
      std::vector<std::pair<std::uint64_t, Eigen::Vector2d>> predicted;
      for (std::uint64_t now = 0; now < cycles; ++now) {
        if (now >= back) {  // the state of `seen` arrives
          const std::uint64_t seen = now - back;
          const std::uint64_t answered = seen - 1 - (there + back);  // by the newest command that moved it before
          if (seen > there + back) {
            commands.taken(answered + 1, answered + there + back);
          }
          Eigen::VectorXd at = value(q[seen]), speed = value(v[seen]);
          const int ahead = commands.predict(seen, at, speed);
          if (seen > 2 * (there + back)) {
            BOOST_TEST(ahead == static_cast<int>(there + back));
            predicted.emplace_back(seen + there + back, Eigen::Vector2d(at[0], speed[0]));
          }
          sent[seen] = draw(random);
          commands.sent(seen + 1, seen, value(sent[seen]));
        }
        const double a = now >= there + back ? sent[now - there - back] : 0.0;
        v[now + 1] = v[now] + period * a;
        q[now + 1] = q[now] + period * v[now + 1];
      }
      for (const auto& [cycle, state] : predicted) {
        if (cycle <= cycles) {
          largest = std::max({largest, std::abs(state[0] - q[cycle]), std::abs(state[1] - v[cycle])});
        }
      }
      BOOST_TEST(predicted.size() > 100u);
      BOOST_TEST(largest < 1e-12);  // rounding
    }
  }
}

BOOST_AUTO_TEST_CASE(a_delay_that_changes_is_learned) {
  CommandsInFlight commands(1, period);
  for (std::uint64_t cycle = 20; cycle < 200; ++cycle) {
    const std::uint64_t delay = cycle < 100 ? 8 : 2;
    commands.taken(cycle - delay, cycle);
    if (cycle == 99 || cycle == 199) {
      Eigen::VectorXd q = value(0.0), v = value(0.0);
      BOOST_TEST(commands.predict(cycle, q, v) == static_cast<int>(delay));
    }
    commands.sent(cycle, cycle, value(1.0));
  }
}

BOOST_AUTO_TEST_CASE(more_than_fit_are_forgotten_and_clear_forgets_all) {
  CommandsInFlight commands(1, period);
  for (std::uint64_t k = 1; k <= 3 * CommandsInFlight::most; ++k) {
    commands.sent(k, k, value(1.0));
  }
  commands.taken(3 * CommandsInFlight::most, 3 * CommandsInFlight::most + 4);
  BOOST_TEST(commands.delay() == 4.0);
  commands.clear();
  Eigen::VectorXd q = value(0.0), v = value(1.0);
  BOOST_TEST(commands.predict(7, q, v) == 0);
  BOOST_TEST(q[0] == 0.0);
}

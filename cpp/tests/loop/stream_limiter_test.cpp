// A stream of commands that the robot accepts, also after cycles that it went through alone.
#include "sidestep/loop/stream_limiter.hpp"

#include <boost/test/unit_test.hpp>
#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include "support/allocations.hpp"

using namespace sidestep;
using Eigen::VectorXd;

namespace {

constexpr double T = 0.001;

// One joint of a Franka Research 3: its first.
StreamLimits franka_joint() {
  const auto one = [](double value) { return VectorXd::Constant(1, value); };
  return {{one(-2.75), one(2.75), one(2.62), one(10.0), one(87.0), one(5000.0), one(1000.0)}, one(6.0), one(0.3)};
}

// What a robot goes on from, in one joint; and whether it accepts a next position: the judge, with its own arithmetic.
struct Judge {
  double p = 0.0, v = 0.0, a = 0.0;

  static double most_speed(double at) {
    return std::min(2.62, std::max(0.0, std::sqrt(12.0 * std::max(0.0, 2.75 - at)) - 0.3));
  }
  bool accept(double next) {
    const double v_next = (next - p) / T, a_next = (v_next - v) / T, jerk = (a_next - a) / T;
    constexpr double rounding = 1e-9;  // of differences, over a period [rad/s]
    const bool good = std::abs(jerk) <= 5000.0 && std::abs(a_next) <= 10.0 && v_next <= most_speed(p) + rounding &&
                      v_next >= -most_speed(-p) - rounding;
    p = next, v = v_next, a = a_next;
    return good;
  }
  void go_on() {
    v += T * a;
    p += T * v;
  }
};

struct Point {
  VectorXd position, velocity, acceleration;
};

// Rounded to single precision, as the robot says it.
Point told_by(const Judge& judge) {
  const auto one = [](double value) { return VectorXd::Constant(1, static_cast<float>(value)); };
  return {one(judge.p), one(judge.v), one(judge.a)};
}

// A swing of 0.5 rad that uses 0.8 of the acceleration and of the velocity, integrated as a controller's reference is.
class Swing {
 public:
  const Point& next() {
    constexpr double w = 4.0;
    point_.acceleration[0] = 8.0 * std::cos(w * time_) * std::min(1.0, time_ / 0.1);
    point_.velocity += T * point_.acceleration;
    point_.position += T * point_.velocity;
    time_ += T;
    return point_;
  }

 private:
  double time_ = 0.0;
  Point point_{VectorXd::Zero(1), VectorXd::Zero(1), VectorXd::Zero(1)};
};

struct Ended {
  int accepted = 0, refused = 0;
  double farthest = 0.0, error = 0.0;  // from the swing: in all [rad], and at the end
};

// 3 s of a swing, of which 1 % of the cycles begin a gap of 2 to 10; none in the last 0.5 s.
Ended swing_with_gaps(unsigned seed, bool limited) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> chance(0.0, 1.0);
  std::uniform_int_distribution<int> length(2, 10);
  StreamLimiter limiter(franka_joint(), T);
  Judge judge;
  Swing swing;
  Ended ended;
  limiter.begin(VectorXd::Zero(1), VectorXd::Zero(1));
  for (int k = 0; k < 3000; ++k) {
    if (k > 100 && k < 2500 && chance(random) < 0.01) {
      for (int lost = length(random); lost > 0; --lost, ++k) {
        judge.go_on();
        swing.next();
      }
    }
    const Point told = told_by(judge), &wanted = swing.next();
    const double sent = limited ? limiter.limit_positions({told.position, told.velocity, told.acceleration},
                                                          {wanted.position, wanted.velocity, wanted.acceleration})[0]
                                : wanted.position[0];
    ++(judge.accept(sent) ? ended.accepted : ended.refused);
    ended.error = std::abs(judge.p - wanted.position[0]);
    ended.farthest = std::max(ended.farthest, ended.error);
  }
  return ended;
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_stream_within_the_limits_is_sent_as_it_is) {
  StreamLimiter limiter(franka_joint(), T);
  Judge judge;
  Swing swing;
  limiter.begin(VectorXd::Zero(1), VectorXd::Zero(1));
  double change = 0.0;
  for (int k = 0; k < 3000; ++k) {
    const Point told = told_by(judge), &wanted = swing.next();
    judge.accept(limiter.limit_positions({told.position, told.velocity, told.acceleration},
                                         {wanted.position, wanted.velocity, wanted.acceleration})[0]);
    change = std::max(change, limiter.change());
  }
  BOOST_TEST(change < 1e-12);  // rounding of 3,000 sums
}

BOOST_AUTO_TEST_CASE(positions_after_lost_cycles_are_accepted_and_come_back) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    const Ended ended = swing_with_gaps(seed, true);
    BOOST_TEST_CONTEXT("seed " << seed) {
      BOOST_TEST(ended.refused == 0);
      BOOST_TEST(ended.farthest > 1e-6);  // there were gaps
      BOOST_TEST(ended.farthest < 2e-3);
      BOOST_TEST(ended.error < 1e-6);
    }
  }
  BOOST_TEST(swing_with_gaps(0, false).refused > 0);  // the judge can refuse
}

BOOST_AUTO_TEST_CASE(a_step_of_the_wanted_position_becomes_a_motion_within_the_limits) {
  StreamLimiter limiter(franka_joint(), T);
  Judge judge;
  const VectorXd zero = VectorXd::Zero(1), goal = VectorXd::Constant(1, 0.5);
  limiter.begin(zero, zero);
  int refused = 0;
  for (int k = 0; k < 2000; ++k) {
    const Point told = told_by(judge);
    refused += !judge.accept(limiter.limit_positions({told.position, told.velocity, told.acceleration}, {goal, zero, zero})[0]);
  }
  BOOST_TEST(refused == 0);
  BOOST_TEST(std::abs(judge.p - 0.5) < 1e-6);
}

BOOST_AUTO_TEST_CASE(speed_falls_towards_the_end_of_a_joint) {
  StreamLimiter limiter(franka_joint(), T);
  Judge judge;
  const VectorXd zero = VectorXd::Zero(1);
  VectorXd position = zero, velocity = zero;
  limiter.begin(zero, zero);
  int refused = 0;
  double fastest = 0.0;
  for (int k = 0; k < 4000; ++k) {  // what is wanted accelerates at 5 rad/s² to 2.4 rad/s and goes on through the end
    const VectorXd acceleration = VectorXd::Constant(1, velocity[0] < 2.4 ? 5.0 : 0.0);
    velocity += T * acceleration;
    position += T * velocity;
    const Point told = told_by(judge);
    refused += !judge.accept(
        limiter.limit_positions({told.position, told.velocity, told.acceleration}, {position, velocity, acceleration})[0]);
    fastest = std::max(fastest, judge.v);
  }
  BOOST_TEST(refused == 0);
  BOOST_TEST(fastest > 2.3);
  BOOST_TEST(judge.p < 2.75);
  BOOST_TEST(judge.p > 2.7);
}

BOOST_AUTO_TEST_CASE(velocities_change_within_acceleration_and_jerk) {
  StreamLimiter limiter(franka_joint(), T);
  const VectorXd zero = VectorXd::Zero(1), wanted = VectorXd::Constant(1, 1.0), unknown = VectorXd::Constant(1, NAN);
  limiter.begin(zero, zero);
  double v = 0.0, a = 0.0, largest_a = 0.0, largest_jerk = 0.0, highest = 0.0;
  for (int k = 0; k < 300; ++k) {
    const double next = limiter.limit_velocities({unknown, unknown, unknown}, {unknown, wanted, zero})[0],
                 a_next = (next - v) / T;
    largest_jerk = std::max(largest_jerk, std::abs(a_next - a) / T);
    v = next, a = a_next;
    largest_a = std::max(largest_a, std::abs(a));
    highest = std::max(highest, v);
  }
  BOOST_TEST(largest_a <= 9.5 + 1e-9);  // 0.95 of 10
  BOOST_TEST(largest_a > 9.4);
  BOOST_TEST(largest_jerk <= 4750.0 + 1e-6);  // 0.95 of 5,000
  BOOST_TEST(highest < 1.0 + 1e-9);           // no overshoot
  BOOST_TEST(std::abs(v - 1.0) < 1e-9);
  // A robot that went on for 10 cycles at 9 rad/s²: the next command goes on from there, not from what was sent.
  const VectorXd fast = VectorXd::Constant(1, 1.09), nine = VectorXd::Constant(1, 9.0);
  const double next = limiter.limit_velocities({unknown, fast, nine}, {unknown, wanted, zero})[0];
  BOOST_TEST(next == 1.09 + T * (9.0 - 4.75), boost::test_tools::tolerance(1e-12));
}

BOOST_AUTO_TEST_CASE(torques_change_within_their_rate_from_what_the_robot_holds) {
  StreamLimiter limiter(franka_joint(), T);
  const VectorXd zero = VectorXd::Zero(1), five = VectorXd::Constant(1, 5.0), unknown = VectorXd::Constant(1, NAN);
  limiter.begin(zero, zero);
  BOOST_TEST(limiter.limit_torques(unknown, five)[0] == 0.95, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(limiter.change() == 4.05, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(limiter.limit_torques(unknown, five)[0] == 1.90, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(limiter.limit_torques(VectorXd::Constant(1, 4.5), five)[0] == 5.0);  // it holds another than was sent
  BOOST_TEST(limiter.limit_torques(VectorXd::Constant(1, 4.5), VectorXd::Constant(1, 9.0))[0] == 5.45,
             boost::test_tools::tolerance(1e-12));  // 5 may be on its way
  BOOST_TEST(limiter.limit_torques(VectorXd::Constant(1, 86.8), VectorXd::Constant(1, 90.0))[0] == 87.0);
}

BOOST_AUTO_TEST_CASE(limiting_allocates_nothing) {
  StreamLimiter limiter(franka_joint(), T);
  const VectorXd zero = VectorXd::Zero(1), wanted = VectorXd::Constant(1, 1.0);
  const std::size_t allocations = test::allocations_of([&] {
    limiter.begin(zero, zero);
    limiter.limit_positions({zero, zero, zero}, {wanted, zero, zero});
    limiter.limit_velocities({zero, zero, zero}, {zero, wanted, zero});
    limiter.limit_torques(zero, wanted);
  });
  BOOST_TEST(allocations == 0u);
}

BOOST_AUTO_TEST_CASE(limits_that_cannot_be_are_refused_by_name) {
  const auto says = [](const char* words) {
    return [words](const std::invalid_argument& error) { return std::string(error.what()).find(words) != std::string::npos; };
  };
  StreamLimits limits = franka_joint();
  limits.joints.jerk = VectorXd();
  BOOST_CHECK_EXCEPTION(StreamLimiter(limits, T), std::invalid_argument, says("jerk has 0 entries, allowed: 1"));
  limits = franka_joint();
  limits.joints.acceleration[0] = -1.0;
  BOOST_CHECK_EXCEPTION(StreamLimiter(limits, T), std::invalid_argument, says("acceleration is -1"));
  limits = franka_joint();
  limits.margin = 1.0;
  BOOST_CHECK_EXCEPTION(StreamLimiter(limits, T), std::invalid_argument, says("margin is 1"));
  BOOST_CHECK_EXCEPTION(StreamLimiter(franka_joint(), 0.0), std::invalid_argument, says("period is 0"));
}

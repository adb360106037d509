// When a torque that nothing explains is a touch: alone, sample by sample.
#include <boost/test/unit_test.hpp>
#include <cmath>

#include "../../src/controller/touch_judge.hpp"
#include "support/numbers.hpp"
#include "support/repeatable_settings.hpp"
#include "support/serial_arm.hpp"

using namespace sidestep;
using Output = ControllerSettings::Output;

namespace {

constexpr double felt_period = 0.001;  // [s]

JointLimits felt_limits() {
  JointLimits limits = test::arm_limits(2);
  limits.effort << 100.0, 20.0;
  return limits;
}

/// The stage with an arm of two joints, of which nothing but M is known: 2 and 0.1 kg m².
struct Feeling {
  explicit Feeling(ContactSettings contact = {.share = 0.25, .time = 0.01}, bool judges = true)
      : settings(test::repeatable_settings(Output::torque)),
        robot(test::serial_arm(felt_limits())),
        joints(robot),
        judge((settings.contact = contact, robot), joints, settings, judges) {}

  /// A period with the acceleration a, in which d acts beside the torque.
  bool move(const Eigen::Vector2d& a, const Eigen::Vector2d& d) {
    v += felt_period * a;
    q += felt_period * v;
    torque = mass * a - d;
    return feel();
  }
  bool feel(bool bridged = false, bool late = false) {
    const bool touches = judge.judge({q, v, settings.period, begins, bridged, late}, {torque, mass, bias});
    begins = false;
    return touches;
  }
  /// Periods of rest until a touch; -1: none in a second.
  int rest_until_touch(const Eigen::Vector2d& d) {
    for (int k = 1; k <= 1000; ++k) {
      if (move(Eigen::Vector2d::Zero(), d)) {
        return k;
      }
    }
    return -1;
  }
  /// The begin of a motion, in which d is load.
  void begin(const Eigen::Vector2d& d = Eigen::Vector2d::Zero()) {
    begins = true;
    for (int k = 0; k < 100; ++k) {
      BOOST_TEST(!move(Eigen::Vector2d::Zero(), d));
    }
  }
  /// A swing of both joints by 2 rad and back, in which d(q, v) acts: whether it counts as a touch.
  template <class Disturbance>
  bool swings(Disturbance&& d, int periods = 3142) {
    for (int k = 0; k < periods; ++k) {
      const double w = 2.0, t = felt_period * k;
      if (move(Eigen::Vector2d::Constant(w * w * std::cos(w * t)), d(q, v))) {
        return true;
      }
    }
    return false;
  }

  ControllerSettings settings;
  const Robot robot;
  const JointKinds joints;
  TouchJudge judge;
  Eigen::VectorXd q = Eigen::Vector2d::Zero(), v = q, torque = q, bias = q;
  Eigen::MatrixXd mass = Eigen::Vector2d(2.0, 0.1).asDiagonal();
  bool begins = true;
};

}  // namespace

BOOST_AUTO_TEST_CASE(a_torque_beyond_its_share_of_the_effort_limit_is_a_touch_after_its_time) {
  Feeling f;
  f.begin();
  BOOST_TEST(f.rest_until_touch({24.0, 4.9}) == -1);
  // Half of the limit, filtered by 0.9 in each period, is beyond a quarter from the 7th on, and lasts for ten.
  BOOST_TEST(f.rest_until_touch({0.0, -10.0}) > 0);
  Feeling g;
  g.begin();
  BOOST_TEST(g.rest_until_touch({50.0, 0.0}) == 16);
  BOOST_TEST(g.judge.is_touched());
  const double felt = 50.0 * (1.0 - std::pow(0.9, 16));
  BOOST_TEST(felt > 40.7);
  BOOST_TEST(felt < 40.8);
  BOOST_TEST(
      g.judge.explain() ==
      "waiting: joint 'joint1' feels 40.7 Nm that nothing explains (allowed: 25.0): the arm touched something, or a load is "
      "not told; call restart() to go on");
  BOOST_TEST((g.judge.resistance() == Eigen::Vector2d(12.5, 2.5)));
}

BOOST_AUTO_TEST_CASE(a_touch_is_told_once_and_stays_until_it_is_released) {
  Feeling f;
  f.begin();
  BOOST_TEST(f.rest_until_touch({50.0, 0.0}) == 16);
  BOOST_TEST(f.rest_until_touch({50.0, 0.0}) == -1);
  BOOST_TEST(f.judge.is_touched());
  f.judge.release();
  BOOST_TEST(!f.judge.is_touched());
  f.begin({50.0, 0.0});  // what is there at the begin is load
  BOOST_TEST((f.judge.explained_load() - Eigen::Vector2d(50.0, 0.0)).norm() < 0.01 * 50.0);  // five filters long: to 1 %
  BOOST_TEST(f.rest_until_touch({50.0, 0.0}) == -1);
  BOOST_TEST(f.rest_until_touch({0.0, 0.0}) == 16);  // and it is missed where it is gone
}

BOOST_AUTO_TEST_CASE(payload_and_friction_are_explained_as_the_arm_moves) {
  Feeling loaded;
  loaded.begin({-40.0, 0.0});
  BOOST_TEST(!loaded.swings([](const Eigen::VectorXd& q, const Eigen::VectorXd&) {
    return Eigen::Vector2d(-40.0 * std::cos(q[0]), 5.0 * std::sin(q[1]));  // up to 40 % of the limit within 1 rad
  }));
  Feeling rubbing;
  rubbing.begin();
  const auto friction = [](const Eigen::VectorXd&, const Eigen::VectorXd& v) {
    return Eigen::Vector2d(-20.0 * std::tanh(v[0] / 0.01), -3.0 * std::tanh(v[1] / 0.01));
  };
  BOOST_TEST(!rubbing.swings(friction));
  rubbing.v
      .setZero();  // The swing ends at rest: friction of 3 Nm is known by now, and counts as an error of the model beside the share.
  BOOST_TEST(rubbing.rest_until_touch({0.0, 6.0}) == -1);
  BOOST_TEST(rubbing.rest_until_touch({0.0, 12.0}) > 0);
}

BOOST_AUTO_TEST_CASE(an_arm_that_is_held_learns_nothing_however_slowly_the_torque_grows) {
  Feeling f;
  f.begin();
  int k = 0;
  while (k < 4000 && !f.move(Eigen::Vector2d::Zero(), {0.01 * k, 0.0})) {  // 10 Nm/s
    ++k;
  }
  BOOST_TEST(k > 2500);  // 25 Nm, and 10 ms of filter and 10 ms of time later
  BOOST_TEST(k < 2525);
  BOOST_TEST(f.judge.explained_load().norm() == 0.0);
}

BOOST_AUTO_TEST_CASE(one_joint_that_moves_says_little_of_another_that_it_does_not_move) {
  Feeling f;
  f.begin();
  for (int k = 0; k < 200; ++k) {  // 0.2 rad of the light joint, without inertia in common
    f.v[1] = 1.0;
    BOOST_TEST(!f.move(Eigen::Vector2d::Zero(), {20.0, 0.0}));
  }
  BOOST_TEST(f.judge.explained_load()[0] == 0.0);
}

BOOST_AUTO_TEST_CASE(faults_of_measurement_are_no_touch) {
  const Eigen::Vector2d rest = Eigen::Vector2d::Zero();
  Feeling spiked;
  spiked.begin();
  spiked.v[0] = 3.0;  // one velocity: 6000 Nm for a period and as much back
  BOOST_TEST(!spiked.feel());
  spiked.v[0] = 0.0;
  BOOST_TEST(spiked.rest_until_touch(rest) == -1);

  Feeling late;  // a quarter of a second in one period
  late.begin();
  late.v = Eigen::Vector2d(0.5, 0.5);
  late.q += 0.25 * late.v;
  BOOST_TEST(!late.feel());
  BOOST_TEST(late.rest_until_touch(rest) == -1);

  Feeling frozen;  // 80 Nm accelerate it meanwhile
  frozen.begin();
  BOOST_TEST(!frozen.move({0.05, 0.0}, rest));
  frozen.torque[0] = 80.0;
  for (int k = 0; k < 50; ++k) {
    BOOST_TEST(!frozen.feel());
  }
  frozen.v[0] += 2.0;
  BOOST_TEST(frozen.rest_until_touch(rest) == -1);

  Feeling bridged;
  bridged.begin();
  bridged.torque[0] = 80.0;
  for (int k = 0; k < 50; ++k) {
    BOOST_TEST(!bridged.feel(true));
  }
  BOOST_TEST(bridged.rest_until_touch(rest) == -1);

  Feeling held_up;  // a loop that is held up now and then leads the arm back by itself
  held_up.begin();
  for (int k = 0; k < 200; ++k) {
    held_up.torque[0] = k % 20 < 5 ? 80.0 : 0.0;
    BOOST_TEST(!held_up.feel(false, k % 20 == 0));
  }
  BOOST_TEST(held_up.rest_until_touch(rest) == -1);

  Feeling unknown;  // neither poisons what follows
  unknown.begin();
  unknown.mass(0, 0) = test::infinity - test::infinity;
  BOOST_TEST(unknown.rest_until_touch({50.0, 0.0}) == -1);
  unknown.mass(0, 0) = 2.0;
  BOOST_TEST(unknown.rest_until_touch({50.0, 0.0}) == 16);
}

BOOST_AUTO_TEST_CASE(without_a_share_or_a_judge_nothing_is_a_touch) {
  Feeling off(ContactSettings{.share = test::infinity});
  off.begin();
  BOOST_TEST(off.rest_until_touch({90.0, 19.0}) == -1);
  Feeling not_judged(ContactSettings{}, false);
  not_judged.begin();
  BOOST_TEST(not_judged.rest_until_touch({90.0, 19.0}) == -1);
  Feeling slow(ContactSettings{.share = 0.25, .time = 0.1});
  slow.begin();
  BOOST_TEST(slow.rest_until_touch({50.0, 0.0}) == 106);
}

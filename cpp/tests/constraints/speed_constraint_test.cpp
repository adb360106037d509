// Rows of Cartesian speed against differences of speeds, and what they give way to.
#include "sidestep/constraints/speed_constraint.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <stdexcept>
#include <string>

#include "sidestep/constraints/motion_program.hpp"
#include "support/allocations.hpp"
#include "support/covered_arm.hpp"
#include "support/numbers.hpp"
#include "support/random.hpp"
#include "support/without_torque.hpp"

using namespace sidestep;
using test::nv;

namespace {

constexpr double speed_period = 0.001;

/// The speed of a frame's origin.
double speed_of(const Robot& robot, int frame, const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
  KinematicState state(robot);
  state.update(robot, q, v);
  return (frame_jacobian(robot, state, frame).topRows(3) * v).norm();
}

/// The rows of a speed constraint alone.
struct SpeedRows {
  explicit SpeedRows(const Robot& robot)
      : constraint(robot), rows(constraint.max_rows(), nv, constraint.priority()), bounds(nv) {}

  void update(const KinematicState& state, const JointLimits& limits, double limit, double next_limit) noexcept {
    rows.clear();
    const SpeedLimitNow speed{&state, &limits.acceleration, limit, next_limit};
    constraint.append(
        {speed_period, 1.0, 0.0, speed_period, state.v(), state.v(), nullptr, nullptr, 1.0, false, {}, nullptr, {}, speed, {}},
        bounds, rows);
  }
  SpeedConstraint constraint;
  RowBlock rows;
  Bounds bounds;
};

/// What row k says of the change of its frame's speed: d|ṗ|/dt = n·J a + n·J̇ v, the latter where it stops nothing.
double change_of(const RowBlock& rows, int k, const Eigen::VectorXd& a, double speed, double limit) {
  const double bias = 50.0 * (0.98 * limit - speed) - rows.lengths[k] * rows.upper[k];
  return rows.lengths[k] * rows.normals.row(k).dot(a.transpose()) + bias;
}

}  // namespace

BOOST_AUTO_TEST_CASE(rows_are_the_change_of_the_speed_of_every_frame_that_moves) {
  const Robot robot = test::covered_arm(test::arm_limits(nv)).robot();
  SpeedRows speed(robot);
  const RowBlock& rows = speed.rows;
  test::Random random(3);
  KinematicState state(robot);
  for (int k = 0; k < 50; ++k) {
    const Eigen::VectorXd q = random.vector(nv), v = random.vector(nv), a = 5.0 * random.vector(nv);
    state.update(robot, q, v);
    const double limit = 100.0, h = 1e-5;
    BOOST_TEST(test::allocations_of([&] { speed.update(state, robot.limits(), limit, limit); }) == 0U);
    BOOST_TEST(rows.size >= nv - 2);  // the first links turn in place
    double fastest = 0.0;
    for (int i = 0; i < rows.size; ++i) {
      const int frame = speed.constraint.frames()[static_cast<std::size_t>(i)];
      const double speed = speed_of(robot, frame, q, v);
      const Eigen::VectorXd drift = 0.5 * h * h * a;
      const double change =
          (speed_of(robot, frame, q + h * v + drift, v + h * a) - speed_of(robot, frame, q - h * v + drift, v - h * a)) /
          (2.0 * h);
      BOOST_TEST(std::abs(change_of(rows, i, a, speed, limit) - change) < 1e-5 * (1.0 + std::abs(change)));
      BOOST_TEST(std::abs(rows.normals.row(i).norm() - 1.0) < 1e-12);
      fastest = std::max(fastest, speed);
    }
    BOOST_TEST(std::abs(FrameSpeeds(robot).fastest(state).speed - fastest) < 1e-12);
  }
}

BOOST_AUTO_TEST_CASE(rows_ask_for_no_more_than_a_stop_along_the_path) {
  const Robot robot = test::covered_arm(test::arm_limits(nv)).robot();
  SpeedRows speed(robot);
  const RowBlock& rows = speed.rows;
  test::Random random(5);
  KinematicState state(robot);
  for (int k = 0; k < 50; ++k) {
    const Eigen::VectorXd q = random.vector(nv), v = random.vector(nv);
    state.update(robot, q, v);
    speed.update(state, robot.limits(), 0.05, 0.0);  // far exceeded, and falling
    const Eigen::VectorXd stop = -v * (robot.limits().acceleration.cwiseQuotient(v.cwiseAbs()).minCoeff());
    BOOST_TEST(rows.size > 0);
    for (int i = 0; i < rows.size; ++i) {
      BOOST_TEST(rows.normals.row(i).dot(stop.transpose()) <= rows.upper[i] + 1e-9);
    }
  }
}

BOOST_AUTO_TEST_CASE(the_allowed_speed_leaves_one_deceleration_along_the_way) {
  const SpeedLimitSettings limits;
  BOOST_TEST(limits.allowed(0.0) == 0.25);
  BOOST_TEST(limits.allowed(0.1) == 0.25);
  BOOST_TEST(std::abs(limits.allowed(1.0) - 1.5) < 1e-12);
  BOOST_TEST(std::abs(limits.allowed(test::infinity) - 1.5) < 1e-12);
  for (double d = 0.15; d < 1.0; d += 0.05) {
    const double slope = (limits.allowed(d + 1e-6) - limits.allowed(d - 1e-6)) / 2e-6;
    BOOST_TEST(std::abs(slope * limits.allowed(d) - (1.5 * 1.5 - 0.25 * 0.25) / 1.8) < 1e-6);
  }
}

BOOST_AUTO_TEST_CASE(speed_gives_way_to_clearances_and_says_so) {
  const Robot robot = test::covered_arm(test::arm_limits(nv)).robot();
  MotionProgramSettings settings = test::without_torque();
  settings.limits_speed = true;
  MotionProgram filter(robot, settings);
  MotionSolution solution(nv);
  Eigen::VectorXd q = Eigen::VectorXd::Zero(nv), v = q;
  q[3] = 1.2;
  v[0] = 1.0;  // the tip moves by this times its distance from the first axis
  KinematicState state(robot);
  state.update(robot, q, v);
  const FrameSpeeds::Fastest fastest = FrameSpeeds(robot).fastest(state);
  const SpeedLimitNow speed{&state, &robot.limits().acceleration, fastest.speed, fastest.speed};
  const Eigen::VectorXd wanted = 5.0 * Eigen::VectorXd::Unit(nv, 0);
  BOOST_TEST((filter.solve({.q = q, .v = v, .acceleration = wanted, .speed = speed}, solution) == ProgramStatus::limited));
  BOOST_TEST(solution.speed_frame == fastest.frame);
  BOOST_TEST(solution.speed_slack == 0.0);
  const auto speed_after = [&] {
    return speed_of(robot, fastest.frame, q + speed_period * v, v + speed_period * solution.acceleration);
  };
  BOOST_TEST(speed_after() <= fastest.speed);
  BOOST_TEST((filter.solve({.q = q, .v = v, .acceleration = wanted}, solution) == ProgramStatus::ok));
  BOOST_TEST(speed_after() > fastest.speed + 1e-3);

  Clearances clearances(nv, 1);  // what comes at 1 m/s asks for a faster turn of the first joint
  clearances.nearest[0] = 0;
  clearances.values[0] = clearances.least[0] = 0.01;
  clearances.gradients(0, 0) = 0.5;
  clearances.rates[0] = -1.0;
  clearances.mind_nearest();
  BOOST_TEST((filter.solve({.q = q, .v = v, .acceleration = wanted, .clearances = &clearances, .speed = speed}, solution) ==
              ProgramStatus::relaxed));
  BOOST_TEST(solution.speed_slack > 1.0);
  BOOST_TEST(solution.speed_frame >= 0);
  BOOST_TEST(std::abs(solution.acceleration[0] - robot.limits().acceleration[0]) < 1e-6);
}

BOOST_AUTO_TEST_CASE(limits_that_do_not_go_together_are_refused) {
  const auto message = [](const SpeedLimitSettings& limits) -> std::string {
    try {
      limits.validate();
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  BOOST_TEST(message({}) == "");
  BOOST_TEST(message({2.0, 0.1, 1.5, 1.0}).find("near_speed is 2") != std::string::npos);
  BOOST_TEST(message({0.25, 1.0, 1.5, 1.0}).find("near_distance is 1") != std::string::npos);
  BOOST_TEST(message({0.0, 0.1, 1.5, 1.0}).find("allowed: 0.02 to 10 m/s") != std::string::npos);
}

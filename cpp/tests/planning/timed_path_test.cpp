// The reference on a timed path: speeds near obstacles, waiting for the arm, narrow places.
#include "sidestep/planning/timed_path.hpp"

#include <boost/test/unit_test.hpp>

#include "support/allocations.hpp"
#include "support/planar_arm.hpp"

using namespace sidestep;

namespace {

const ClearanceQuery body = test::planar_arm_body();
const TimedPathSettings settings;

Obstacles balls(const Eigen::Matrix3Xd& points) {
  return Obstacles(points, Eigen::VectorXd::Constant(points.cols(), 0.02), Eigen::Matrix3Xd::Zero(3, points.cols()));
}

Eigen::MatrixXd line() {
  Eigen::MatrixXd path(2, 2);
  path << 0.0, 2.0, 0.0, 0.0;
  return path;
}

TimedPath route_of(const Eigen::MatrixXd& path, const Obstacles& obstacles, const Eigen::Vector2d& v = Eigen::Vector2d::Zero(),
                   bool measured = true) {
  ClearanceQuery::Workspace w(body);
  return make_route(RoundedPath(path, body, obstacles, Margins{}, w), v, body, obstacles, settings, SafetySettings{}, w,
                    measured);
}

}  // namespace

BOOST_AUTO_TEST_CASE(joints_use_their_share_of_the_limits) {
  JointLimits given = JointLimits::unlimited(2);
  given.velocity[0] = 3.0;
  given.acceleration[0] = 7.0;
  given.jerk = Eigen::Vector2d(700.0, std::numeric_limits<double>::infinity());
  const PathLimits limits = path_limits(given, 0.5);
  BOOST_TEST(limits.velocity[0] == 0.95 * 1.5, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(limits.acceleration[0] == 0.95 * 3.5, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(limits.jerk[0] == 0.88 * 700.0, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(limits.velocity[1] == 0.95, boost::test_tools::tolerance(1e-12));  // without limits
  BOOST_TEST(limits.acceleration[1] == 4.75, boost::test_tools::tolerance(1e-12));
}

BOOST_AUTO_TEST_CASE(no_joint_moves_on_for_long_while_it_stops) {
  JointLimits given = JointLimits::unlimited(2);
  given.velocity = Eigen::Vector2d(7.854, 2.0);  // of a wrist that takes 0.8 s to stop, and of one that does not
  given.acceleration.setConstant(10.0);
  const PathLimits limits = path_limits(given, 1.0);
  const Eigen::Array2d way = 0.5 * limits.velocity.array().square() / limits.acceleration.array();
  BOOST_TEST(way[0] == 1.5, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(limits.velocity[1] == 0.95 * 2.0, boost::test_tools::tolerance(1e-12));
}

BOOST_AUTO_TEST_CASE(a_clearance_closes_no_faster_than_clearance_constraints_let_it) {
  ClearanceQuery::Workspace w(body);
  Eigen::MatrixXd path(2, 2);
  path << 0.0, 0.83, 0.0, 0.0;  // towards a ball beside the way, which is 1.6 cm off the ends of the links there
  const Obstacles obstacles = balls(Eigen::Vector3d(0.4 * std::cos(1.0), 0.4 * std::sin(1.0), 0.0));
  const TimedPath route = route_of(path, obstacles), free = route_of(path, Obstacles::none());
  BOOST_TEST(route.duration() > free.duration() + 0.02);
  const SafetySettings safety;
  const double A = safety.braking_fraction * route.limits.acceleration[0];  // times |dh/ds|, beside h'
  for (Eigen::Index k = 1; k + 1 < route.motion.station.size(); ++k) {
    const double h = body.nearest(route.motion.q.col(k), obstacles, 1.0, w).clearance;
    const double slope = (body.nearest(route.motion.q.col(k - 1), obstacles, 1.0, w).clearance - h) /
                         std::max(1e-12, route.motion.station[k] - route.motion.station[k - 1]);
    if (h < 0.1 && slope > 0.05) {
      const double u = slope * route.motion.v(0, k), distance_left = h - safety.margin, most = A * slope;
      const double needed =
          u <= most / safety.rate ? u / safety.rate : 0.5 * (u * u / most + most / (safety.rate * safety.rate));
      BOOST_TEST(needed <= 1.05 * distance_left + 0.001);  // clearances are looked at 0.05 rad apart
    }
  }
}

BOOST_AUTO_TEST_CASE(the_narrow_places_between_arm_and_reference_are_known) {
  // Beyond the tip, stretched towards 1 rad: the tip ends at 0.61 m, the balls begin at 0.63 m; others follow, farther.
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 5);
  for (Eigen::Index k = 0; k < 5; ++k) {
    const double angle = 1.0 + 0.05 * static_cast<double>(k - 2), away = k == 2 ? 0.65 : 0.655;
    points.col(k) << away * std::cos(angle), away * std::sin(angle), 0.0;
  }
  const TimedPath route = route_of(line(), balls(points));
  Eigen::Index narrowest = 0;
  BOOST_TEST(std::abs(route.clearance.minCoeff(&narrowest) - 0.02) < 1e-3);  // the tip passes between two places
  BOOST_TEST(std::abs(route.places(0, narrowest) - 1.0) < 0.05);             // their spacing
  TimedPathFollower follower;
  Eigen::VectorXd position(2), velocity(2), acceleration(2);
  follower.enter(route, Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero());
  Eigen::MatrixXd places(2, TimedPathFollower::most_places);
  const auto narrow = [&] { return places.leftCols(follower.narrow(route, settings, places)); };
  const auto go_to = [&](double station) {
    while (follower.station < station) {
      follower.advance(route, settings, Eigen::Vector2d(follower.station, 0.0), 0.01, position, velocity, acceleration);
    }
  };
  BOOST_TEST(narrow().cols() == 0);  // it is wide there
  go_to(1.2);
  // Behind the reference, ahead of the arm: all, as they are few, or every second.
  const auto num_narrow = (route.clearance.array() < settings.wide).count();
  BOOST_TEST(num_narrow > 2);
  const Eigen::Index every = num_narrow > TimedPathFollower::most_places ? 2 : 1;
  BOOST_TEST(narrow().cols() == (num_narrow + every - 1) / every);
  const Eigen::VectorXd off = (narrow().colwise() - route.places.col(narrowest)).colwise().norm();
  BOOST_TEST(off.minCoeff() < (every == 1 ? 1e-12 : 0.051));  // their spacing
  BOOST_TEST(off.maxCoeff() < 0.2);
  go_to(1.9);
  BOOST_TEST(narrow().cols() == 0);
  const TimedPath quick = route_of(line(), balls(points), Eigen::Vector2d::Zero(), false);
  BOOST_TEST(quick.clearance.maxCoeff() == 0.0);
  BOOST_TEST(quick.motion.v.cwiseAbs().maxCoeff() <= 0.35 * 2.0);
}

BOOST_AUTO_TEST_CASE(the_reference_waits_for_the_arm_within_the_limits_and_goes_on) {
  Eigen::MatrixXd path(2, 3);
  path << 0.0, 1.0, 1.0, 0.0, 0.0, 1.0;
  const TimedPath route = route_of(path, Obstacles::none());
  BOOST_TEST(std::abs(route.length() - 2.0) < 1e-12);  // rounding
  TimedPathFollower follower;
  Eigen::VectorXd q = Eigen::Vector2d::Zero(), position = q, velocity = q, acceleration = q, last = q, rate = q;
  follower.enter(route, q, Eigen::Vector2d::Zero());
  double jerk = 0.0;
  const double step = 0.001;
  const auto move = [&](int steps, bool follows) {
    for (int i = 0; i < steps; ++i) {
      const std::size_t allocations =
          test::allocations_of([&] { follower.advance(route, settings, q, step, position, velocity, acceleration); });
      BOOST_TEST(allocations == 0);
      BOOST_TEST((velocity.cwiseAbs() - route.limits.velocity).maxCoeff() <= 1e-6);
      BOOST_TEST((acceleration.cwiseAbs() - 1.01 * route.limits.acceleration).maxCoeff() <= 0.0);  // between samples
      BOOST_TEST(((velocity - rate) / step - acceleration).norm() < 1.5);                          // by 1 ms of jerk
      jerk = std::max(jerk, (acceleration - last).cwiseQuotient(route.limits.jerk).cwiseAbs().maxCoeff() / step);
      last = acceleration;
      rate = velocity;
      if (follows) {
        q += 0.2 * (position - q);
      }
    }
  };
  move(200, true);
  move(2000, false);                                                             // the arm is held
  BOOST_TEST((position - q).norm() <= settings.lead + 1.9 * 1.9 / (2.0 * 9.5));  // and what it takes to stop within the limits
  BOOST_TEST((position - q).norm() > 0.5 * settings.lead);
  BOOST_TEST(velocity.norm() < 1e-6);
  move(5000, true);
  BOOST_TEST((position - Eigen::Vector2d(1.0, 1.0)).norm() < 1e-9);
  BOOST_TEST(jerk <= 1.0 / 0.88);  // on top of the motion's own, where it waits
}

BOOST_AUTO_TEST_CASE(the_reference_begins_as_fast_as_the_arm) {
  const Eigen::Vector2d v(0.5, 3.0);
  const TimedPath route = route_of(line(), Obstacles::none(), v);
  TimedPathFollower follower;
  Eigen::VectorXd position(2), velocity(2), acceleration(2);
  follower.enter(route, line().col(0), v);
  BOOST_TEST(follower.pace == 1.0, boost::test_tools::tolerance(0.06));  // half a window later it is faster
  follower.advance(route, settings, line().col(0), 0.001, position, velocity, acceleration);
  BOOST_TEST(velocity[0] == 0.5, boost::test_tools::tolerance(0.05));
  BOOST_TEST(velocity[1] == 0.0);
  const TimedPath other = route_of(line(), Obstacles::none(), -v);  // it turns round
  BOOST_TEST(other.motion.v(0, 0) == 0.0);
}

BOOST_AUTO_TEST_CASE(a_path_asks_no_more_of_the_motors_than_they_have) {
  JointLimits limits = JointLimits::unlimited(2);
  limits.acceleration.setConstant(10.0);
  limits.effort = Eigen::Vector2d(4.0, 2.0);
  limits.effort_rate.setConstant(200.0);
  const Robot plain = test::planar_arm();
  const Robot robot("turning", plain.joints(), plain.frames(), plain.coordinate_names(), limits);
  const Inertial link{1.0, Eigen::Vector3d(0.3, 0.0, 0.0), 0.01 * Eigen::Matrix3d::Identity()};
  // Gravity along y takes 2.94 Nm of the second joint where it lies along x: there the least share is left.
  for (const double along_y : {0.0, -9.81}) {
    const RigidBodyDynamics dynamics(robot, {link, link}, Eigen::Vector3d(0.0, along_y, 0.0));
    ClearanceQuery::Workspace w(body);
    const RoundedPath path(line(), body, Obstacles::none(), Margins{}, w);
    const TimedPath route =
        make_route(path, Eigen::Vector2d::Zero(), body, Obstacles::none(), settings, SafetySettings{}, w, true, &dynamics);
    RigidBodyDynamics::Workspace dynamic(dynamics);
    Eigen::MatrixXd mass(2, 2);
    Eigen::VectorXd gravity(2), last = Eigen::VectorXd::Zero(2);
    double share = 0.0, rate = 0.0;
    for (Eigen::Index k = 0; k < route.motion.station.size(); ++k) {
      dynamics.mass_matrix(route.motion.q.col(k), dynamic, mass);
      dynamics.bias(route.motion.q.col(k), Eigen::Vector2d::Zero(), dynamic, gravity);
      const Eigen::VectorXd torque = mass * route.motion.a.col(k);
      for (Eigen::Index i = 0; i < 2; ++i) {
        const double left = std::max(0.0, limits.effort[i] - std::abs(gravity[i]));
        const double least = 0.05 * std::abs(mass(i, 0)) * route.limits.acceleration[0];
        BOOST_TEST(std::abs(torque[i]) <= std::max(0.72 * left, least) + 0.2);  // a window of the jerk from one place to others
        share = std::max(share, std::abs(torque[i]) / std::max(left, 1e-9));
      }
      rate = k == 0 ? 0.0 : std::max(rate, (torque - last).cwiseAbs().maxCoeff() / route.motion.period);
      last = torque;
    }
    BOOST_TEST(rate <= 1.02 * 0.5 * 200.0);
    BOOST_TEST((along_y != 0.0 || share > 0.6));  // and uses it
  }
  BOOST_TEST(route_of(line(), Obstacles::none()).duration() < 1.5);
}

// Rounded paths, and the fastest motions along them.
#include "sidestep/planning/path_timing.hpp"

#include <boost/test/unit_test.hpp>

#include "support/planar_arm.hpp"

using namespace sidestep;

namespace {

const PathLimits limits{Eigen::Vector2d(2.0, 1.5), Eigen::Vector2d(8.0, 5.0), Eigen::Vector2d(800.0, 500.0)};

Eigen::MatrixXd corner() {
  Eigen::MatrixXd path(2, 4);
  path << 0.0, 1.0, 1.2, -0.5, 0.0, 0.0, 1.0, 0.4;
  return path;
}

PathTiming timed(const RoundedPath& path, double begin = 0.0) {
  const Eigen::VectorXd stations = path.stations(0.01);
  return time_path(path, stations, Eigen::VectorXd::Constant(stations.size(), 1e9), Eigen::VectorXd::Ones(stations.size()),
                   limits, begin);
}

/// Largest share of the limits that samples ask for.
void check_limits(const PathTiming& m) {
  const Eigen::Index last = m.station.size() - 1;
  const Eigen::MatrixXd jerk = (m.a.rightCols(last) - m.a.leftCols(last)) / m.period;
  BOOST_TEST((m.v.cwiseAbs().array().colwise() / limits.velocity.array()).maxCoeff() <= 1.0 + 1e-9);  // rounding
  BOOST_TEST((m.a.cwiseAbs().array().colwise() / limits.acceleration.array()).maxCoeff() <= 1.0 + 1e-9);
  BOOST_TEST((jerk.cwiseAbs().array().colwise() / limits.jerk.array()).maxCoeff() <= 1.0 + 1e-9);
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_rounded_corner_has_two_continuous_derivatives_and_meets_its_edges) {
  const ClearanceQuery body = test::planar_arm_body();
  ClearanceQuery::Workspace w(body);
  const RoundedPath path(corner(), body, Obstacles::none(), Margins{}, w);
  BOOST_TEST(path.length() == 1.0 + std::hypot(0.2, 1.0) + std::hypot(1.7, 0.6), boost::test_tools::tolerance(1e-12));
  BOOST_TEST(path.corners()[0].half == 0.5 * std::hypot(0.2, 1.0), boost::test_tools::tolerance(1e-12));
  RoundedPath::Point before, here, after;
  const double h = 1e-5;
  for (double s = h; s < path.length() - h; s += 0.00371) {
    path.at(s - h, before);
    path.at(s, here);
    path.at(s + h, after);
    BOOST_TEST(((after.q - before.q) / (2.0 * h) - here.first).norm() < 1e-4);
    BOOST_TEST(((after.first - before.first) / (2.0 * h) - here.second).norm() < 2e-3);  // h times the third derivative
    BOOST_TEST(here.first.norm() <= 1.0 + 1e-12);
  }
  path.at(path.length(), here);
  BOOST_TEST((here.q - corner().col(3)).norm() < 1e-12);
}

BOOST_AUTO_TEST_CASE(a_corner_is_as_wide_as_obstacles_let_it) {
  const ClearanceQuery body = test::planar_arm_body();
  ClearanceQuery::Workspace w(body);
  Eigen::MatrixXd path(2, 3);
  path << 0.0, 2.0, 2.0, 2.0, 2.0, 0.0;
  const Eigen::Vector3d beside(0.37 * std::cos(1.786), 0.37 * std::sin(1.786), 0.0);  // nearer to the cut than to the edges
  const Obstacles ball(beside, Eigen::VectorXd::Constant(1, 0.02), Eigen::Matrix3Xd::Zero(3, 1));
  const auto least = [&](const RoundedPath& rounded) {
    RoundedPath::Point point;
    double clearance = 1.0;
    for (double s = 0.0; s <= 4.0; s += 0.001) {
      rounded.at(s, point);
      clearance = std::min(clearance, body.nearest(point.q, ball, 1.0, w).clearance);
    }
    return clearance;
  };
  const RoundedPath wide(path, body, Obstacles::none(), Margins{}, w);
  BOOST_TEST(wide.corners()[0].half == 2.0);
  const double sharp = least(RoundedPath(path)), cut = least(wide);
  BOOST_TEST(cut < sharp - 0.005);
  Margins margins;
  margins.margin = margins.pair_margin = 0.5 * (sharp + cut);
  margins.slack = 0.001;
  const RoundedPath narrow(path, body, ball, margins, w);
  BOOST_TEST(narrow.corners()[0].half < 2.0);
  BOOST_TEST(narrow.corners()[0].half >= 0.25);
  BOOST_TEST(least(narrow) >= margins.margin - margins.slack - 5e-4);  // of the chords
}

BOOST_AUTO_TEST_CASE(a_straight_motion_takes_what_its_limits_allow) {
  Eigen::MatrixXd line(2, 2);
  line << 0.0, 2.0, 0.0, 0.5;
  const PathTiming m = timed(RoundedPath(line));
  check_limits(m);
  // The first joint decides: up to 2 rad/s at 8 rad/s², 2 rad in all; the average adds its window of 20 ms.
  const double optimum = 2.0 / 2.0 + 2.0 / 8.0 + 0.02;
  const double duration = static_cast<double>(m.station.size() - 1) * m.period;
  BOOST_TEST(duration >= optimum - 1e-9);
  BOOST_TEST(duration <= 1.01 * optimum);
  BOOST_TEST((m.q.rightCols(1) - line.col(1)).norm() < 1e-12);
  BOOST_TEST(m.v.rightCols(1).norm() + m.a.rightCols(1).norm() == 0.0);
}

BOOST_AUTO_TEST_CASE(corners_hold_the_limits_at_every_sample) {
  const ClearanceQuery body = test::planar_arm_body();
  ClearanceQuery::Workspace w(body);
  for (const double radius : {1.0, 0.05}) {  // 0.05: corners that the limit of jerk slows
    Eigen::MatrixXd path = corner();
    path *= radius;
    const PathTiming m = timed(RoundedPath(path, body, Obstacles::none(), Margins{}, w));
    check_limits(m);
    // Derivatives are those of the positions.
    for (Eigen::Index k = 1; k + 1 < m.station.size(); ++k) {
      BOOST_TEST(((m.q.col(k + 1) - m.q.col(k - 1)) / (2.0 * m.period) - m.v.col(k)).norm() < 3e-3);  // jerk h²/6
      BOOST_TEST(((m.v.col(k + 1) - m.v.col(k - 1)) / (2.0 * m.period) - m.a.col(k)).norm() < 1.0);   // and half a kink
    }
  }
}

BOOST_AUTO_TEST_CASE(a_motion_begins_as_fast_as_it_is_told_and_keeps_to_speeds_that_are_given) {
  Eigen::MatrixXd line(2, 2);
  line << 0.0, 2.0, 0.0, 0.0;
  const RoundedPath path(line);
  const Eigen::VectorXd stations = path.stations(0.01);
  Eigen::VectorXd fastest = Eigen::VectorXd::Constant(stations.size(), 1e9);
  fastest.segment(80, 40).setConstant(0.3);
  const PathTiming m = time_path(path, stations, fastest, Eigen::VectorXd::Ones(stations.size()), limits, 1.0);
  check_limits(m);
  BOOST_TEST(m.v(0, 0) == 1.0, boost::test_tools::tolerance(0.05));  // the average of half a window
  for (Eigen::Index k = 0; k < m.station.size(); ++k) {
    if (m.station[k] > 0.82 && m.station[k] < 1.17) {
      BOOST_TEST(m.v(0, k) <= 0.3 + 1e-9);
    }
  }
}

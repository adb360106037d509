// Points of ellipsoids against the balls that must hold them.
#include "sidestep/clearance/ball_cover.hpp"

#include <Eigen/Geometry>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <limits>

#include "support/random.hpp"

using namespace sidestep;
using test::Random;

BOOST_AUTO_TEST_CASE(every_point_is_in_a_ball_and_no_ball_reaches_far_out) {
  Random random(1);
  constexpr double overshoot = 0.02;
  for (int trial = 0; trial < 100; ++trial) {
    Eigen::Vector3d a(random.uniform(0.01, 0.1), random.uniform(0.01, 0.1), random.uniform(0.01, 0.2));
    std::sort(a.begin(), a.end());
    const Eigen::Matrix3d axes = Eigen::Quaterniond(random.matrix(4, 1).normalized().eval().data()).toRotationMatrix();
    const Eigen::Vector3d mean = random.matrix(3, 1);
    const std::vector<CoverBall> balls = cover_by_balls(mean, axes, a.cwiseAbs2(), overshoot);
    for (int k = 0; k < 300; ++k) {
      const Eigen::Vector3d y = a.cwiseProduct(Eigen::Vector3d(random.matrix(3, 1)).normalized());
      const Eigen::Vector3d x = mean + axes.transpose() * y;
      double least = std::numeric_limits<double>::infinity();
      for (const CoverBall& ball : balls) {
        least = std::min(least, (x - ball.centre).norm() - ball.radius);
      }
      BOOST_TEST(least < 1e-12);  // rounding
    }
    for (const CoverBall& ball : balls) {
      BOOST_TEST(ball.radius < a[0] + 2.0 * overshoot + 1e-12);  // both longer axes may go uncut for one overshoot each
    }
  }
}

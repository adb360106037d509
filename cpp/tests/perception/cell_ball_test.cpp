// Balls around boxes: they hold the box, and stand out of what is seen by little.
#include "../../src/perception/cell_ball.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>

#include "support/random.hpp"

using namespace sidestep;

namespace {

bool is_single(double value) {
  const volatile float rounded = static_cast<float>(value);  // in memory: compilers drop casts there and back in vectors
  return static_cast<double>(rounded) == value;
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_ball_behind_holds_its_box) {
  test::Random random(1);
  for (int n = 0; n < 200; ++n) {
    const Eigen::Vector3d low = random.vector(3), high = low + 0.02 * random.vector(3).cwiseAbs(), eye = 3.0 * random.vector(3);
    const Eigen::Vector3d middle = low + 0.7 * (high - low);
    const CellBall ball = ball_behind(middle, low, high, eye, 0.01);
    double farthest = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d p(corner & 1 ? high.x() : low.x(), corner & 2 ? high.y() : low.y(),
                              corner & 4 ? high.z() : low.z());
      farthest = std::max(farthest, (p - ball.centre).norm());
    }
    BOOST_TEST(farthest <= ball.radius + 1e-12);
    const CellBall rounded = in_single_precision(ball);
    BOOST_TEST((is_single(rounded.centre.x()) && is_single(rounded.centre.y()) && is_single(rounded.centre.z())));
    BOOST_TEST(is_single(rounded.radius));
    BOOST_TEST((rounded.centre - ball.centre).norm() + ball.radius <= rounded.radius);
    BOOST_TEST((rounded.centre - ball.centre).cwiseAbs().maxCoeff() <= std::ldexp(ball.centre.cwiseAbs().maxCoeff(), -23));
    BOOST_TEST(rounded.radius <= ball.radius + 1e-6);
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d p(corner & 1 ? high.x() : low.x(), corner & 2 ? high.y() : low.y(),
                              corner & 4 ? high.z() : low.z());
      BOOST_TEST((p - rounded.centre).norm() <= rounded.radius + 1e-15);
    }
    BOOST_TEST((ball.centre - middle).norm() == 0.01, boost::test_tools::tolerance(1e-9));
    BOOST_TEST((ball.centre - middle).dot(middle - eye) > -1e-12);  // away from the camera
  }
}

BOOST_AUTO_TEST_CASE(a_ball_of_a_table_stands_out_by_less_than_half) {
  const Eigen::Vector3d low(0.0, 0.0, 0.0), high(0.02, 0.02, 0.002), eye(1.0, 0.0, 0.5);
  const Eigen::Vector3d middle = 0.5 * (low + high);
  const CellBall ball = ball_behind(middle, low, high, eye, 0.01);
  BOOST_TEST(ball.centre.z() == middle.z() - 0.01,
             boost::test_tools::tolerance(1e-12));  // down, though the camera looks along it
  const double out = ball.centre.z() + ball.radius - high.z();
  // A ball around the middle stands out by 13.2 mm: sqrt(0.01² + 0.01² + 0.001²) - 0.001.
  BOOST_TEST(out == std::sqrt(2e-4 + 0.011 * 0.011) - 0.011, boost::test_tools::tolerance(1e-9));
  BOOST_TEST(out < 0.007);
}

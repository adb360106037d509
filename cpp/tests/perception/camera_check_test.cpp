// Pose and clock of a camera, found from an arm that moves in view.
#include "sidestep/perception/camera_check.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "support/covered_arm.hpp"
#include "support/depth_scene.hpp"

using namespace sidestep;

// Not in a namespace without a name: test cases derive from it.
struct Checked {
  Arm arm = test::covered_arm(test::arm_limits(4));
  DepthCamera truth = test::small_camera({1.5, 0.3, 1.0}, {0.0, 0.0, 0.7});

  Eigen::VectorXd q_at(double time) const {
    return Eigen::Vector4d(0.8 * std::sin(1.3 * time), -0.5 + 0.6 * std::sin(0.9 * time), std::sin(1.7 * time),
                           1.0 + 0.5 * std::sin(2.1 * time));
  }
  CameraCorrection check(const DepthCamera& told, double clock, bool moves = true) const {
    CameraCheck check(arm, told);
    for (int n = 0; n < 900; ++n) {
      check.add_state(0.01 * n, q_at(moves ? 0.01 * n : 1.0));
    }
    for (int n = 0; n < 20; ++n) {
      const double time = 0.6 + 0.4 * n;
      test::DepthScene scene;
      scene.floor = -0.3;
      scene.add_sphere({0.1, -0.5, 0.2}, 0.2);  // something near the arm
      scene.add_arm(arm.robot(), arm.body(), q_at(moves ? time : 1.0));
      const std::vector<float> pixels = scene.image(truth);
      check.add(RawDepth{std::span<const float>(pixels), 1.0}, time - clock);
    }
    return check.solve();
  }
};

BOOST_FIXTURE_TEST_CASE(a_camera_where_it_should_be_stays, Checked) {
  const CameraCorrection found = check(truth, 0.0);
  BOOST_TEST(found.translation < 1e-3);
  BOOST_TEST(found.rotation < 1e-3);
  BOOST_TEST(std::abs(found.clock_offset) < 1e-3);
  BOOST_TEST(found.rms_after < 2e-3);
  BOOST_TEST(found.images == 20);
  BOOST_TEST(found.question == "");
}

BOOST_FIXTURE_TEST_CASE(errors_of_pose_and_clock_are_found, Checked) {
  DepthCamera told = truth;
  Eigen::Isometry3d error = Eigen::Isometry3d::Identity();
  error.translation() << 0.01, -0.008, 0.012;
  error.linear() = Eigen::AngleAxisd(0.02, Eigen::Vector3d(1.0, 2.0, -1.0).normalized()).toRotationMatrix();
  told.pose = truth.pose * error;
  const CameraCorrection found = check(told, 0.03);
  const Eigen::Isometry3d left = truth.pose.inverse() * found.pose;
  BOOST_TEST(left.translation().norm() < 4e-3);
  BOOST_TEST(Eigen::AngleAxisd(left.linear()).angle() < 4e-3);
  BOOST_TEST(found.clock_offset == 0.03, boost::test_tools::tolerance(0.1));
  BOOST_TEST(found.rms_after < 0.5 * found.rms_before);
}

BOOST_FIXTURE_TEST_CASE(an_arm_at_rest_says_nothing_of_the_clock, Checked) {
  const CameraCorrection found = check(truth, 0.05, false);
  BOOST_TEST(std::isnan(found.clock_offset));
  BOOST_TEST(found.question.find("hardly moves") != std::string::npos);
}

BOOST_FIXTURE_TEST_CASE(images_without_the_arm_are_refused, Checked) {
  DepthCamera told = truth;
  told.pose.translation().x() += 3.0;
  BOOST_CHECK_THROW(check(told, 0.0), std::runtime_error);
  CameraCheck empty(arm, truth);
  empty.add_state(1.0, q_at(1.0));
  BOOST_CHECK_THROW(empty.add_state(1.0, q_at(1.0)), std::invalid_argument);
  BOOST_CHECK_THROW(empty.solve(), std::runtime_error);
}

// Cameras: rays and pixels undo each other, windows hold what they should, and wrong numbers are named.
#include "sidestep/perception/depth_camera.hpp"

#include <boost/test/unit_test.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "support/depth_scene.hpp"

using namespace sidestep;

namespace {

std::string refusal_of(const DepthCamera& camera) {
  try {
    camera.validate();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "none";
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_ray_goes_through_the_pixel_that_sees_it) {
  DepthCamera camera = test::small_camera({1.0, 0.0, 1.0}, {0.0, 0.0, 0.0});
  camera.distortion = {0.1, -0.05, 0.002, -0.001, 0.01};
  for (const DistortionModel model : {DistortionModel::none, DistortionModel::brown_conrady,
                                      DistortionModel::inverse_brown_conrady, DistortionModel::kannala_brandt}) {
    camera.distortion_model = model;
    for (const double u : {0.0, 40.0, 159.0}) {
      for (const double v : {0.0, 60.0, 119.0}) {
        const Eigen::Vector2d ray = camera.ray(u, v);
        const Eigen::Vector2d pixel = camera.project(1.7 * Eigen::Vector3d(ray.x(), ray.y(), 1.0));
        BOOST_TEST((pixel - Eigen::Vector2d(u, v)).norm() < 1e-6);  // rounds of a fixed point
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(a_lens_moves_points_as_its_polynomial_says) {
  DepthCamera camera = test::small_camera({1.0, 0.0, 1.0}, {0.0, 0.0, 0.0});
  camera.distortion = {0.1, 0.0, 0.01, 0.02, 0.0};
  camera.distortion_model = DistortionModel::brown_conrady;
  // x = 0.5, y = 0: r² = 0.25; x (1 + 0.1 r²) + p2 (r² + 2 x²), p1 r²
  const Eigen::Vector2d pixel = camera.project({0.5, 0.0, 1.0});
  BOOST_TEST(pixel.x() == 120.0 * (0.5 * 1.025 + 0.02 * 0.75) + 79.5, boost::test_tools::tolerance(1e-12));
  BOOST_TEST(pixel.y() == 120.0 * 0.01 * 0.25 + 59.5, boost::test_tools::tolerance(1e-12));
}

BOOST_AUTO_TEST_CASE(what_is_far_outside_of_the_view_is_not_folded_back_into_the_image) {
  DepthCamera camera = test::small_camera({1.0, 0.0, 1.0}, {0.0, 0.0, 0.0});
  camera.fx = camera.fy = 200.0;
  const std::vector<std::pair<DistortionModel, double>> lenses = {{DistortionModel::brown_conrady, -0.3},
                                                                  {DistortionModel::inverse_brown_conrady, 0.3},
                                                                  {DistortionModel::kannala_brandt, -0.4}};
  for (const auto& [model, k1] : lenses) {
    camera.distortion_model = model;
    camera.distortion = {k1, 0.0, 0.0, 0.0, 0.0};
    const Eigen::Vector2d corner = camera.ray(159.0, 119.0);
    BOOST_TEST((camera.project({corner.x(), corner.y(), 1.0}) - Eigen::Vector2d(159.0, 119.0)).norm() < 1e-6);
    int folded = 0;
    for (double x = camera.ray(159.0, 59.5).x() + 0.01; x < 10.0; x += 0.01) {
      const Eigen::Vector2d pixel = camera.project({x, 0.0, 1.0});
      folded += pixel.array().isNaN().all() || pixel.x() > 159.0 ? 0 : 1;
    }
    BOOST_TEST(folded == 0);
  }
}

BOOST_AUTO_TEST_CASE(a_distortion_that_folds_within_the_image_is_refused) {
  DepthCamera camera = test::small_camera({1.0, 0.0, 1.0}, {0.0, 0.0, 0.0});
  camera.distortion_model = DistortionModel::brown_conrady;
  camera.distortion = {-0.3, 0.0, 0.0, 0.0, 0.0};
  // The corner is at 0.83 from the axis; r (1 - 0.3 r²) reaches 0.70.
  BOOST_TEST(refusal_of(camera).find("no ray") != std::string::npos, refusal_of(camera));
  camera.fx = camera.fy = 200.0;
  BOOST_TEST(refusal_of(camera) == "none");
}

BOOST_AUTO_TEST_CASE(a_window_holds_all_rays_between_its_bounds) {
  const DepthCamera camera = test::small_camera({1.0, 0.0, 1.0}, {0.0, 0.0, 0.0});
  const CameraRays rays(camera);
  const CameraRays::Window window = rays.window(-0.1, 0.2, 0.05, 10.0);
  BOOST_TEST(window.u0 == 68);  // (68 - 79.5)/120 = -0.0958
  BOOST_TEST(window.u1 == 104);
  BOOST_TEST(window.v0 == 66);
  BOOST_TEST(window.v1 == 120);
  const CameraRays::Window none = rays.window(2.0, 3.0, 0.0, 0.1);
  BOOST_TEST(none.u0 == none.u1);
}

BOOST_AUTO_TEST_CASE(a_camera_names_the_wrong_number) {
  const DepthCamera good = test::small_camera({1.0, 0.0, 1.0}, {0.0, 0.0, 0.0});
  BOOST_TEST(refusal_of(good) == "none");
  DepthCamera wrong = good;
  wrong.fx = 0.0;
  BOOST_TEST(refusal_of(wrong) == "camera 'front': fx is 0.000000, allowed: the focal length in pixels, 1 to 1e6");
  wrong = good;
  wrong.far = 0.05;
  BOOST_TEST(refusal_of(wrong).find("far is 0.05") != std::string::npos);
  wrong = good;
  wrong.width = 0;
  BOOST_TEST(refusal_of(wrong).find("0 × 120 pixels") != std::string::npos);
  wrong = good;
  wrong.pose.linear() *= 2.0;
  BOOST_TEST(refusal_of(wrong).find("camera 'front'") == 0u);
}

// The arm in the image: every pixel against the rays and ellipsoids themselves.
#include "sidestep/perception/arm_mask.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "support/allocations.hpp"
#include "support/covered_arm.hpp"
#include "support/depth_scene.hpp"
#include "support/every_instruction_set.hpp"

using namespace sidestep;

// Not in a namespace without a name: test cases derive from it.
struct Masked {
  Arm arm = test::covered_arm(test::arm_limits(4));
  DepthCamera camera = test::small_camera({1.4, 0.2, 0.9}, {0.0, 0.0, 0.6});
  CameraRays rays{camera};
  DepthImage image{camera};
  ArmMask mask{arm.robot(), arm.body()};
  Eigen::VectorXd q = Eigen::Vector4d(0.3, -0.8, 0.5, 1.1);

  void mark(const std::vector<float>& pixels, const Eigen::VectorXd& before, const Eigen::VectorXd& after) {
    image.take(camera, {std::span<const float>(pixels), 1.0});
    const KinematicState a = test::state_at(arm.robot(), before), b = test::state_at(arm.robot(), q),
                         c = test::state_at(arm.robot(), after);
    mask.mark(camera, rays, {a, camera.pose}, {b, camera.pose}, {c, camera.pose}, image);
  }
  void mark(const std::vector<float>& pixels) { mark(pixels, q, q); }
  int count(PixelLabel label) const {
    return static_cast<int>(std::count(image.labels(), image.labels() + image.size(), label));
  }
};

BOOST_FIXTURE_TEST_CASE(without_errors_exactly_the_arm_is_taken_out, Masked) {
  test::DepthScene scene, empty;
  scene.floor = empty.floor = -0.3;
  scene.add_arm(arm.robot(), arm.body(), q);
  camera.translation_error = 1e-5;  // rounding of single precision
  const std::vector<float> pixels = scene.image(camera);
  for ([[maybe_unused]] const InstructionSet set : test::EveryInstructionSet()) {
    mark(pixels);
    int num_arm = 0, num_left = 0, num_lost = 0;
    for (int v = 0; v < 120; ++v) {
      for (int u = 0; u < 160; ++u) {
        const bool shows_arm =
            pixels[static_cast<std::size_t>(v * 160 + u)] != static_cast<float>(empty.depth(camera, camera.pose, u, v));
        const bool is_taken = image.labels()[v * 160 + u] == PixelLabel::arm;
        num_arm += shows_arm ? 1 : 0;
        num_left += shows_arm && !is_taken ? 1 : 0;
        num_lost += !shows_arm && is_taken ? 1 : 0;
      }
    }
    BOOST_TEST(num_arm > 400);
    BOOST_TEST(num_left == 0);
    BOOST_TEST(num_lost == 0);  // one pixel of growth is always there, and nothing beside the arm is as near
  }
}

BOOST_FIXTURE_TEST_CASE(an_edge_that_bled_by_two_pixels_is_the_arm, Masked) {
  test::DepthScene scene;
  scene.add_arm(arm.robot(), arm.body(), q);
  const std::vector<float> pixels = scene.image(camera);  // 0 beside the arm
  std::vector<float> bled = pixels;
  std::vector<std::size_t> beside;
  for (std::size_t i = 2; i + 2 < pixels.size(); ++i) {
    const float depth = std::max({pixels[i - 2], pixels[i - 1], pixels[i + 1], pixels[i + 2]});
    if (pixels[i] == 0.0f && depth > 0.0f) {
      bled[i] = depth;
      beside.push_back(i);
    }
  }
  BOOST_TEST(beside.size() > 50u);
  mark(bled);
  for (const std::size_t i : beside) {
    BOOST_TEST((image.labels()[i] == PixelLabel::arm));
  }
}

BOOST_FIXTURE_TEST_CASE(depths_on_a_grown_ellipsoid_are_those_of_its_equation, Masked) {
  camera.translation_error = 0.01;
  mark(std::vector<float>(image.size(), 1.2f));
  const KinematicState state = test::state_at(arm.robot(), q);
  double worst = 0.0;
  int num = 0;
  for (int i = 0; i < 160 * 120; i += 7) {
    const double x = static_cast<double>(rays.x()[i]), y = static_cast<double>(rays.y()[i]);
    double front = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < mask.ellipsoids().size(); ++k) {
      const BodyEllipsoid& ellipsoid = mask.ellipsoids()[k];
      const KinematicState::Link& link = link_or_world(state, ellipsoid.joint);
      const double growth = mask.growth()[k], mean = std::sqrt(ellipsoid.shape.trace() / 3.0);
      const Eigen::Matrix3d S = (1.0 + growth / mean) * link.R_WL * ellipsoid.shape * link.R_WL.transpose() +
                                (1.0 + mean / growth) * growth * growth * Eigen::Matrix3d::Identity();
      const Eigen::Vector3d r = camera.pose.linear() * Eigen::Vector3d(x, y, 1.0);
      const Eigen::Vector3d o = camera.pose.translation() - (link.R_WL * ellipsoid.mean + link.p_WL);
      const Eigen::Matrix3d A = S.inverse();
      const double a = r.dot(A * r), b = r.dot(A * o), c = o.dot(A * o) - 1.0;
      front = b * b >= a * c ? std::min(front, (-b - std::sqrt(b * b - a * c)) / a) : front;
    }
    const double found = static_cast<double>(mask.front()[i]);
    if (std::isfinite(front) && std::isfinite(found)) {
      worst = std::max(worst, std::abs(front - found));
      ++num;
    }
  }
  BOOST_TEST(num > 100);
  BOOST_TEST(worst < 2e-3);  // a root of nearly zero in single precision, at the silhouette
}

BOOST_FIXTURE_TEST_CASE(growth_is_the_sum_of_the_errors, Masked) {
  camera.translation_error = 0.01;
  camera.rotation_error = 0.02;
  Eigen::VectorXd later = q;
  later[0] += 0.1;
  mark(std::vector<float>(image.size(), 1.0f), q, later);
  const KinematicState state = test::state_at(arm.robot(), q), moved = test::state_at(arm.robot(), later);
  for (std::size_t k = 0; k < mask.ellipsoids().size(); ++k) {
    const BodyEllipsoid& ellipsoid = mask.ellipsoids()[k];
    const KinematicState::Link &a = link_or_world(state, ellipsoid.joint), &b = link_or_world(moved, ellipsoid.joint);
    const Eigen::Vector3d centre = a.R_WL * ellipsoid.mean + a.p_WL, then = b.R_WL * ellipsoid.mean + b.p_WL;
    const double distance = (centre - camera.pose.translation()).norm();
    const double fixed = 0.01 + 0.02 * distance + distance / 120.0;
    const double moves = (then - centre).norm() + 2.0 * std::sin(0.05) * ellipsoid.extent;  // a turn of 0.1 rad
    BOOST_TEST(mask.growth()[k] == fixed + moves, boost::test_tools::tolerance(1e-9));
  }
}

BOOST_FIXTURE_TEST_CASE(a_camera_on_a_link_sees_the_base_move, Masked) {
  const KinematicState at = test::state_at(arm.robot(), q);
  Eigen::VectorXd later = q;
  later[3] += 0.1;  // turns the last link, and the camera on it
  const KinematicState then = test::state_at(arm.robot(), later);
  const int tip = arm.robot().frame_index("tip");
  const Eigen::Isometry3d from = frame_pose(arm.robot(), at, tip), to = frame_pose(arm.robot(), then, tip);
  image.take(camera, {std::span<const float>(std::vector<float>(image.size(), 1.0f)), 1.0});
  mask.mark(camera, rays, {at, from}, {at, from}, {then, to}, image);
  for (std::size_t k = 0; k < mask.ellipsoids().size(); ++k) {
    const BodyEllipsoid& ellipsoid = mask.ellipsoids()[k];
    const KinematicState::Link& link = link_or_world(at, ellipsoid.joint);
    const double distance = (link.R_WL * ellipsoid.mean + link.p_WL - from.translation()).norm();
    const double moved = mask.growth()[k] - 3.0 * distance / 120.0;
    if (ellipsoid.joint == 3) {
      BOOST_TEST(moved < 1e-9);  // the camera goes with it
    } else {
      BOOST_TEST(moved > 0.09 * distance - 0.01);
    }
  }
}

BOOST_FIXTURE_TEST_CASE(what_is_in_front_and_behind_stays, Masked) {
  camera.translation_error = 0.01;
  mark(std::vector<float>(image.size(), 0.6f));
  BOOST_TEST(count(PixelLabel::arm) == 0);
  mark(std::vector<float>(image.size(), 3.0f));
  BOOST_TEST(count(PixelLabel::arm) == 0);
  BOOST_TEST(mask.residual().rays > 5);
  BOOST_TEST(mask.residual().through_share() == 1.0);
}

BOOST_FIXTURE_TEST_CASE(an_arm_elsewhere_lets_rays_pass, Masked) {
  camera.translation_error = 0.005;
  camera.width = 320;  // the same view with pixels of half the size, by three of which covers grow
  camera.height = 240;
  camera.fx = camera.fy = 240.0;
  camera.cx = 159.5;
  camera.cy = 119.5;
  rays = CameraRays(camera);
  image = DepthImage(camera);
  test::DepthScene scene;
  scene.floor = -0.3;
  scene.add_arm(arm.robot(), arm.body(), q);
  mark(scene.image(camera));
  BOOST_TEST(mask.residual().through_share() == 0.0);
  BOOST_TEST(std::abs(mask.residual().depth_error) < 0.03);
  q[1] += 0.5;
  mark(scene.image(camera));
  BOOST_TEST(mask.residual().through_share() > 0.25);
}

BOOST_FIXTURE_TEST_CASE(a_link_around_the_camera_hides_nothing, Masked) {
  const KinematicState state = test::state_at(arm.robot(), q);
  const BodyEllipsoid& last = mask.ellipsoids().back();
  const KinematicState::Link& link = link_or_world(state, last.joint);
  camera.pose.translation() = link.R_WL * last.mean + link.p_WL;
  camera.pose.linear() = link.R_WL;  // looks along the link, away from the arm
  mark(std::vector<float>(image.size(), 0.12f));
  BOOST_TEST(count(PixelLabel::arm) > 0);
  BOOST_TEST(std::isinf(mask.front()[60 * 160 + 80]));
}

BOOST_FIXTURE_TEST_CASE(pixels_that_fly_at_the_silhouette_are_edges, Masked) {
  camera.translation_error = 0.01;
  test::DepthScene scene;
  scene.add_arm(arm.robot(), arm.body(), q);
  std::vector<float> pixels = scene.image(camera);
  std::replace_if(pixels.begin(), pixels.end(), [](float z) { return !(z > 0.0f); }, 2.5f);  // a wall
  mark(pixels);
  const std::vector<PixelLabel> labels(image.labels(), image.labels() + image.size());
  int num = 0;
  for (std::size_t i = 161; i + 161 < pixels.size() && num < 20; ++i) {
    const auto shows_wall = [&](std::size_t k) { return labels[k] == PixelLabel::obstacle && pixels[k] > pixels[i] + 0.5f; };
    if (labels[i] != PixelLabel::arm || !shows_wall(i + 1) || !shows_wall(i + 2) || !shows_wall(i + 161)) {
      continue;
    }
    std::vector<float> flying = pixels;
    for (const std::size_t k : {i + 1, i + 2, i + 161}) {  // three that support each other
      flying[k] = 0.5f * (pixels[i] + pixels[k]);
    }
    mark(flying);
    BOOST_TEST((image.labels()[i + 1] == PixelLabel::edge));
    ++num;
  }
  BOOST_TEST(num == 20);
}

BOOST_FIXTURE_TEST_CASE(a_mask_allocates_nothing, Masked) {
  mark(std::vector<float>(image.size(), 1.2f));
  const KinematicState state = test::state_at(arm.robot(), q);
  BOOST_TEST(test::allocations_of([&] {
               mask.mark(camera, rays, {state, camera.pose}, {state, camera.pose}, {state, camera.pose}, image);
             }) == 0u);
}

// Images: units, ranges and flying pixels.
#include "sidestep/perception/depth_image.hpp"

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/allocations.hpp"
#include "support/depth_scene.hpp"
#include "support/every_instruction_set.hpp"

using namespace sidestep;

// Not in a namespace without a name: test cases derive from it.
struct Taken {
  DepthCamera camera = test::small_camera({1.0, 0.0, 1.0}, {0.0, 0.0, 0.0});
  DepthImage image{camera};
  std::vector<float> pixels = std::vector<float>(160 * 120, 1.0f);

  float& at(int u, int v) { return pixels[static_cast<std::size_t>(v * 160 + u)]; }
  PixelLabel label(int u, int v) const { return image.labels()[v * 160 + u]; }
  void take() { image.take(camera, {std::span<const float>(pixels), 1.0}); }
};

BOOST_FIXTURE_TEST_CASE(a_pixel_between_two_surfaces_is_an_edge, Taken) {
  for (int v = 0; v < 120; ++v) {
    for (int u = 80; u < 160; ++u) {
      at(u, v) = 2.0f;
    }
  }
  at(80, 50) = 1.5f;
  for ([[maybe_unused]] const InstructionSet set : test::EveryInstructionSet()) {
    take();
    BOOST_TEST((label(80, 50) == PixelLabel::edge));
    BOOST_TEST(std::count(image.labels(), image.labels() + image.size(), PixelLabel::edge) == 1);
  }
}

BOOST_FIXTURE_TEST_CASE(a_wire_and_a_striped_image_are_no_edges, Taken) {
  for (int u = 0; u < 160; ++u) {
    at(u, 60) = 0.8f;  // a wire one pixel thick
  }
  take();
  BOOST_TEST((label(70, 60) == PixelLabel::obstacle));
  for (int v = 0; v < 120; ++v) {
    for (int u = 0; u < 160; ++u) {
      at(u, v) = u % 2 == 0 && v % 2 == 0 ? 1.0f : 0.0f;
    }
  }
  take();
  BOOST_TEST((label(70, 60) == PixelLabel::obstacle));
  BOOST_TEST((label(71, 60) == PixelLabel::nothing));
}

// The arm, at 1 m, in the left half of an image; what is beside it in the right half.
struct BesideArm : Taken {
  static constexpr int first = 80;  // column beside the arm

  void beside(float (*depth)(int)) {
    for (int v = 0; v < 120; ++v) {
      for (int u = first; u < 160; ++u) {
        at(u, v) = depth(u - first);
      }
    }
  }
  void take_with_arm() {
    take();
    for (int v = 0; v < 120; ++v) {
      std::fill_n(image.labels() + v * 160, first, PixelLabel::arm);
    }
    image.mark_edges_of_arm(camera);
  }
  int edges() const { return image.count(PixelLabel::edge); }
};

BOOST_FIXTURE_TEST_CASE(pixels_that_fly_side_by_side_at_the_arm_are_edges, BesideArm) {
  for (const float behind : {2.0f, 0.5f}) {
    beside([](int) { return 0.0f; });
    for (int i = 0; i < 160 * 120; ++i) {
      pixels[static_cast<std::size_t>(i)] = pixels[static_cast<std::size_t>(i)] == 1.0f ? 1.0f : behind;
    }
    const float between = 0.5f * (1.0f + behind);
    at(80, 50) = between;
    at(80, 51) = at(81, 51) = between + 0.01f;  // they support each other
    at(120, 50) = at(121, 50) = at(121, 51) = between;
    take();
    BOOST_TEST((label(80, 50) == PixelLabel::obstacle));
    take_with_arm();
    BOOST_TEST((label(80, 50) == PixelLabel::edge));
    BOOST_TEST((label(80, 51) == PixelLabel::edge));
    BOOST_TEST((label(81, 51) == PixelLabel::edge));
    BOOST_TEST(edges() == 3);  // those far from the arm may be something
    BOOST_TEST(image.count(PixelLabel::arm) == 80 * 120);
  }
}

BOOST_FIXTURE_TEST_CASE(what_is_between_two_links_in_depth_flies, BesideArm) {
  beside([](int) { return 1.3f; });
  at(80, 50) = at(80, 51) = at(81, 50) = 1.27f;  // nearer to the farther link than slopes explain elsewhere
  take_with_arm();
  BOOST_TEST(edges() == 0);
  for (int v = 0; v < 120; ++v) {
    std::fill_n(image.labels() + v * 160 + 82, 78, PixelLabel::arm);  // the other link
  }
  image.mark_edges_of_arm(camera);
  BOOST_TEST((label(80, 50) == PixelLabel::edge));
  BOOST_TEST(edges() == 3);
}

BOOST_FIXTURE_TEST_CASE(surfaces_beside_the_arm_are_no_edges, BesideArm) {
  beside([](int) { return 2.0f; });
  take_with_arm();
  BOOST_TEST(edges() == 0);
  beside([](int across) { return across < 5 ? 1.5f : 2.0f; });  // a post in front of a wall
  take_with_arm();
  BOOST_TEST(edges() == 0);
  beside([](int across) { return 1.2f + 0.01f * static_cast<float>(across); });  // a wall seen at 53 degrees
  take_with_arm();
  BOOST_TEST(edges() == 0);
  beside([](int across) { return across < 40 ? 0.99f : 1.01f; });  // what touches the arm
  take_with_arm();
  BOOST_TEST(edges() == 0);
  BOOST_TEST(test::allocations_of([&] { image.mark_edges_of_arm(camera); }) == 0u);
}

BOOST_FIXTURE_TEST_CASE(ranges_and_what_is_nothing, Taken) {
  at(10, 10) = 0.05f;  // nearer than 0.1 m
  at(20, 10) = 6.0f;   // beyond 4 m
  at(30, 10) = std::numeric_limits<float>::quiet_NaN();
  at(40, 10) = std::numeric_limits<float>::infinity();
  at(50, 10) = 1e30f;
  at(60, 10) = 850.0f;  // in millimetres
  take();
  BOOST_TEST((label(10, 10) == PixelLabel::nothing));
  BOOST_TEST((label(20, 10) == PixelLabel::outside));
  BOOST_TEST((label(30, 10) == PixelLabel::nothing));
  BOOST_TEST((label(40, 10) == PixelLabel::nothing));
  BOOST_TEST((label(50, 10) == PixelLabel::nothing));
  BOOST_TEST((label(60, 10) == PixelLabel::nothing));
}

BOOST_FIXTURE_TEST_CASE(whole_numbers_have_a_unit, Taken) {
  const std::vector<std::uint16_t> raw(pixels.size(), 12345);
  image.take(camera, {std::span<const std::uint16_t>(raw), 0.0001});
  BOOST_TEST(image.depth()[500] == 1.2345f, boost::test_tools::tolerance(1e-6f));
  const std::size_t allocated =
      test::allocations_of([&] { image.take(camera, {std::span<const std::uint16_t>(raw), 0.0001}); });
  BOOST_TEST(allocated == 0u);
}

BOOST_FIXTURE_TEST_CASE(a_cloud_becomes_the_image_that_sees_it, Taken) {
  Eigen::Matrix3Xd points(3, 3);
  points.col(0) << 0.0, 0.0, 2.0;  // behind the next
  points.col(1) << 0.0, 0.0, 1.0;
  points.col(2) << 0.3, 0.0, std::numeric_limits<double>::quiet_NaN();
  camera.cx = 80.0;
  camera.cy = 60.0;
  image.take(camera, points);
  BOOST_TEST(image.depth()[60 * 160 + 80] == 1.0f);
  BOOST_TEST(std::count(image.depth(), image.depth() + image.size(), 0.0f) == 160 * 120 - 1);
}

BOOST_FIXTURE_TEST_CASE(an_image_of_another_size_is_refused, Taken) {
  pixels.resize(100);
  BOOST_CHECK_EXCEPTION(take(), std::invalid_argument, [](const std::invalid_argument& error) {
    return std::string(error.what()) == "camera 'front': the image has 100 pixels, allowed: 160 × 120";
  });
}

// Means of depths over time: less noise where nothing moves, and never far behind what does.
#include "sidestep/perception/steady_depth.hpp"

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <random>
#include <span>
#include <vector>

#include "support/allocations.hpp"
#include "support/depth_scene.hpp"

using namespace sidestep;

constexpr double noise = 0.01;  // [m]

// Not in a namespace without a name: test cases derive from it.
/// A camera in front of a wall, whose distance is a function of the number of the image.
struct Watching {
  DepthCamera camera = test::small_camera({0.0, 0.0, 0.0}, {1.0, 0.0, 0.0});
  DepthImage image{camera};
  SteadyDepth steady{camera, 8};
  std::mt19937 random{5};
  double off = 0.0, spread = 0.0;  // of the means of the last image from the wall: mean and standard deviation [m]

  Watching() { camera.noise = {noise, 0.0}; }
  void look(double distance) {
    look(distance, distance, [](std::size_t, std::size_t) { return true; });
  }
  /// What is nearer than the wall, in some pixels alone, of which `off` and `spread` are then.
  template <class Shows>
  void look(double wall, double nearer, Shows&& shows) {
    std::normal_distribution<float> normal(0.0f, static_cast<float>(noise));
    std::vector<float> pixels(160 * 120);
    std::vector<char> chosen(pixels.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      chosen[i] = shows(i % 160, i / 160);
      pixels[i] = static_cast<float>(chosen[i] ? nearer : wall) + normal(random);
    }
    image.take(camera, {std::span<const float>(pixels), 1.0});
    add(nearer, chosen);
  }
  /// The arm is in front of everything.
  void hide(double distance) {
    std::vector<float> pixels(160 * 120, static_cast<float>(distance));
    image.take(camera, {std::span<const float>(pixels), 1.0});
    std::fill(image.labels(), image.labels() + image.size(), PixelLabel::arm);
    steady.add(camera, image);
  }

 private:
  void add(double distance, const std::vector<char>& chosen) {
    BOOST_TEST(test::allocations_of([&] { steady.add(camera, image); }) == 0u);
    double sum = 0.0, squares = 0.0;
    int num = 0;
    for (std::size_t i = 0; i < image.size(); ++i) {
      if (image.labels()[i] == PixelLabel::obstacle && chosen[i]) {
        const double away = static_cast<double>(steady.depth()[i]) - distance;
        sum += away;
        squares += away * away;
        ++num;
      }
    }
    BOOST_TEST_REQUIRE(num > 300);
    off = sum / num;
    spread = std::sqrt(squares / num - off * off);
  }
};

BOOST_FIXTURE_TEST_CASE(the_depth_of_what_rests_has_less_noise, Watching) {
  look(1.0);
  BOOST_TEST(spread > 0.9 * noise);
  for (int n = 0; n < 20; ++n) {
    look(1.0);
  }
  BOOST_TEST(spread < 0.45 * noise);
  BOOST_TEST(std::abs(off) < 0.02 * noise);
  steady.forget();
  look(1.0);
  BOOST_TEST(spread > 0.9 * noise);
}

BOOST_FIXTURE_TEST_CASE(another_surface_is_seen_at_once, Watching) {
  for (int n = 0; n < 20; ++n) {
    look(1.0);
  }
  look(0.9);
  BOOST_TEST(std::abs(off) < 0.02 * noise);
  look(1.2);
  BOOST_TEST(std::abs(off) < 0.02 * noise);
}

BOOST_FIXTURE_TEST_CASE(one_stray_depth_does_not_forget_what_rests, Watching) {
  for (int n = 0; n < 20; ++n) {
    look(1.0);
  }
  look(0.9);
  BOOST_TEST(spread > 0.9 * noise);
  look(1.0);
  BOOST_TEST(spread < 0.45 * noise);
  look(0.9);
  look(0.9);
  for (int n = 0; n < 3; ++n) {  // two in a row are another surface
    look(1.0);
    BOOST_TEST(spread > 0.9 * noise);
  }
}

BOOST_FIXTURE_TEST_CASE(what_the_arm_hides_for_a_while_rests_as_before, Watching) {
  for (int n = 0; n < 20; ++n) {
    look(1.0);
  }
  hide(0.6);
  hide(0.6);
  hide(0.6);
  look(1.0);
  BOOST_TEST(spread < 0.45 * noise);
  hide(0.6);
  for (int n = 0; n < 4; ++n) {  // it has come nearer behind the arm
    look(1.0 - 2.5 * noise);
  }
  BOOST_TEST(std::abs(off) < 0.5 * noise);
}

BOOST_FIXTURE_TEST_CASE(what_moves_is_never_far_ahead_of_its_depth, Watching) {
  for (const double speed : {0.02, 0.1, 0.2, 0.5, 1.0}) {  // towards the camera [m/s]
    steady.forget();
    for (int n = 0; n < 20; ++n) {
      look(2.0);
    }
    double most = 0.0, later = 0.0;  // later: once it is seen to move
    for (int n = 1; n <= 40; ++n) {
      look(2.0 - speed * n / 30.0);
      most = std::max(most, std::abs(off));
      later = n < 5 ? 0.0 : std::max(later, std::abs(off));
    }
    BOOST_TEST(most < 2.0 * noise, "at " << speed << " m/s it is " << most << " m behind");
    if (speed / 30.0 >= noise) {
      BOOST_TEST(later < 0.1 * noise, "at " << speed << " m/s it is " << later << " m behind");
    }
  }
}

/// A disc of 25 pixels across.
bool ball(std::size_t u, std::size_t v) { return (u - 67) * (u - 67) + (v - 53) * (v - 53) < 13 * 13; }

/// How far something that comes nearer is behind its depth, at most [sigma]; it begins some sigma before a wall at 2 m.
template <class Shows>
double most_behind(Watching& camera, double before, double speed, const Shows& shows) {
  camera.steady.forget();
  const double begin = 2.0 - before * noise;
  for (int n = 0; n < 20; ++n) {
    camera.look(2.0, begin, shows);
  }
  double most = 0.0;
  for (int n = 1; n <= 60; ++n) {
    camera.look(2.0, begin - speed * noise * n, shows);
    most = std::max(most, std::abs(camera.off) / noise);
  }
  return most;
}

BOOST_FIXTURE_TEST_CASE(what_moves_in_a_part_of_the_image_is_hardly_ahead_of_its_depth, Watching) {
  for (const double speed : {0.05, 0.1, 0.2, 0.38, 0.5, 0.7, 0.95}) {  // towards the camera, in sigma from image to image
    const double most = most_behind(*this, 100.0, speed, ball);
    BOOST_TEST(most < 0.9, "at " << speed << " sigma an image it is " << most << " sigma behind");
    if (speed <= 0.5) {
      BOOST_TEST(spread < 0.7 * noise, "at " << speed << " sigma an image " << spread << " m of noise are left");
    }
  }
}

BOOST_FIXTURE_TEST_CASE(what_moves_in_a_part_of_each_tile_is_left_to_its_pixels, Watching) {
  const auto stripes = [](std::size_t u, std::size_t) { return u % 8 < 2; };
  for (const double speed : {0.2, 0.5, 0.7, 0.9}) {
    const double most = most_behind(*this, 2.5, speed, stripes);
    BOOST_TEST(most < 2.0, "at " << speed << " sigma an image it is " << most << " sigma behind");
  }
}

BOOST_FIXTURE_TEST_CASE(a_slow_motion_is_followed_where_noise_is_told_too_large, Watching) {
  camera.noise = {4.0 * noise, 0.0};
  const double most = most_behind(*this, 100.0, 0.4, ball);
  BOOST_TEST(most < 0.9 * 4.0);  // of the noise that was told
}

BOOST_FIXTURE_TEST_CASE(without_noise_depths_stay_as_they_are, Watching) {
  camera.noise = {0.0, 0.0};
  look(1.0);
  look(1.0);
  BOOST_TEST(spread > 0.9 * noise);
}

// The map: what is seen stays, what is seen through goes, what is hidden is kept for a while.
#include "sidestep/perception/voxel_map.hpp"

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "sidestep/perception/steady_depth.hpp"
#include "sidestep/perception/unseen_space.hpp"
#include "support/allocations.hpp"
#include "support/depth_scene.hpp"

using namespace sidestep;

// Not in a namespace without a name: test cases derive from it.
struct Mapped {
  DepthCamera camera = test::small_camera({1.5, 0.0, 0.5}, {0.0, 0.0, 0.5});
  CameraRays rays{camera};
  DepthImage image{camera};
  std::vector<float> no_arm = std::vector<float>(160 * 120, std::numeric_limits<float>::infinity());
  PerceptionSettings settings = {.voxel = 0.02};  // pixels are 1.2 cm wide
  VoxelMap map{Eigen::Vector3d::Zero(), 1.0, settings};
  double time = 1.0;
  std::vector<float> pixels;

  std::uint8_t number = 0;

  SeenImage seen() { return {camera, rays, camera.pose, image, image.depth(), no_arm.data(), number, time}; }
  void take(const test::DepthScene& scene) {
    pixels = scene.image(camera);
    image.take(camera, {std::span<const float>(pixels), 1.0});
  }
  void add() {
    map.add(seen());
    time += 1.0 / 30.0;
  }
  void add(const test::DepthScene& scene) {
    take(scene);
    add();
  }
  /// Number of voxels that count as obstacles and whose middle is within a distance of a point.
  int near(const Eigen::Vector3d& point, double distance) const {
    int num = 0;
    for (const Voxel& voxel : map.voxels()) {
      if (voxel.cell >= 0 && voxel.counts) {
        num += (voxel.middle() - point).norm() < distance ? 1 : 0;
      }
    }
    return num;
  }
};

namespace {

const Eigen::Vector3d ball_at(0.0, 0.0, 0.5);

test::DepthScene wall() {
  test::DepthScene scene;
  scene.add_sphere({-102.0, 0.0, 0.5}, 100.0);  // a wall at x = -2 m
  return scene;
}
test::DepthScene wall_and_ball() {
  test::DepthScene scene = wall();
  scene.add_sphere(ball_at, 0.1);
  return scene;
}

}  // namespace

/// A wall at x = -0.5 m, and noise of which each patch of 5 x 5 pixels has the same, as of a camera that matches windows.
struct Noisy : Mapped {
  std::mt19937 random{3};
  const Eigen::Vector3d wall_at{-0.5, 0.0, 0.5};

  Noisy() {
    camera.noise = {0.015, 0.0};
    camera.fx = camera.fy = 400.0;  // pixels of 5 mm at the wall
    rays = CameraRays(camera);
  }
  void look(SteadyDepth& steady) {
    test::DepthScene scene;
    scene.add_sphere({wall_at.x() - 100.0, 0.0, 0.5}, 100.0);
    pixels = scene.image(camera);
    std::normal_distribution<float> normal(0.0f, 0.015f);
    for (int v = 0; v < 120; v += 5) {
      for (int u = 0; u < 160; u += 5) {
        const float error = normal(random);
        for (int i = 0; i < 25; ++i) {
          pixels[static_cast<std::size_t>((v + i / 5) * 160 + u + i % 5)] += error;
        }
      }
    }
    image.take(camera, {std::span<const float>(pixels), 1.0});
    steady.add(camera, image);
    SeenImage shown = seen();
    shown.depth = steady.depth();
    map.add(shown);
    time += 1.0 / 30.0;
  }
  /// Share of the cells that count at the middle of the wall and stand out of it by more than some metres.
  double share_beyond(double out) const {
    int num = 0, beyond = 0;
    for (const Voxel& voxel : map.voxels()) {
      const Eigen::Vector3d from = voxel.middle() - wall_at;
      if (voxel.cell >= 0 && voxel.counts && from.tail<2>().norm() < 0.2) {
        ++num;
        beyond += from.x() > out ? 1 : 0;
      }
    }
    return num == 0 ? -1.0 : static_cast<double>(beyond) / num;
  }
};

BOOST_FIXTURE_TEST_CASE(noise_does_not_make_a_surface_thick, Noisy) {
  const auto most_beyond = [&](int images) {
    map.clear();
    SteadyDepth steady(camera, images);
    double most = 0.0;
    for (int n = 0; n < 90; ++n) {
      look(steady);
      most = n < 30 ? 0.0 : std::max(most, share_beyond(0.02));
    }
    BOOST_TEST(share_beyond(-0.04) > 0.9);  // the wall itself is there
    return most;
  };
  BOOST_TEST(most_beyond(1) > 0.15);
  BOOST_TEST(most_beyond(8) < 0.04);
}

/// A cell at a wall that rests, and images that show something else there.
struct Missed : Noisy {
  std::vector<float> wall;
  Eigen::Vector3d point;   // in the cell
  std::size_t middle = 0;  // the pixel of the middle of its box

  Missed() {
    test::DepthScene scene;
    scene.add_sphere({wall_at.x() - 100.0, 0.0, 0.5}, 100.0);
    wall = scene.image(camera);
  }
  int cell() const { return map.voxel_of(point.cast<float>().eval().data()); }
  /// Shows the wall alone, for long enough to be known to rest.
  void show_wall() {
    for (int n = 0; n < 6; ++n) {
      show(0.0f, true);
    }
    const std::size_t any = 63 * 160 + 83;
    point = camera.pose * Eigen::Vector3d(rays.x()[any] * wall[any], rays.y()[any] * wall[any], wall[any]);
    BOOST_REQUIRE(cell() >= 0);
    const Voxel& voxel = map.voxels()[static_cast<std::size_t>(cell())];
    const Eigen::Vector2d pixel = camera.project(camera.pose.inverse() * voxel.middle());
    middle = static_cast<std::size_t>(std::round(pixel.y()) * 160.0 + std::round(pixel.x()));
  }
  /// An image of all pixels, or of none but the middle one, that shows what is farther away by so much [m].
  void show(float farther, bool whole) {
    pixels.assign(wall.size(), 0.0f);
    for (std::size_t i = 0; i < wall.size(); ++i) {
      pixels[i] = whole || i == middle ? wall[i] + farther : 0.0f;
    }
    image.take(camera, {std::span<const float>(pixels), 1.0});
    add();
  }
  /// Number of such images after which the cell is gone, at most 100.
  int gone_after(float farther, bool whole) {
    map.clear();
    show_wall();
    for (int n = 1; n < 100; ++n) {
      show(farther, whole);
      if (cell() < 0) {
        return n;
      }
    }
    return 100;
  }
};

BOOST_FIXTURE_TEST_CASE(a_pixel_of_a_cell_that_misses_it_says_less_than_all_of_them, Missed) {
  BOOST_TEST(gone_after(-0.03f, true) == 5);    // They show the surface in another cell: this one was noise.
  BOOST_TEST(gone_after(-0.03f, false) == 25);  // as many pixels
  BOOST_TEST(gone_after(0.5f, true) == 2);      // It is seen through.
  BOOST_TEST(gone_after(0.5f, false) == 25);    // One of five samples is free, and no more is seen.
}

BOOST_FIXTURE_TEST_CASE(what_was_at_the_end_of_the_range_goes, Missed) {
  camera.far = wall[60 * 160 + 80] + 0.03;
  BOOST_TEST(gone_after(0.5f, true) == 5);
}

BOOST_FIXTURE_TEST_CASE(boxes_hold_all_points_that_were_seen, Mapped) {
  add(wall_and_ball());
  BOOST_TEST(near(ball_at, 0.12) > 20);
  int num = 0, num_missed = 0;
  for (int i = 0; i < 160 * 120; ++i) {
    const float z = image.depth()[i];
    if (z > 1.6f || image.labels()[i] != PixelLabel::obstacle) {
      continue;
    }
    const Eigen::Vector3f p =
        (camera.pose * (static_cast<double>(z) * Eigen::Vector3d(rays.x()[i], rays.y()[i], 1.0))).cast<float>();
    const int index = map.voxel_of(p.data());
    bool is_held = index >= 0;
    for (int axis = 0; is_held && axis < 3; ++axis) {
      const Voxel& voxel = map.voxels()[static_cast<std::size_t>(index)];
      is_held = p[axis] >= voxel.low[axis] - 1e-5f && p[axis] <= voxel.high[axis] + 1e-5f;
    }
    ++num;
    num_missed += is_held ? 0 : 1;
  }
  BOOST_TEST(num > 150);
  BOOST_TEST(num_missed <= 2);  // points on the border of two cells, by rounding
}

BOOST_FIXTURE_TEST_CASE(what_is_seen_through_goes_after_two_images, Mapped) {
  add(wall_and_ball());
  add(wall_and_ball());
  const int before = near(ball_at, 0.12);
  BOOST_TEST(before > 20);
  add(wall());
  BOOST_TEST(near(ball_at, 0.12) == before);
  add(wall());
  BOOST_TEST(near(ball_at, 0.12) == 0);
}

BOOST_FIXTURE_TEST_CASE(what_moved_is_kept_ten_times_as_long_as_it_was_seen, Mapped) {
  for (int n = 0; n < 10; ++n) {
    add(wall_and_ball());  // seen for 0.3 s
  }
  for (const int index : map.touched()) {
    map.set_moves(index, true);
  }
  const int before = near(ball_at, 0.12);
  test::DepthScene hides = wall_and_ball();
  hides.add_sphere({0.9, 0.0, 0.5}, 0.3);
  for (int n = 0; n < 30 * 3; ++n) {
    add(hides);
  }
  BOOST_TEST(near(ball_at, 0.12) == before);
  for (int n = 0; n < 15; ++n) {
    add(hides);
  }
  BOOST_TEST(near(ball_at, 0.12) == 0);  // 0.3 s and ten times 0.3 s
}

BOOST_FIXTURE_TEST_CASE(what_rests_and_is_hidden_is_kept_as_long_as_set, Mapped) {
  for (int n = 0; n < 5; ++n) {
    add(wall_and_ball());
  }
  const int before = near(ball_at, 0.12);
  test::DepthScene hides = wall_and_ball();
  hides.add_sphere({0.9, 0.0, 0.5}, 0.3);
  add(hides);
  time = 1.0 + 4.0 / 30.0 + 29.9;  // seen last after 4/30 s
  add();
  BOOST_TEST(near(ball_at, 0.12) == before);
  time = 1.0 + 4.0 / 30.0 + 30.1;
  add();
  BOOST_TEST(near(ball_at, 0.12) == 0);
}

BOOST_FIXTURE_TEST_CASE(the_arm_in_front_hides_too, Mapped) {
  for (int n = 0; n < 3; ++n) {
    add(wall_and_ball());
  }
  const int before = near(ball_at, 0.12);
  take(wall());
  std::fill(image.labels(), image.labels() + image.size(), PixelLabel::arm);
  std::fill(no_arm.begin(), no_arm.end(), 0.5f);
  add();
  add();
  BOOST_TEST(near(ball_at, 0.12) == before);
  std::fill(no_arm.begin(), no_arm.end(), 1.40f);  // the arm is where the ball is
  for (int n = 0; n < 10; ++n) {
    add();
  }
  BOOST_TEST(near(ball_at, 0.12) == before);
  std::fill(no_arm.begin(), no_arm.end(), 2.5f);  // the arm is behind: what is in front of it is free
  add();
  add();
  BOOST_TEST(near(ball_at, 0.12) == 0);
}

/// Half of an image of a ball is the arm, beside a shadow of some pixels without depth; cells of the ball that it cuts.
struct Cut : Mapped {
  std::vector<Voxel> before;
  void begin() {
    for (int n = 0; n < 3; ++n) {
      add(wall_and_ball());
    }
    before = map.voxels();
  }
  void take_half(int shadow) {
    take(wall_and_ball());
    for (int i = 0; i < 160 * 120; ++i) {
      if (i % 160 < 80) {  // through the middle of the ball
        image.labels()[i] = i % 160 < 80 - shadow ? PixelLabel::arm : PixelLabel::nothing;
        no_arm[static_cast<std::size_t>(i)] = 0.5f;
      }
    }
  }
  /// Number of cells of the ball that are cut; checks that they hold what was known of them.
  int cut() const {
    int num = 0;
    for (std::size_t n = 0; n < before.size(); ++n) {
      const Voxel& voxel = map.voxels()[n];
      if (voxel.cut_by != 0 && (voxel.middle() - ball_at).norm() < 0.12) {
        ++num;
        BOOST_TEST((voxel.low_corner() - before[n].low_corner()).maxCoeff() <= 0.0);
        BOOST_TEST((voxel.high_corner() - before[n].high_corner()).minCoeff() >= 0.0);
      }
    }
    return num;
  }
};

BOOST_FIXTURE_TEST_CASE(what_the_arm_hides_of_a_cell_is_kept, Cut) {
  begin();
  for (const int shadow : {0, 6}) {
    take_half(shadow);
    for (int n = 0; n < 10; ++n) {
      add();
    }
    BOOST_TEST(cut() > 3);
  }
}

BOOST_FIXTURE_TEST_CASE(what_the_arm_hides_from_one_camera_is_kept_while_another_sees_a_part, Cut) {
  begin();
  for (const double later : {0.0, 0.01}) {  // images at the same time, and in turn
    for (int n = 0; n < 10; ++n) {
      take_half(0);
      map.add(seen());
      time += later;
      for (int i = 0; i < 160 * 120; ++i) {  // the other one shows as much, and no arm
        image.labels()[i] = image.labels()[i] == PixelLabel::arm ? PixelLabel::edge : image.labels()[i];
      }
      number = 1;
      add();
      number = 0;
    }
    BOOST_TEST(cut() > 3);
  }
}

BOOST_FIXTURE_TEST_CASE(a_cell_beside_what_rests_is_told_from_one_that_is_apart, Mapped) {
  for (int n = 0; n < 40; ++n) {
    add(wall_and_ball());
  }
  test::DepthScene scene = wall_and_ball();
  scene.add_sphere({0.0, 0.115, 0.5}, 0.015);
  scene.add_sphere({0.0, 0.3, 0.5}, 0.015);
  add(scene);
  int beside = 0, apart = 0;
  for (const int index : map.touched()) {
    const Voxel& voxel = map.voxels()[static_cast<std::size_t>(index)];
    if (voxel.last > voxel.first) {
      continue;
    }
    if (voxel.middle().y() < 0.12) {
      beside += map.is_beside_rest(voxel) ? 1 : 0;
    } else if (voxel.middle().y() > 0.2) {
      BOOST_TEST(!map.is_beside_rest(voxel));
      ++apart;
    }
  }
  BOOST_TEST(beside > 0);
  BOOST_TEST(apart > 0);
}

BOOST_FIXTURE_TEST_CASE(holes_hide_what_was_there, Mapped) {
  for (int n = 0; n < 3; ++n) {
    add(wall_and_ball());
  }
  const int before = near(ball_at, 0.12);
  pixels.assign(pixels.size(), 0.0f);
  image.take(camera, {std::span<const float>(pixels), 1.0});
  add();
  add();
  BOOST_TEST(near(ball_at, 0.12) == before);
}

BOOST_FIXTURE_TEST_CASE(a_few_pixels_count_when_a_second_image_shows_them, Mapped) {
  take(wall());
  const auto speck = [&] {
    for (int u = 78; u < 82; ++u) {
      image.labels()[60 * 160 + u] = u == 79 || u == 80 ? PixelLabel::obstacle : PixelLabel::nothing;
    }
    add();
  };
  for (int u = 79; u < 81; ++u) {
    pixels[static_cast<std::size_t>(60 * 160 + u)] = 1.5f;
  }
  image.take(camera, {std::span<const float>(pixels), 1.0});
  speck();
  BOOST_TEST(near({0.0, 0.0, 0.5}, 0.1) == 0);
  speck();
  BOOST_TEST(near({0.0, 0.0, 0.5}, 0.1) > 0);

  map.clear();  // depths that fly beside an edge come back to a cell now and then
  const auto nothing = [&] {
    std::fill(image.labels(), image.labels() + image.size(), PixelLabel::nothing);
    add();
  };
  for (int n = 0; n < 5; ++n) {
    image.take(camera, {std::span<const float>(pixels), 1.0});
    speck();
    BOOST_TEST(near({0.0, 0.0, 0.5}, 0.1) == 0);
    nothing();
    nothing();
  }
  image.take(camera, {std::span<const float>(pixels), 1.0});
  speck();
  nothing();
  image.take(camera, {std::span<const float>(pixels), 1.0});
  speck();
  BOOST_TEST(near({0.0, 0.0, 0.5}, 0.1) > 0);  // a thin thing may be missed by one image
  while (time < 5.0) {
    nothing();
  }
  BOOST_TEST(near({0.0, 0.0, 0.5}, 0.1) == 0);  // two images do not make it rest
}

BOOST_FIXTURE_TEST_CASE(what_flew_beside_a_near_edge_goes_when_it_is_seen_through, Mapped) {
  const auto look = [&](float at_speck) {  // a plate at 1 m fills the columns up to 79, beside the speck
    take(wall());
    for (int v = 0; v < 120; ++v) {
      std::fill_n(pixels.begin() + v * 160, 80, 1.0f);
    }
    pixels[59 * 160 + 80] = pixels[60 * 160 + 80] = at_speck;
    image.take(camera, {std::span<const float>(pixels), 1.0});
    image.labels()[59 * 160 + 80] = image.labels()[60 * 160 + 80] = PixelLabel::obstacle;
    add();
  };
  look(1.5f);
  look(1.5f);
  BOOST_TEST(near({0.0, 0.0, 0.5}, 0.1) > 0);
  look(3.5f);
  BOOST_TEST(near({0.0, 0.0, 0.5}, 0.1) > 0);
  look(3.5f);
  BOOST_TEST(near({0.0, 0.0, 0.5}, 0.1) == 0);
}

BOOST_FIXTURE_TEST_CASE(a_map_of_the_same_scene_allocates_nothing, Mapped) {
  const test::DepthScene scene = wall_and_ball();
  add(scene);
  add(scene);
  BOOST_TEST(test::allocations_of([&] { add(); }) == 0u);
}

BOOST_FIXTURE_TEST_CASE(unseen_space_is_what_no_ray_has_passed, Mapped) {
  UnseenSpace space(Eigen::Vector3d(0.0, 0.0, 0.5), 0.5, settings);
  BOOST_TEST(space.seen_share(1.0) == 0.0);
  take(wall_and_ball());
  space.add(seen());
  const double share = space.seen_share(time);
  BOOST_TEST(share > 0.6);
  BOOST_TEST(share < 0.97);  // the shadow of the ball
  int behind = 0, in_front = 0;
  const Eigen::Matrix3Xd border = space.border(time);
  for (Eigen::Index n = 0; n < border.cols(); ++n) {
    const Eigen::Vector3d p = border.col(n);
    behind += p.x() < -0.1 && std::hypot(p.y(), p.z() - 0.5) < 0.15 ? 1 : 0;
    in_front += p.x() > 0.15 && std::hypot(p.y(), p.z() - 0.5) < 0.1 ? 1 : 0;
  }
  BOOST_TEST(behind > 5);
  BOOST_TEST(in_front == 0);
  camera.noise = {0.05,
                  0.0};  // three standard deviations are more than a cell: it must be seen through to its middle all the same
  UnseenSpace noisy(Eigen::Vector3d(0.0, 0.0, 0.5), 0.5, settings);
  noisy.add(seen());
  int behind_ball = 0;
  const Eigen::Matrix3Xd noisy_border = noisy.border(time);
  for (Eigen::Index n = 0; n < noisy_border.cols(); ++n) {
    behind_ball += (noisy_border.col(n) - Eigen::Vector3d(0.06, 0.0, 0.5)).cwiseAbs().maxCoeff() < 0.05 ? 1 : 0;
  }
  BOOST_TEST(behind_ball > 0);  // just behind the front of the ball, at x = 0.1
  space.add_arm({-0.25, 0.0, 0.5}, 0.15 * 0.15 * Eigen::Matrix3d::Identity(), time);
  BOOST_TEST(space.seen_share(time) > share);
  space.forget();
  BOOST_TEST(space.seen_share(time) == 0.0);
}

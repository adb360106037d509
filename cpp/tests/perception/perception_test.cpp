// The whole path: what a controller gets from images, by source and time.
#include "sidestep/perception/perception.hpp"

#include <algorithm>
#include <atomic>
#include <boost/test/unit_test.hpp>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "support/covered_arm.hpp"
#include "support/depth_scene.hpp"
#include "support/repeatable_settings.hpp"

using namespace sidestep;

// Not in a namespace without a name: test cases derive from it.
struct Watched {
  Arm arm = test::covered_arm(test::arm_limits(4));
  Controller controller{arm, test::repeatable_settings(ControllerSettings::Output::acceleration)};
  Eigen::VectorXd q = Eigen::Vector4d(0.3, -0.8, 0.5, 1.1);
  DepthCamera camera = test::small_camera({2.0, 0.2, 0.9}, {0.0, 0.0, 0.6});
  PerceptionSettings settings;
  std::unique_ptr<Perception> perception;
  test::DepthScene scene;
  double time = 10.0;
  std::mt19937 random{1};
  std::normal_distribution<float> error;

  Watched() {
    camera.translation_error = 0.01;
    settings.voxel = 0.02;  // a pixel is as large
    scene.floor = -0.3;
    scene.add_sphere({0.2, 0.9, 0.5}, 0.15);
    scene.add_arm(arm.robot(), arm.body(), q);
  }
  void start() { perception = std::make_unique<Perception>(controller, std::vector{camera}, settings); }
  void step() { controller.step(q, Eigen::VectorXd::Zero(4), time); }
  PerceptionReport look(const Capture& capture) {
    const std::vector<float> pixels = scene.image(camera);
    return perception->update("front", RawDepth{std::span<const float>(pixels), 1.0}, capture);
  }
  PerceptionReport look() {
    const PerceptionReport report = look(Capture{time, {}, std::nullopt});
    time += 0.03;
    step();
    return report;
  }
  /// An image with the constant noise of the camera, and a share of its pixels without a depth; no time passes.
  void look_with_noise(float holes = 0.0f) {
    std::vector<float> pixels = scene.image(camera);
    std::uniform_real_distribution<float> share;
    for (float& depth : pixels) {
      const bool is_hole = holes > 0.0f && share(random) < holes;
      depth = is_hole ? 0.0f : depth > 0.0f ? depth + static_cast<float>(camera.noise.constant) * error(random) : depth;
    }
    perception->update("front", RawDepth{std::span<const float>(pixels), 1.0}, Capture{time, {}, std::nullopt});
  }
  /// What a source said last; null: nothing.
  std::shared_ptr<const Obstacles> said(const std::string& source) const {
    for (const SourceContent& content : controller.said()) {
      if (content.name == source) {
        return content.obstacles;
      }
    }
    return nullptr;
  }
  /// Number of points of a source within a distance of a place.
  int points(const std::string& source, const Eigen::Vector3d& place, double distance) const {
    const auto set = said(source);
    return set == nullptr ? -1
                          : static_cast<int>(((set->points().colwise() - place).colwise().norm().array() < distance).count());
  }
};

BOOST_FIXTURE_TEST_CASE(an_image_gives_obstacles_without_the_arm, Watched) {
  start();
  BOOST_TEST(!look(Capture{time, {}, std::nullopt}).used);
  BOOST_TEST(said("front") == nullptr);
  step();
  const PerceptionReport report = look();
  BOOST_TEST(report.used);
  BOOST_TEST(report.question == "");
  BOOST_TEST(report.arm_pixels > 200);
  BOOST_TEST(points("front", {0.2, 0.9, 0.5}, 0.17) > 20);
  const auto set = said("front");
  BOOST_REQUIRE(set != nullptr);
  const KinematicState state = test::state_at(arm.robot(), q);
  int on_arm = 0;
  for (const BodyEllipsoid& ellipsoid : body_ellipsoids(arm.robot(), arm.body(), "test")) {
    const KinematicState::Link& link = link_or_world(state, ellipsoid.joint);
    const Eigen::Matrix3d A = ellipsoid.shape.inverse();
    for (Eigen::Index n = 0; n < set->size(); ++n) {
      const Eigen::Vector3d y = link.R_WL.transpose() * (set->points().col(n) - link.p_WL) - ellipsoid.mean;
      on_arm += y.dot(A * y) <= 1.0 ? 1 : 0;
    }
  }
  BOOST_TEST(on_arm == 0);
  BOOST_TEST(report.seen == set->size());
}

BOOST_FIXTURE_TEST_CASE(what_the_arm_hides_is_remembered, Watched) {
  start();
  step();
  scene.balls.resize(1);  // the arm is elsewhere in the image
  const Eigen::VectorXd away = Eigen::Vector4d(0.0, 2.4, 0.0, 0.0);
  for (int n = 0; n < 30; ++n) {
    look(Capture{time, away, std::nullopt});
    time += 0.03;
  }
  BOOST_TEST(points("front", {0.2, 0.9, 0.5}, 0.17) > 20);
  scene.add_sphere({1.0, 0.55, 0.7}, 0.25);  // something comes in front
  PerceptionReport report;
  for (int n = 0; n < 10; ++n) {
    report = look(Capture{time, away, std::nullopt});
    time += 0.03;
  }
  BOOST_TEST(report.remembered > 10);
  BOOST_TEST(points("memory", {0.2, 0.9, 0.5}, 0.17) > 10);
}

BOOST_FIXTURE_TEST_CASE(what_is_outside_of_the_view_of_a_distorting_lens_is_not_seen_free, Watched) {
  camera.fx = camera.fy = 200.0;
  camera.distortion_model = DistortionModel::brown_conrady;
  camera.distortion = {-0.3, 0.0, 0.0, 0.0, 0.0};
  settings.memory = 100.0;
  start();
  step();
  const Eigen::Vector3d ball(0.2, 0.9, 0.5);
  for (int n = 0; n < 30; ++n) {
    look();
  }
  const int seen = points("front", ball, 0.17);
  BOOST_TEST(seen > 10);
  const Eigen::Vector3d to = camera.pose.inverse() * ball;
  for (int n = 0; n < 10; ++n) {  // it turns away until the ball is at x/z = 1.7, and sees far
    const Eigen::Isometry3d turned =
        camera.pose * Eigen::AngleAxisd(std::atan2(to.x(), to.z()) - std::atan(1.7), Eigen::Vector3d::UnitY());
    const std::vector<float> pixels(160 * 120, 3.9f);
    perception->update("front", RawDepth{std::span<const float>(pixels), 1.0}, Capture{time, {}, turned});
    time += 0.03;
    step();
  }
  BOOST_TEST(points("memory", ball, 0.17) > seen / 2);
}

BOOST_FIXTURE_TEST_CASE(told_shapes_explain_their_points_and_regions_are_left_out, Watched) {
  start();
  step();
  const int floor = points("front", {0.0, 0.0, 0.0}, 100.0);
  BOOST_TEST(floor == -1);
  look();
  look();  // most cells show fewer than three pixels, so that a second image must show them
  const int all = points("front", {0.0, 0.0, 0.0}, 100.0);
  controller.set_obstacles(test::ball({0.2, 0.9, 0.5}, 0.15));
  const PerceptionReport explained = look();
  BOOST_TEST(points("front", {0.2, 0.9, 0.5}, 0.17) == 0);
  BOOST_TEST(explained.explained > 20);
  BOOST_TEST(points("front", {0.0, 0.0, 0.0}, 100.0) < all);
  controller.set_obstacles(Obstacles::none());
  controller.remove_obstacles("scene");
  look();
  BOOST_TEST(points("front", {0.2, 0.9, 0.5}, 0.17) > 20);
  controller.set_obstacles(test::ball({0.2, 0.9, 0.5}, 0.15), {.source = "tracker"});
  look();
  BOOST_TEST(points("front", {0.2, 0.9, 0.5}, 0.17) == 0);
  controller.remove_obstacles("tracker");
  look();
  BOOST_TEST(points("front", {0.2, 0.9, 0.5}, 0.17) > 20);
  perception->leave_out("cup", test::ball({0.2, 0.9, 0.5}, 0.1), 0.08);
  look();
  BOOST_TEST(points("front", {0.2, 0.9, 0.5}, 0.17) == 0);
  const std::vector<PixelLabel> labels = perception->labels("front");
  BOOST_TEST(std::count(labels.begin(), labels.end(), PixelLabel::left_out) > 20);
  perception->take_in("cup");
  look();
  BOOST_TEST(points("front", {0.2, 0.9, 0.5}, 0.17) > 20);
  BOOST_CHECK_THROW(perception->take_in("cup"), std::invalid_argument);
}

BOOST_FIXTURE_TEST_CASE(a_camera_on_a_link_is_where_the_arm_was, Watched) {
  camera.link = "tip";
  camera.pose = Eigen::Isometry3d::Identity();
  camera.pose.translation().x() = 0.08;
  start();
  step();
  const KinematicState state = test::state_at(arm.robot(), q);
  const Eigen::Isometry3d X_WC = frame_pose(arm.robot(), state, arm.robot().frame_index("tip")) * camera.pose;
  const std::vector<float> pixels(160 * 120, 0.5f);
  const PerceptionReport report =
      perception->update("front", RawDepth{std::span<const float>(pixels), 1.0}, Capture{time, {}, std::nullopt});
  BOOST_TEST(report.used);
  BOOST_TEST((perception->pose("front").matrix() - X_WC.matrix()).norm() < 1e-12);
  BOOST_TEST(points("front", X_WC * Eigen::Vector3d(0.0, 0.0, 0.5), 0.03) > 0);
}

BOOST_FIXTURE_TEST_CASE(what_moves_has_its_velocity, Watched) {
  camera.fx = camera.fy = 200.0;
  start();
  step();
  scene.floor = -10.0;
  for (int n = 0; n < 15; ++n) {
    scene.balls.front().centre.y() = 0.9 - 0.5 * 0.03 * n;
    look();
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int num = 0;
  for (const Perception::Cell& cell : perception->cells()) {
    if ((cell.centre - scene.balls.front().centre).norm() < 0.17 && !cell.is_remembered) {
      sum += cell.velocity;
      ++num;
    }
  }
  BOOST_TEST(num > 20);
  BOOST_TEST((sum / num - Eigen::Vector3d(0.0, -0.5, 0.0)).norm() <
             0.2);  // cells of 2 cm stand still, images 12 cm apart are compared
}

BOOST_FIXTURE_TEST_CASE(few_pixels_far_away_count_at_once, Watched) {
  constexpr double noise = 0.05, period = 0.1, speed = 0.5;  // [m], [s], [m/s]
  camera.noise = {noise, 0.0};
  start();
  step();
  const auto see = [&](const Eigen::Vector3d& centre) {
    scene = {};
    scene.floor = -10.0;
    scene.add_sphere(centre, 0.07);  // some 40 pixels, whose noise spreads them over 100 cells
    scene.add_arm(arm.robot(), arm.body(), q);
    look_with_noise();
    time += period;
    step();
  };
  for (int n = 0; n < 5; ++n) {
    see({0.0, 0.0, -100.0});
  }
  Eigen::Vector3d centre;
  for (int n = 0; n < 5; ++n) {
    centre = {-0.1, 0.9 - speed * period * n, 0.5};
    see(centre);
    const auto num = points("front", centre, 0.07 + 3.0 * noise);
    BOOST_TEST_INFO("image " << n);
    BOOST_TEST(num >= 12);  // 9 and fewer as long as each cell had to show three pixels
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int num = 0;
  for (const Perception::Cell& cell : perception->cells()) {
    if ((cell.centre - centre).norm() < 0.07 + 3.0 * noise && cell.age == 0.0) {
      sum += cell.velocity;
      ++num;
    }
  }
  BOOST_TEST((sum / num - Eigen::Vector3d(0.0, -speed, 0.0)).norm() < 0.15);
}

BOOST_FIXTURE_TEST_CASE(what_comes_slowly_in_much_noise_has_the_velocity_of_its_middle_and_comes_twice, Watched) {
  constexpr double period = 0.1, speed = 0.2, noise = 0.03, reach = 0.07 + 3.0 * noise;  // [s], [m/s], [m]
  camera.noise = {noise, 0.0};
  start();
  step();
  int known = 0, twice = 0;
  double off = 0.0;
  constexpr int before = 3, first = 6, last = 20;  // images without it; those in which it is looked for
  for (int n = -before; n < last; ++n) {
    scene = {};
    const Eigen::Vector3d centre(-0.1, 0.9 - speed * period * n, 0.5);
    if (n >= 0) {
      scene.add_sphere(centre, 0.07);  // some 40 pixels
    }
    scene.add_arm(arm.robot(), arm.body(), q);
    look_with_noise();
    time += period;
    step();
    if (n < first) {
      continue;
    }
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int moving = 0, resting = 0;
    for (const Perception::Cell& cell : perception->cells()) {
      if ((cell.centre - centre).norm() < reach && cell.age == 0.0 && !cell.velocity.isZero(0.0)) {
        sum += cell.velocity;
        ++moving;
      }
    }
    const auto set = said("front");
    for (Eigen::Index k = 0; k < set->size(); ++k) {
      resting += (set->points().col(k) - centre).norm() < reach && set->velocities().col(k).isZero(0.0) ? 1 : 0;
    }
    if (moving >= 10) {
      ++known;
      twice += resting >= moving ? 1 : 0;
      off += (sum / moving - Eigen::Vector3d(0.0, -speed, 0.0)).norm();
    }
  }
  BOOST_TEST(known >= 0.7 * (last - first), known << " of " << last - first);
  BOOST_TEST(twice == known);
  BOOST_TEST(off < 0.1 * known);
}

BOOST_FIXTURE_TEST_CASE(what_appears_apart_from_what_rests_may_move, Watched) {
  camera.fx = camera.fy = 200.0;
  const Eigen::Vector3d place(0.3, 0.5, 0.6);
  step();
  for (const bool stands_still : {true, false}) {
    scene.balls.resize(1);
    scene.add_arm(arm.robot(), arm.body(), q);
    start();
    const auto see = [&](int images) {
      for (int n = 0; n < images; ++n, time += 0.03) {
        step();
        const auto pose = stands_still ? std::nullopt : std::optional<Eigen::Isometry3d>(camera.pose);
        BOOST_TEST(look(Capture{time, {}, pose}).used);
      }
    };
    const auto largest = [&] {
      const auto set = said("front");
      double found = -1.0;
      for (Eigen::Index n = 0; n < set->size(); ++n) {
        found = (set->points().col(n) - place).norm() < 0.12 ? std::max(found, set->uncertainty()[n]) : found;
      }
      return found;
    };
    see(45);
    BOOST_TEST(said("front")->uncertainty().isZero(0.0));
    scene.add_sphere(place, 0.1);
    see(1);
    BOOST_TEST(largest() == (stands_still ? 0.5 : 0.0));  // to a camera that moves something always comes into view
    BOOST_TEST(said("front")->velocities().isZero(0.0));
    see(45);
    BOOST_TEST(largest() == 0.0);
  }
}

BOOST_FIXTURE_TEST_CASE(what_the_first_image_of_a_fixed_camera_shows_may_move, Watched) {
  camera.fx = camera.fy = 200.0;
  for (const bool stands_still : {true, false}) {
    start();
    step();
    const auto pose = stands_still ? std::nullopt : std::optional<Eigen::Isometry3d>(camera.pose);
    for (int n = 0; n < 10; ++n) {
      BOOST_TEST(look(Capture{time, {}, pose}).used);
      BOOST_TEST_INFO("image " << n);
      BOOST_TEST(said("front")->velocities().isZero(0.0));
      if (n == 0) {
        BOOST_TEST((said("front")->uncertainty().array() == (stands_still ? 0.5 : 0.0)).all());
      }
      time += 0.03;
      step();
    }
    BOOST_TEST(said("front")->uncertainty().isZero(0.0));
  }
}

BOOST_FIXTURE_TEST_CASE(a_first_image_that_comes_after_a_newer_one_of_another_camera_may_show_what_moves, Watched) {
  camera.fx = camera.fy = 200.0;
  DepthCamera beside = camera;
  beside.name = "beside";
  perception = std::make_unique<Perception>(controller, std::vector{camera, beside}, settings);
  const std::vector<float> pixels = scene.image(camera);
  const auto update = [&](const std::string& name, double captured) {
    perception->update(name, RawDepth{std::span<const float>(pixels), 1.0}, Capture{captured, {}, std::nullopt});
  };
  for (int n = 0; n < 4; ++n, time += 0.03) {
    step();
  }
  update("beside", 10.06);
  update("front", 10.03);  // its cells were shown before, and later
  const auto set = said("front");
  BOOST_TEST(set->size() > 30);
  BOOST_TEST((set->uncertainty().array() == 0.5).all());
}

BOOST_FIXTURE_TEST_CASE(two_slow_images_tell_that_something_moves, Watched) {
  constexpr double period = 0.1, speed = 0.6, noise = 0.01;  // [s], [m/s], [m]
  camera.fx = camera.fy = 200.0;
  camera.noise = {noise, 0.0};
  for (const int before : {0, 20}) {  // images without it
    start();
    step();
    Eigen::Vector3d centre;
    for (int n = -before; n < 2; ++n) {
      scene.balls.resize(1);
      centre = {0.4, 0.2 - speed * period * n, 0.8};
      if (n >= 0) {
        scene.add_sphere(centre, 0.06);
      }
      scene.add_arm(arm.robot(), arm.body(), q);
      look_with_noise(0.05f);
      time += period;
      step();
    }
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int num = 0, elsewhere = 0;
    for (const Perception::Cell& cell : perception->cells()) {
      if (!cell.velocity.isZero(0.0)) {
        const bool is_it = (cell.centre - centre).norm() < 0.12;
        sum += is_it ? cell.velocity : Eigen::Vector3d(0.0, 0.0, 0.0);
        (is_it ? num : elsewhere) += 1;
      }
    }
    BOOST_TEST_INFO(before << " images before");
    BOOST_TEST(num >= 10);  // none before the third image
    BOOST_TEST((sum / std::max(num, 1) - Eigen::Vector3d(0.0, -speed, 0.0)).norm() < 0.3);
    BOOST_TEST(elsewhere == 0);
    const auto set = said("front");  // it comes twice: at rest, too
    int resting = 0;
    for (Eigen::Index n = 0; n < set->size(); ++n) {
      const bool is_it = (set->points().col(n) - centre).norm() < 0.12;
      resting += is_it && set->velocities().col(n).isZero(0.0) && set->uncertainty()[n] == 0.5 ? 1 : 0;
    }
    BOOST_TEST(resting >= num);
  }
}

BOOST_FIXTURE_TEST_CASE(what_the_arm_uncovers_between_slow_images_hardly_ever_moves, Watched) {
  camera.fx = camera.fy = 200.0;
  camera.noise = {0.01, 0.0};
  int moving = 0, seen = 0;
  for (int sweep = 0; sweep < 4; ++sweep) {
    start();
    time += 1.0;
    for (int n = 0; n < 18; ++n) {
      q = Eigen::Vector4d(-0.8 + 0.1 * n, -0.8, 0.5, 1.1);  // 1 rad/s
      step();
      scene = {};
      scene.add_sphere({-100.4, 0.0, 0.6}, 100.0);
      for (const double y : {-0.4, -0.25, -0.1, 0.05, 0.2, 0.35, 0.5, 0.65}) {
        scene.add_sphere({-0.25, y, 0.5}, 0.05);  // alike
      }
      scene.add_arm(arm.robot(), arm.body(), q);
      look_with_noise(0.05f);
      time += 0.1;
      for (const Perception::Cell& cell : perception->cells()) {
        seen += cell.age > 0.0 ? 0 : 1;
        moving += cell.velocity.norm() < 0.2 || cell.age > 0.0 ? 0 : 1;
      }
    }
  }
  BOOST_TEST(seen > 10000);
  BOOST_TEST(moving < 0.003 * seen, moving << " of " << seen);
}

BOOST_FIXTURE_TEST_CASE(what_moves_goes_on_where_something_hides_it, Watched) {
  constexpr double speed = 0.5, period = 0.1;  // [m/s], [s]
  camera.fx = camera.fy = 200.0;
  start();
  step();
  scene.floor = -10.0;
  Eigen::Vector3d centre = scene.balls.front().centre;
  const auto see = [&](bool hidden) {
    scene.balls.resize(1);
    scene.balls.front().centre = centre;
    if (hidden) {
      scene.add_sphere({1.3, 0.4, 0.7}, 0.3);
    }
    look(Capture{time, {}, std::nullopt});
    centre.y() -= speed * period;
    time += period;
    step();
  };
  const auto points_there = [&] {  // where it was in the last image
    return points("front", centre + Eigen::Vector3d(0.15, speed * period, 0.0), 0.06);
  };
  for (int n = 0; n < 6; ++n) {
    see(false);
  }
  const int shown = points_there();
  BOOST_TEST(shown > 5);
  for (int n = 0; n < 4; ++n) {
    see(true);
    BOOST_TEST_INFO("hidden for " << (n + 1) * period << " s");
    BOOST_TEST(points_there() > shown / 3);  // none as long as it was remembered where it was seen last
  }
  see(true);
  BOOST_TEST(points_there() == 0);  // nobody knows any more
}

BOOST_FIXTURE_TEST_CASE(what_goes_on_unseen_is_dropped_where_the_image_sees_through_it, Watched) {
  constexpr double speed = 1.0, period = 0.1;  // [m/s], [s]
  camera.fx = camera.fy = 200.0;
  start();
  step();
  scene.floor = -10.0;
  Eigen::Vector3d centre(0.2, 1.0, 0.5);
  scene.balls.resize(1);
  for (int n = 0; n < 9; ++n) {  // in the end it stands still behind something as large
    scene.balls.resize(1);
    scene.balls.front().centre = centre;
    if (n == 7) {
      scene.add_sphere({0.7, 0.41, 0.6}, 0.16);
    }
    look(Capture{time, {}, std::nullopt});
    centre.y() -= n < 6 ? speed * period : 0.0;
    time += period;
    step();
  }
  const auto set = said("front");
  const Eigen::Isometry3d X_CW = camera.pose.inverse();
  const std::vector<float> image = scene.image(camera);
  int seen_through = 0;
  for (Eigen::Index n = 0; n < set->size(); ++n) {
    const Eigen::Vector3d at = X_CW * set->points().col(n);
    const Eigen::Vector2d pixel = camera.project(at);
    const auto u = static_cast<std::size_t>(std::lround(pixel.x())), v = static_cast<std::size_t>(std::lround(pixel.y()));
    seen_through += image[v * static_cast<std::size_t>(camera.width) + u] > at.z() + 0.1 ? 1 : 0;
  }
  BOOST_TEST(seen_through <= 8);  // at its edge; 42 as long as nobody looked
}

BOOST_FIXTURE_TEST_CASE(an_arm_beside_a_wall_rests_while_its_first_images_come, Watched) {
  camera.fx = camera.fy = 150.0;
  camera.noise = {0.002, 0.0};
  camera.translation_error = 0.005;
  scene.floor = -10.0;
  scene.balls.clear();
  scene.add_sphere({-100.075, 0.0, 0.6}, 100.0);  // its surface is 3 cm behind the arm
  scene.add_arm(arm.robot(), arm.body(), q);
  start();
  step();
  for (int n = 0; n < 20; ++n) {
    look_with_noise(0.05f);
    for (int k = 0; k < 33; ++k) {
      time += 0.001;
      const Command& command = controller.step(q, Eigen::VectorXd::Zero(4), time);
      BOOST_TEST_INFO("image " << n << ", step " << k);
      BOOST_TEST((command.status == SafetyStatus::ok));
      BOOST_TEST(command.acceleration.cwiseAbs().maxCoeff() < 0.2);  // of 20: noise alone
    }
  }
}

BOOST_FIXTURE_TEST_CASE(the_arm_waits_for_each_of_its_cameras, Watched) {
  DepthCamera back = test::small_camera({-1.6, 0.2, 0.9}, {0.0, 0.0, 0.6});
  back.name = "back";
  perception = std::make_unique<Perception>(controller, std::vector{camera, back}, settings);
  step();
  BOOST_TEST(controller.said().empty());
  look();
  BOOST_TEST((controller.command().activity == Activity::stale));
  BOOST_TEST(controller.explain().find("'back' was expected and has not come yet") != std::string::npos);
  const std::vector<float> pixels = scene.image(back);
  perception->update("back", RawDepth{std::span<const float>(pixels), 1.0}, Capture{time, {}, std::nullopt});
  look();
  BOOST_TEST((controller.command().activity != Activity::stale));
}

BOOST_FIXTURE_TEST_CASE(what_leaves_the_image_keeps_its_velocity, Watched) {
  constexpr double noise = 0.02, period = 0.1;  // [m], [s]
  camera.fx = camera.fy = 200.0;
  camera.noise = {noise, 0.0};
  start();
  step();
  scene.floor = -10.0;
  Eigen::Vector3d& centre = scene.balls.front().centre;
  for (int n = 0; n < 11; ++n) {  // in the end the border of the image is at the ball's middle
    centre.y() = 0.25 + 0.5 * period * n;
    look_with_noise();
    time += period;
    step();
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int num = 0;
  for (const Perception::Cell& cell : perception->cells()) {
    if ((cell.centre - centre).norm() < 0.19 && !cell.velocity.isZero(0.0)) {
      sum += cell.velocity;
      ++num;
    }
  }
  BOOST_TEST(num > 20);
  BOOST_TEST((sum / num - Eigen::Vector3d(0.0, 0.5, 0.0)).norm() < 0.1);
}

BOOST_FIXTURE_TEST_CASE(what_the_arm_uncovers_hardly_ever_moves, Watched) {
  constexpr double noise = 0.01;  // [m]
  camera.fx = camera.fy = 200.0;
  camera.noise = {noise, 0.0};
  start();
  int moving = 0, seen = 0;
  for (int n = 0; n < 60; ++n) {
    q = Eigen::Vector4d(-0.8 + 0.03 * n, -0.8, 0.5, 1.1);  // 1 rad/s
    step();
    scene = {};
    scene.add_sphere({-100.4, 0.0, 0.6}, 100.0);
    scene.add_arm(arm.robot(), arm.body(), q);
    look_with_noise();
    time += 0.03;
    for (const Perception::Cell& cell : perception->cells()) {
      seen += cell.age > 0.0 ? 0 : 1;
      moving += cell.velocity.norm() < 0.2 || cell.age > 0.0 ? 0 : 1;
    }
  }
  BOOST_TEST(seen > 10000);
  BOOST_TEST(moving < 120);  // 256 as long as nobody knew what the arm hides
}

BOOST_FIXTURE_TEST_CASE(what_moves_while_the_arm_covers_or_uncovers_it_has_its_velocity, Watched) {
  constexpr double speed = 0.4, period = 0.05;  // [m/s], [s]
  constexpr int images = 30, partly = 10;       // of which the arm hides a part in the last or the first ones
  camera.fx = camera.fy = 200.0;
  for (const bool covers : {true, false}) {
    start();
    double error = 0.0;
    int num = 0, moving = 0;
    for (int n = 0; n < images; ++n) {
      const int k = covers ? n : images - 1 - n;
      const bool counts = covers ? n >= images - partly : n >= partly / 2 && n < partly * 3 / 2;
      q = Eigen::Vector4d(-0.6 + period * k, -0.8, 0.5, 1.1);
      step();
      const Eigen::Vector3d centre(-0.3, -0.6 + period * speed * k, 0.6), velocity(0.0, covers ? speed : -speed, 0.0);
      scene = {};
      scene.add_sphere(centre, 0.15);
      scene.add_sphere({-102.0, 0.0, 0.6}, 100.0);
      scene.add_arm(arm.robot(), arm.body(), q);
      look(Capture{time, {}, std::nullopt});
      time += period;
      for (const Perception::Cell& cell : perception->cells()) {
        if (counts && cell.age == 0.0 && (cell.centre - centre).norm() < 0.17) {
          error += (cell.velocity - velocity).norm();
          moving += cell.velocity.isZero(0.0) ? 0 : 1;
          ++num;
        }
      }
    }
    BOOST_TEST(num > 1000);
    BOOST_TEST(moving > 0.75 * num, "covers " << covers << ": " << moving << " of " << num << " cells move");
    BOOST_TEST(error < 0.14 * num, "covers " << covers << ": velocities are off by " << error / num << " m/s");
  }
}

BOOST_FIXTURE_TEST_CASE(single_cells_that_come_and_go_hardly_ever_move, Watched) {
  camera.fx = camera.fy = 200.0;
  start();
  step();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> beside(-0.4, 0.4), before(0.03, 0.09);
  int moving = 0;
  for (int n = 0; n < 60; ++n) {
    scene = {};
    scene.add_sphere({-100.4, 0.0, 0.6}, 100.0);
    for (int k = 0; n > 0 && k < 100; ++k) {
      scene.add_sphere({-0.4 + before(random), beside(random), 0.6 + beside(random)}, 0.015);
    }
    look();
    for (const Perception::Cell& cell : perception->cells()) {
      moving += cell.velocity.isZero(0.0) || cell.age > 0.0 ? 0 : 1;
    }
  }
  BOOST_TEST(moving < 5);  // of 6,000
}

BOOST_FIXTURE_TEST_CASE(a_single_cell_that_goes_on_moves, Watched) {
  camera.fx = camera.fy = 200.0;
  start();
  step();
  scene = {};
  scene.add_sphere({0.2, 20.0, 0.5}, 0.02);
  scene.add_sphere({-100.4, 0.0, 0.6}, 100.0);
  look();
  Eigen::Vector3d& centre = scene.balls.front().centre;
  for (int n = 0; n < 8; ++n) {
    centre.y() = 0.4 - 0.5 * 0.03 * n;
    look();
  }
  const std::vector<Perception::Cell> cells = perception->cells();
  BOOST_TEST(std::any_of(cells.begin(), cells.end(), [&](const Perception::Cell& cell) {
    return (cell.centre - centre).norm() < 0.04 && (cell.velocity - Eigen::Vector3d(0.0, -0.5, 0.0)).norm() < 0.25;
  }));
}

BOOST_FIXTURE_TEST_CASE(what_one_camera_sees_moving_moves_for_the_other_that_shows_its_back, Watched) {
  camera.fx = camera.fy = 200.0;
  DepthCamera back = test::small_camera({-1.6, 0.2, 0.9}, {0.0, 0.0, 0.6});
  back.name = "back";
  back.fx = back.fy = 200.0;
  perception = std::make_unique<Perception>(controller, std::vector{camera, back}, settings);
  step();
  scene.floor = -10.0;
  const Eigen::Vector3d begin = scene.balls.front().centre;
  scene.balls.front().centre.x() = 20.0;
  const auto look_back = [&] {
    const std::vector<float> pixels = scene.image(back);
    perception->update("back", RawDepth{std::span<const float>(pixels), 1.0}, Capture{time, {}, std::nullopt});
  };
  look_back();  // what a first image shows may rest
  for (int n = 0; n < 15; ++n) {
    scene.balls.front().centre = begin - Eigen::Vector3d(0.0, 0.5 * 0.03 * n, 0.0);
    look();
  }
  time -= 0.03;
  look_back();  // one image tells no velocity
  const auto shown = said("back");
  BOOST_TEST_REQUIRE(shown != nullptr);
  int resting = 0, moving = 0;
  for (Eigen::Index n = 0; n < shown->size(); ++n) {
    if ((shown->points().col(n) - scene.balls.front().centre).norm() < 0.17) {
      const Eigen::Vector3d velocity = shown->velocities().col(n);
      resting += velocity.isZero(0.0) ? 1 : 0;
      moving += velocity.y() < -0.25 ? 1 : 0;
    }
  }
  BOOST_TEST(resting > 20);          // it may rest beside what moves,
  BOOST_TEST(moving > resting / 2);  // and may go with it
}

BOOST_FIXTURE_TEST_CASE(images_come_while_steps_go_on, Watched) {
  start();
  step();
  std::atomic<int> images{0};
  std::thread camera_thread([&] {
    while (images.load() < 5) {
      look(Capture{controller.time(), {}, std::nullopt});
      ++images;
    }
  });
  const Eigen::VectorXd v = Eigen::VectorXd::Zero(4);
  double now = time;
  while (images.load() < 5) {
    controller.step(q, v, now += 0.001);
  }
  camera_thread.join();
  BOOST_TEST(perception->time("front") >= 10.0);
  BOOST_TEST(controller.time() == now, boost::test_tools::tolerance(1e-14));  // own clock and back: two roundings
}

BOOST_FIXTURE_TEST_CASE(a_blind_camera_is_not_believed, Watched) {
  start();
  step();
  const std::vector<float> pixels(160 * 120, 0.0f);
  const PerceptionReport report =
      perception->update("front", RawDepth{std::span<const float>(pixels), 1.0}, Capture{time, {}, std::nullopt});
  BOOST_TEST(!report.used);
  BOOST_TEST(report.question.find("sees nothing") != std::string::npos);
  BOOST_TEST(said("front") == nullptr);
}

BOOST_FIXTURE_TEST_CASE(an_image_that_is_not_used_moves_nothing, Watched) {
  start();
  step();
  look();
  look();
  const std::vector<Perception::Cell> before = perception->cells();
  BOOST_REQUIRE(before.size() > 100u);
  Eigen::Isometry3d elsewhere = camera.pose;
  elsewhere.translation() += Eigen::Vector3d(-3.0, 1.0, 0.5);
  const std::vector<float> nothing(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height), 0.0f);
  BOOST_TEST(!perception->update("front", RawDepth{std::span<const float>(nothing), 1.0}, Capture{time, {}, elsewhere}).used);
  BOOST_TEST(perception->pose("front").isApprox(elsewhere));  // of the image that depth and labels show
  const std::vector<Perception::Cell> after = perception->cells();
  BOOST_REQUIRE(after.size() == before.size());
  double moved = 0.0;
  for (std::size_t n = 0; n < before.size(); ++n) {
    moved = std::max(moved, (after[n].centre - before[n].centre).norm());
  }
  BOOST_TEST(moved == 0.0);
}

BOOST_FIXTURE_TEST_CASE(an_image_that_shows_little_but_the_arm_shows_the_arm, Watched) {
  // As that of an eye in hand, too near to what it looks at: fewer than 1 % of the pixels have a depth, and those show links.
  const KinematicState state = test::state_at(arm.robot(), q);
  const Eigen::Isometry3d X_WC = camera.pose;
  camera.link = "tip";
  camera.pose = frame_pose(arm.robot(), state, arm.robot().frame_index("tip")).inverse() * X_WC;
  start();
  step();
  std::vector<float> pixels = scene.image(camera, X_WC);
  const auto update = [&] {
    return perception->update("front", RawDepth{std::span<const float>(pixels), 1.0}, Capture{time, {}, std::nullopt});
  };
  update();
  const std::vector<PixelLabel> whole = perception->labels("front");
  int kept = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    pixels[i] = whole[i] == PixelLabel::arm && kept < 190 ? pixels[i] : 0.0f;
    kept += pixels[i] > 0.0f ? 1 : 0;
  }
  BOOST_TEST(kept == 190);  // of 19,200
  const int before = points("front", {0.2, 0.9, 0.5}, 0.17);
  const PerceptionReport report = update();
  BOOST_TEST(!report.used);
  BOOST_TEST(report.question.find("sees nothing") != std::string::npos);
  BOOST_TEST(report.arm_pixels == 190);
  BOOST_TEST(report.obstacle_pixels == 0);
  const std::vector<PixelLabel> labels = perception->labels("front");
  BOOST_TEST(std::count(labels.begin(), labels.end(), PixelLabel::arm) == 190);
  BOOST_TEST(points("front", {0.2, 0.9, 0.5}, 0.17) == before);
  const double used = time;
  time += 0.03;
  q[3] += 0.05;
  step();
  BOOST_TEST(!update().used);
  BOOST_TEST((perception->pose("front").matrix() - X_WC.matrix()).norm() > 0.01);  // its labels belong to where it is now
  BOOST_TEST(perception->time("front") == used);
}

BOOST_FIXTURE_TEST_CASE(an_image_that_sees_through_the_arm_is_not_used, Watched) {
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 480.0;
  camera.cx = 319.5;
  camera.cy = 239.5;
  start();
  step();
  BOOST_TEST(look().used);
  std::vector<float> pixels = scene.image(camera);
  for (float& z : pixels) {
    z *= 10.0f;  // a unit that is wrong by ten
  }
  const int before = points("front", {0.2, 0.9, 0.5}, 0.17);
  const PerceptionReport report =
      perception->update("front", RawDepth{std::span<const float>(pixels), 1.0}, Capture{time, {}, std::nullopt});
  BOOST_TEST(!report.used);
  BOOST_TEST(report.question.find("sees through the arm") != std::string::npos);
  BOOST_TEST(points("front", {0.2, 0.9, 0.5}, 0.17) == before);
}

BOOST_FIXTURE_TEST_CASE(what_is_gone_is_gone_for_the_controller, Watched) {
  start();
  step();
  look();
  scene.balls.erase(scene.balls.begin());
  look();
  look();
  BOOST_TEST(points("front", {0.2, 0.9, 0.5}, 0.17) <= 0);
  BOOST_TEST(points("memory", {0.2, 0.9, 0.5}, 0.17) <= 0);
}

BOOST_FIXTURE_TEST_CASE(unseen_space_is_an_obstacle_if_it_is_closed, Watched) {
  settings.unseen_is_free = false;
  start();
  step();
  const PerceptionReport report = look();
  BOOST_TEST(report.unseen > 100);
  BOOST_TEST(points("unseen", {0.0, 0.0, 0.6}, 3.0) == report.unseen);
  BOOST_TEST(perception->unseen().cols() == report.unseen);
  const int looked = report.unseen;
  perception->forget();
  look(Capture{time, Eigen::Vector4d(0.0, 2.4, 0.0, 0.0), std::nullopt});  // with the arm elsewhere in mind
  BOOST_TEST(perception->unseen().cols() != looked);
}

BOOST_FIXTURE_TEST_CASE(wrong_calls_name_what_is_allowed, Watched) {
  start();
  const auto message = [](auto&& call) -> std::string {
    try {
      call();
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "none";
  };
  const std::vector<float> pixels(160 * 120, 1.0f);
  const RawDepth depth{std::span<const float>(pixels), 1.0};
  BOOST_TEST(message([&] { perception->update("back", depth, Capture{1.0, {}, std::nullopt}); }) ==
             "perception: there is no camera 'back', there are: 'front'");
  BOOST_TEST(message([&] { perception->camera("back"); }) == "perception: there is no camera 'back', there are: 'front'");
  BOOST_TEST(perception->camera("front").name == "front");
  BOOST_TEST(message([&] { perception->update("front", depth, Capture{1.0, Eigen::VectorXd::Zero(3), std::nullopt}); }) ==
             "perception: q has 3 entries, allowed: 4, all finite");
  BOOST_TEST(message([&] { Perception(controller, {}); }) == "perception: there are 0 cameras, allowed: 1 to 16");
  BOOST_TEST(message([&] { Perception(controller, {camera, camera}); }).find("two cameras have the name 'front'") !=
             std::string::npos);
  PerceptionSettings wrong;
  wrong.voxel = 0.0;
  BOOST_TEST(message([&] { Perception(controller, {camera}, wrong); }).find("perception: voxel is 0") == 0u);
}

// What threads say of obstacles, source by source: what replaces what, how long it is valid, and what is refused.
#include <boost/test/unit_test.hpp>
#include <limits>
#include <stdexcept>
#include <string>

#include "../../src/controller/source_registry.hpp"
#include "support/covered_arm.hpp"

using namespace sidestep;

namespace {

constexpr double ever = std::numeric_limits<double>::infinity();

/// Two named balls 1 and 2 m along x.
Obstacles two_balls() {
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 2);
  points.row(0) << 1.0, 2.0;
  Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
  at.translation().x() = 2.0;
  return Obstacles(points, Eigen::Vector2d(0.1, 0.2), Eigen::Matrix3Xd::Zero(3, 2))
      .named({"cup", "can"}, {1, 1}, {Eigen::Isometry3d::Identity(), at});
}

Obstacles one_ball(double x, double speed = 0.0) { return test::ball({x, 0.0, 1.0}, 0.1, {speed, 0.0, 0.0}); }

/// What the message of an error says.
template <class Action>
std::string error_of(Action&& action) {
  try {
    action();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "none";
}

struct Said {
  double valid_for(const char* source = "scene") const {
    for (const SourceSet& set : registry.world().sources) {
      if (set.name == source) {
        return set.valid_for;
      }
    }
    return -1.0;
  }

  ControllerSettings settings;
  SourceRegistry registry{settings};
};

}  // namespace

BOOST_AUTO_TEST_CASE(a_source_expires_only_if_something_says_that_it_comes_again) {
  Said said;
  said.registry.set(one_ball(5.0), {}, 0.0);
  BOOST_TEST(said.valid_for() == ever);
  said.registry.set(one_ball(5.0, 0.5), {}, 10.0);  // it has a velocity
  BOOST_TEST(said.valid_for() == 0.25);
  said.registry.set(one_ball(5.0), {.source = "camera", .time = 10.0}, 10.0);
  BOOST_TEST(said.valid_for("camera") == 0.25);
  said.registry.set(one_ball(5.0), {.source = "map", .valid_for = 3.0}, 10.0);
  BOOST_TEST(said.valid_for("map") == 3.0);
  said.registry.set(one_ball(5.0, 0.5), {.source = "map", .valid_for = ever}, 10.0);
  BOOST_TEST(said.valid_for("map") == ever);
}

BOOST_AUTO_TEST_CASE(three_sets_within_the_validity_are_a_stream_and_a_scene_that_is_changed_is_none) {
  Said said;
  for (int k = 0; k < 10; ++k) {
    said.registry.set(one_ball(5.0), {}, 0.03 * k);
  }
  BOOST_TEST(said.valid_for() == ever);
  for (int k = 0; k < 10; ++k) {
    BOOST_TEST(said.valid_for() == ever);
    said.registry.set(one_ball(5.1 + 0.01 * k), {}, 0.33 + 0.03 * k);
  }
  BOOST_TEST(said.valid_for() == 0.25);        // as a camera that nobody gave a name
  for (const double time : {0.0, 0.2, 0.4}) {  // too slow for a stream
    said.registry.set(one_ball(5.0 + time), {.source = "slow"}, time);
  }
  BOOST_TEST(said.valid_for("slow") == ever);
  for (const double time : {0.0, 0.1, 0.2}) {  // of any other source the same points count
    said.registry.set(one_ball(5.0), {.source = "camera"}, time);
  }
  BOOST_TEST(said.valid_for("camera") == 0.25);
}

BOOST_AUTO_TEST_CASE(an_empty_set_after_one_with_points_keeps_them_for_a_while) {
  Said said;
  said.registry.set(Obstacles::none(), {}, 0.0);
  BOOST_TEST(!said.registry.world().sources[0].emptied);
  said.registry.set(one_ball(5.0), {}, 1.0);
  said.registry.set(Obstacles::none(), {}, 2.0);
  BOOST_TEST(said.registry.world().sources[0].emptied);
  BOOST_TEST(said.registry.world().obstacles.size() == 1);
  said.registry.set(Obstacles::none(), {}, 3.9);
  BOOST_TEST(said.registry.world().obstacles.size() == 1);
  said.registry.set(Obstacles::none(), {}, 4.0);
  BOOST_TEST(said.registry.world().obstacles.size() == 0);
  BOOST_TEST(!said.registry.world().sources[0].emptied);
  said.registry.set(one_ball(5.0), {}, 5.0);
  said.registry.remove("scene");
  BOOST_TEST(said.registry.world().sources.size() == 0u);
}

BOOST_AUTO_TEST_CASE(the_same_points_again_are_no_news_where_they_move) {
  Said said;
  const SourceOptions tracker{.source = "tracker"};
  said.registry.set(one_ball(5.0, 0.5), tracker, 0.0);
  said.registry.set(one_ball(5.0, 0.5), tracker, 0.03);
  BOOST_TEST(said.registry.world().sources[0].repeated);
  BOOST_TEST(said.registry.world().sources[0].number == 1u);  // its age is that of the first
  said.registry.set(one_ball(5.03, 0.5), tracker, 0.06);
  BOOST_TEST(!said.registry.world().sources[0].repeated);
  BOOST_TEST(said.registry.world().sources[0].number == 3u);
}

BOOST_AUTO_TEST_CASE(named_shapes_are_added_moved_and_removed_one_by_one) {
  Said said;
  said.registry.set(two_balls(), {}, 0.0);
  Eigen::Isometry3d to = Eigen::Isometry3d::Identity();
  to.linear() = Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  to.translation() << 3.0, 4.0, 5.0;
  said.registry.move("can", to, {}, 1.0);
  Obstacles now = said.registry.world().obstacles;
  BOOST_TEST((now.points().col(1) - to.translation()).norm() < 1e-15);  // its centre was its origin
  BOOST_TEST(now.points()(0, 0) == 1.0);
  said.registry.move("cup", to, {}, 2.0);
  now = said.registry.world().obstacles;
  BOOST_TEST((now.points().col(0) - to * Eigen::Vector3d(1.0, 0.0, 0.0)).norm() < 1e-15);
  said.registry.remove("can", "scene");
  BOOST_TEST(said.registry.world().obstacles.groups().size() == 1u);
  said.registry.add(two_balls().named({"box", "lid"}, {1, 1}), "scene");
  BOOST_TEST(said.registry.world().obstacles.size() == 3);
  BOOST_TEST(said.registry.world().obstacles.name_of(2) == "lid");
  said.registry.add(two_balls(), "shelf");
  BOOST_TEST(said.registry.world().sources.size() == 2u);
  BOOST_TEST(said.registry.world().obstacles.size() == 5);
}

BOOST_AUTO_TEST_CASE(a_source_that_has_judged_itself_is_taken_as_it_is) {
  Said said;
  SourceRegistry& all = said.registry;
  for (int k = 0; k < 6; ++k) {  // it moves at 1 m/s, and says that it rests
    all.set(one_ball(0.1 * k), {.source = "camera", .time = 0.1 * k, .as_given = true}, 0.1 * k);
  }
  BOOST_TEST(all.world().obstacles.size() == 1);
  BOOST_TEST(all.world().obstacles.velocities().norm() == 0.0);
  all.set(Obstacles::none(), {.source = "camera", .time = 0.6, .as_given = true}, 0.6);
  BOOST_TEST(all.world().obstacles.size() == 0);
  all.set(one_ball(1.0), {.source = "camera", .time = 0.7}, 0.7);
  all.set(Obstacles::none(), {.source = "camera", .time = 0.8}, 0.8);
  BOOST_TEST(all.world().obstacles.size() == 1);  // another that empties is doubted
}

BOOST_AUTO_TEST_CASE(what_is_refused_says_what_is_allowed_and_changes_nothing) {
  Said said;
  said.registry.set(two_balls(), {}, 0.0);
  const auto& r = said.registry;
  const std::uint64_t before = r.world().number;
  SourceRegistry& all = said.registry;
  BOOST_TEST(error_of([&] { all.remove("lamp", "scene"); }) == "obstacles: source 'scene' has no 'lamp', it has 'cup', 'can'");
  BOOST_TEST(error_of([&] { all.remove("camera"); }) == "obstacles: there is no source 'camera', there are: 'scene'");
  BOOST_TEST(error_of([&] { all.set(one_ball(1.0), {.source = ""}, 0.0); }).find("1 to 100 characters") != std::string::npos);
  BOOST_TEST(error_of([&] { all.set(one_ball(1.0), {.valid_for = 0.0}, 0.0); }).find("allowed: above 0") != std::string::npos);
  BOOST_TEST(error_of([&] { all.set(one_ball(1.0), {.time = ever}, 0.0); }).find("infinite") != std::string::npos);
  BOOST_TEST(error_of([&] { all.add(two_balls(), "scene"); }).find("has 'cup' already") != std::string::npos);
  BOOST_TEST(error_of([&] { all.add(one_ball(1.0), "scene"); }).find("it has no name") != std::string::npos);
  BOOST_TEST(r.world().number == before);
  BOOST_TEST(r.world().obstacles.size() == 2);
  for (std::size_t k = 1; k < most_sources; ++k) {
    if (k + 1 == most_sources) {
      const std::uint64_t number = r.world().number;
      BOOST_TEST(error_of([&] { all.expect({"left", "right"}); }).find("source 'right' would be number 33") !=
                 std::string::npos);
      BOOST_TEST(r.world().number == number);
      BOOST_TEST(r.world().sources.size() == k);  // none of them is expected
      all.expect({"s1", "s2"});                   // they are there
    }
    all.set(one_ball(1.0), {.source = "s" + std::to_string(k)}, 0.0);
  }
  BOOST_TEST(error_of([&] { all.set(one_ball(1.0), {.source = "more"}, 0.0); }).find("allowed: 32 sources") !=
             std::string::npos);
}

// The obstacles where they are now, alone: numbers, age, velocities, and what is near enough to count as moving.
#include <boost/test/unit_test.hpp>

#include "../../src/controller/sources.hpp"
#include "support/allocations.hpp"
#include "support/numbers.hpp"
#include "support/stage_model.hpp"

using namespace sidestep;
using Output = ControllerSettings::Output;

namespace {

/// The stage with an arm of two links along z, from 0.3 m to 0.9 m.
struct Seeing {
  explicit Seeing(ControllerSettings settings = test::straight_settings(Output::position))
      : model(test::stage_model(2, std::move(settings))),
        sources(buffer, model.body, model.arm.robot(), model.arm.body(), model.settings) {}

  bool update(double elapsed = 0.001) { return sources.update(upright, Tick::regular(elapsed, time += elapsed)); }
  void put() { buffer.put(registry.world()); }
  /// Sets a source, as the thread that does.
  void set(Obstacles obstacles, SourceOptions options = {}) {
    registry.set(std::move(obstacles), options, time);
    put();
  }
  Eigen::Vector3d point(Eigen::Index k = 0) const { return sources.obstacles().points().col(k); }

  const Eigen::VectorXd upright = Eigen::Vector2d::Zero();
  const ControllerModel model;
  TripleBuffer<World> buffer{World{}};
  SourceRegistry registry{model.settings};
  Sources sources;
  double time = 0.0;
};

const Eigen::Vector3d far_place(5.0, 0.0, 1.0);

}  // namespace

BOOST_AUTO_TEST_CASE(obstacles_move_on_with_their_velocities_from_the_step_that_takes_them) {
  Seeing seen;
  BOOST_TEST(!seen.update());
  BOOST_TEST(seen.sources.number() == 0u);
  const Eigen::Vector3d velocity(1.0, -2.0, 0.0);
  seen.set(test::ball(far_place, 0.1, velocity));
  BOOST_TEST(seen.update());
  BOOST_TEST(seen.sources.number() == 1u);
  BOOST_TEST((seen.point() == far_place));
  for (int k = 0; k < 10; ++k) {
    BOOST_TEST(!seen.update());
  }
  BOOST_TEST(std::abs(seen.sources.states().at(0).age - 0.01) < 1e-15);     // rounding of ten sums
  BOOST_TEST((seen.point() - far_place - 0.01 * velocity).norm() < 1e-14);  // the same, near 5
}

BOOST_AUTO_TEST_CASE(nothing_is_known_to_be_free_until_somebody_says_so) {
  Seeing seen;
  seen.update();
  BOOST_TEST(seen.sources.is_stale());
  BOOST_TEST(seen.sources.explain().find("never set") != std::string::npos);
  seen.set(Obstacles::none());
  seen.update();
  BOOST_TEST(!seen.sources.is_stale());
  seen.update(1e6);  // what rests in the scene is believed for ever
  BOOST_TEST(!seen.sources.is_stale());
}

BOOST_AUTO_TEST_CASE(a_source_that_is_expected_is_overdue_until_it_comes) {
  Seeing seen;
  seen.registry.expect({"left"});
  seen.set(test::ball(far_place, 0.1), {.source = "right", .time = 0.0});
  BOOST_TEST(seen.registry.said().size() == 1u);
  seen.update(0.1);
  BOOST_TEST(seen.sources.is_stale());
  BOOST_TEST(seen.sources.states().at(0).is_overdue);
  BOOST_TEST(seen.sources.states().at(0).age == test::infinity);
  BOOST_TEST(seen.sources.explain().find("source 'left' was expected and has not come yet") != std::string::npos);
  seen.set(test::ball(far_place, 0.2), {.source = "left", .time = 0.1});
  seen.registry.expect({"left"});  // it has come
  seen.put();
  seen.update(0.1);
  BOOST_TEST(!seen.sources.is_stale());
  BOOST_TEST(seen.sources.obstacles().size() == 2);
  seen.registry.expect({"front"});
  seen.put();
  seen.update(0.01);
  BOOST_TEST(seen.sources.is_stale());
  seen.registry.remove("front");
  seen.put();
  seen.update(0.01);
  BOOST_TEST(!seen.sources.is_stale());
  seen.registry.expect({"table"});
  seen.registry.add(test::ball(far_place, 0.1).named({"box"}, {1}), "table");
  seen.put();
  seen.update(10.0);  // the others are too old then
  BOOST_TEST(!seen.sources.states().back().is_overdue);
}

BOOST_AUTO_TEST_CASE(an_expected_source_is_overdue_where_all_others_are_believed_for_ever) {
  ControllerSettings settings = test::straight_settings(Output::position);
  settings.sources.valid_for = test::infinity;
  Seeing seen(settings);
  seen.set(Obstacles::none());
  seen.registry.expect({"side"});
  seen.put();
  seen.update();
  BOOST_TEST(seen.sources.is_stale());
  BOOST_TEST(seen.sources.states().back().is_overdue);
  BOOST_TEST(seen.sources.explain().find("source 'side' was expected") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_timeout_is_of_every_source_without_a_validity_of_its_own) {
  ControllerSettings settings = test::straight_settings(Output::position);
  settings.obstacle_timeout = 0.1;
  Seeing seen(settings);
  seen.set(Obstacles::none());
  seen.set(test::ball(far_place, 0.1), {.source = "table", .valid_for = 10.0});
  seen.update();
  seen.update(0.0999);
  BOOST_TEST(!seen.sources.is_stale());
  seen.update(0.001);
  BOOST_TEST(seen.sources.is_stale());
  BOOST_TEST(seen.sources.states().at(0).is_overdue);
}

BOOST_AUTO_TEST_CASE(a_told_velocity_is_not_believed_for_longer_than_it_is_valid) {
  Seeing seen;
  const Eigen::Vector3d velocity(-1.0, 0.0, 0.0);
  seen.set(test::ball(far_place, 0.1, velocity), {.source = "tracker"});  // 0.25 s, the default
  seen.update();
  for (int k = 0; k < 240; ++k) {
    seen.update();
  }
  BOOST_TEST(!seen.sources.is_stale());
  for (int k = 0; k < 500; ++k) {
    seen.update();
  }
  BOOST_TEST(seen.sources.is_stale());
  BOOST_TEST(std::abs(seen.point().x() - 4.75) < 1e-9);
  BOOST_TEST((seen.sources.obstacles().velocities().col(0).isZero(0.0)));  // it stands still
  BOOST_TEST(seen.sources.explain().find("source 'tracker' is 0.74 s old and valid for 0.25 s") != std::string::npos);
  seen.set(test::ball({4.2, 0.0, 1.0}, 0.1, velocity), {.source = "tracker"});
  seen.update();
  BOOST_TEST(!seen.sources.is_stale());
}

BOOST_AUTO_TEST_CASE(points_are_moved_from_the_time_of_their_capture_to_now) {
  Seeing seen;
  seen.update(1.0);
  seen.set(test::ball(far_place, 0.1, {1.0, 0.0, 0.0}), {.source = "tracker", .time = 0.92});
  seen.update(0.02);
  BOOST_TEST(std::abs(seen.point().x() - 5.1) < 1e-12);
  BOOST_TEST(std::abs(seen.sources.states().at(0).age - 0.1) < 1e-12);
  seen.set(test::ball(far_place, 0.1, {1.0, 0.0, 0.0}), {.source = "tracker", .time = 0.4});  // too old already
  seen.update();
  BOOST_TEST(std::abs(seen.point().x() - 5.25) < 1e-12);
  BOOST_TEST(seen.sources.is_stale());
}

BOOST_AUTO_TEST_CASE(a_time_that_has_not_come_yet_is_of_another_clock) {
  Seeing seen;
  seen.update(1.0);
  seen.set(test::ball(far_place, 0.1), {.source = "camera", .time = 1.02});  // jitter
  seen.update();
  BOOST_TEST(!seen.sources.is_stale());
  seen.set(test::ball(far_place, 0.1), {.source = "camera", .time = 1.7e9});  // seconds since 1970
  seen.update();
  BOOST_TEST(seen.sources.is_stale());
  BOOST_TEST(seen.sources.explain().find("its clock is not that of step") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(each_source_replaces_only_itself_and_moves_by_itself) {
  Seeing seen;
  seen.set(test::ball(far_place, 0.1));
  seen.set(test::ball({0.0, 5.0, 1.0}, 0.2, {0.0, 1.0, 0.0}), {.source = "tracker", .valid_for = 10.0});
  seen.update();
  for (int k = 0; k < 100; ++k) {
    seen.update();
  }
  seen.set(test::ball({6.0, 0.0, 1.0}, 0.3));
  seen.update();
  BOOST_REQUIRE(seen.sources.obstacles().size() == 2);
  BOOST_TEST(seen.point(0).x() == 6.0);
  BOOST_TEST(std::abs(seen.point(1).y() - 5.101) < 1e-12);  // goes on from where it was
  BOOST_TEST(seen.sources.obstacles().part_of(1) == 1u);
  seen.registry.remove("scene");
  seen.put();
  seen.update();
  BOOST_REQUIRE(seen.sources.obstacles().size() == 1);
  BOOST_TEST(std::abs(seen.point(0).y() - 5.102) < 1e-12);
}

BOOST_AUTO_TEST_CASE(an_emptied_source_is_believed_once_it_stays_empty) {
  Seeing seen;
  seen.set(test::ball({0.3, 0.0, 0.6}, 0.1));
  seen.update();
  seen.set(Obstacles::none());
  seen.update();
  BOOST_TEST(seen.sources.states().at(0).is_emptied);
  for (int k = 0; k < 1990; ++k) {
    seen.update();
  }
  ClearanceQuery::Workspace workspace(seen.model.body);
  const auto clearance = [&] {
    return seen.model.body.nearest(seen.upright, seen.sources.obstacles(), 1.0, workspace).clearance;
  };
  BOOST_TEST(clearance() < 0.3);
  for (int k = 0; k < 20; ++k) {
    seen.update();
  }
  const double alone = seen.model.body.nearest(seen.upright, Obstacles::none(), 1.0, workspace).clearance;
  BOOST_TEST(clearance() == alone);
  BOOST_TEST(seen.sources.states().at(0).size == 0);
  BOOST_TEST(!seen.sources.is_stale());
  seen.set(test::ball({0.3, 0.0, 0.6}, 0.1));
  seen.update();
  BOOST_TEST(clearance() < 0.3);
}

BOOST_AUTO_TEST_CASE(what_could_be_near_within_a_second_counts_as_moving_and_the_rest_does_not) {
  const Eigen::Vector3d place(0.5, 0.0, 0.6);  // 0.41 m from the arm, less its own radius of 0.05 m
  const auto moves = [&](const Eigen::Vector3d& velocity) {
    Seeing seen;
    seen.set(test::ball(place, 0.05, velocity));
    seen.update();
    return seen.sources.look_for_movers(seen.upright) && seen.sources.has_movers();
  };
  BOOST_TEST(moves({-0.5, 0.0, 0.0}));
  BOOST_TEST(!moves({0.0, 0.0, 0.0}));
  BOOST_TEST(moves({0.5, 0.0, 0.0}));    // it may turn
  BOOST_TEST(!moves({-0.2, 0.0, 0.0}));  // 0.2 m remain, more than 0.1
}

BOOST_AUTO_TEST_CASE(another_body_goes_on_with_the_obstacles_where_they_are) {
  Seeing before, after;
  before.set(test::ball(far_place, 0.1, {1.0, 0.0, 0.0}));
  after.buffer.put(before.registry.world());
  before.update();
  before.update();
  after.sources.go_on_from(before.sources);
  BOOST_TEST(after.sources.number() == 1u);
  BOOST_TEST(after.sources.states().at(0).age == 0.001);
  BOOST_TEST(std::abs(after.sources.obstacles().points()(0, 0) - 5.001) < 1e-15);  // rounding near 5
  after.time = before.time;
  BOOST_TEST(!after.update());
}

BOOST_AUTO_TEST_CASE(steps_with_three_sources_allocate_nothing) {
  Seeing seen;
  for (const char* const source : {"scene", "tracker", "camera"}) {
    seen.set(test::ball(far_place, 0.1, {0.1, 0.0, 0.0}), {.source = source, .valid_for = 10.0});
  }
  const std::size_t allocations = test::allocations_of([&] {
    for (int k = 0; k < 100; ++k) {
      seen.update();
    }
  });
  BOOST_TEST(allocations == 0);
}

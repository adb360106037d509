// The obstacles where they are now, alone: numbers, age, velocities, and what is near enough to count as moving.
#include <boost/test/unit_test.hpp>

#include "../../src/controller/sources.hpp"
#include "support/stage_model.hpp"

using namespace sidestep;
using Output = ControllerSettings::Output;

namespace {

/// The stage with an arm of two links along z, from 0.3 m to 0.9 m.
struct Seeing {
  explicit Seeing(ControllerSettings settings = test::straight_settings(Output::position))
      : model(test::stage_model(2, std::move(settings))),
        sources(buffer, model.body, model.arm.robot(), model.arm.body(), model.settings) {}

  bool update() { return sources.update(upright, time += model.settings.period); }

  const Eigen::Vector2d upright{0.0, 0.0};
  const ControllerModel model;
  TripleBuffer<NumberedObstacles> buffer{NumberedObstacles{}};
  Sources sources;
  double time = 0.0;
};

}  // namespace

BOOST_AUTO_TEST_CASE(obstacles_move_on_with_their_velocities_from_the_step_that_takes_them) {
  Seeing seen;
  BOOST_TEST(!seen.update());
  BOOST_TEST(seen.sources.number() == 0u);
  const Eigen::Vector3d place(5.0, 0.0, 1.0), velocity(1.0, -2.0, 0.0);
  seen.buffer.put({4, test::ball(place, 0.1, velocity)});
  BOOST_TEST(seen.update());
  BOOST_TEST(seen.sources.number() == 4u);
  BOOST_TEST(seen.sources.age() == 0.0);
  BOOST_TEST((seen.sources.obstacles().points().col(0) == place));
  for (int k = 0; k < 10; ++k) {
    BOOST_TEST(!seen.update());
  }
  BOOST_TEST(std::abs(seen.sources.age() - 0.01) < 1e-15);                                          // rounding of ten sums
  BOOST_TEST((seen.sources.obstacles().points().col(0) - place - 0.01 * velocity).norm() < 1e-14);  // the same, near 5
}

BOOST_AUTO_TEST_CASE(obstacles_are_stale_after_their_timeout_and_where_they_never_were_set) {
  Seeing without;
  without.update();
  BOOST_TEST(!without.sources.is_stale());
  ControllerSettings settings = test::straight_settings(Output::position);
  settings.obstacle_timeout = 0.1;
  Seeing seen(settings);
  seen.update();
  BOOST_TEST(seen.sources.is_stale());
  seen.buffer.put({1, Obstacles::none()});
  seen.update();
  BOOST_TEST(!seen.sources.is_stale());
  for (int k = 0; k < 99; ++k) {
    seen.update();
  }
  BOOST_TEST(!seen.sources.is_stale());
  seen.update();
  seen.update();  // the age of 0.1 s itself is a matter of rounding
  BOOST_TEST(seen.sources.is_stale());
}

BOOST_AUTO_TEST_CASE(what_could_be_near_within_a_second_counts_as_moving_and_the_rest_does_not) {
  const Eigen::Vector3d place(0.5, 0.0, 0.6);  // 0.41 m from the arm, less its own radius of 0.05 m
  const auto moves = [&](const Eigen::Vector3d& velocity) {
    Seeing seen;
    seen.buffer.put({1, test::ball(place, 0.05, velocity)});
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
  const NumberedObstacles given{2, test::ball({5.0, 0.0, 1.0}, 0.1, {1.0, 0.0, 0.0})};
  before.buffer.put(given);
  after.buffer.put(given);
  before.update();
  before.update();
  after.sources.go_on_from(before.sources);
  BOOST_TEST(after.sources.number() == 2u);
  BOOST_TEST(after.sources.age() == 0.001);
  BOOST_TEST(std::abs(after.sources.obstacles().points()(0, 0) - 5.001) < 1e-15);  // rounding near 5
  BOOST_TEST(!after.update());
}

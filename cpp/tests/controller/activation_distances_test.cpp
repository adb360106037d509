// Activation distances that leave room where the arm is led, alone.
#include <boost/test/unit_test.hpp>

#include "../../src/controller/activation_distances.hpp"
#include "support/stage_model.hpp"

using namespace sidestep;
using Output = ControllerSettings::Output;

namespace {

/// The stage with an arm of two links along z, from 0.3 m to 0.9 m, and one place: upright.
struct Lowering {
  Lowering() { places.num = 1; }
  const ControllerModel model = test::stage_model(2, test::straight_settings(Output::position));
  ActivationDistances distances{model.system, model.clearances};
  Places places{2};
  bool blocked = false;
};

/// A ball that far from the second link, whose half width along x is 0.04 m.
Obstacles beside_link(double distance) { return test::ball({0.04 + 0.03 + distance, 0.0, 0.75}, 0.03); }

}  // namespace

BOOST_AUTO_TEST_CASE(barriers_are_lowered_below_the_clearance_at_a_place_and_no_others) {
  Lowering l;
  const Eigen::VectorXd usual = l.distances.values();
  l.distances.update(l.places, beside_link(0.03), l.blocked);
  BOOST_TEST(!l.blocked);
  Eigen::Index lowered = 0;
  for (Eigen::Index k = 0; k < usual.size(); ++k) {
    if (l.distances.values()[k] < usual[k]) {
      ++lowered;
      BOOST_TEST(l.model.system->labels()[static_cast<std::size_t>(k)].name == "link2");
      BOOST_TEST(l.distances.values()[k] <= 0.03);
      BOOST_TEST(l.distances.values()[k] > 0.02);  // no more than the mean over the body asks for, of a temperature of 2 mm
    }
  }
  BOOST_TEST(lowered == 1);
  l.distances.take(usual);
  BOOST_TEST((l.distances.values() == usual));
}

BOOST_AUTO_TEST_CASE(a_place_inside_an_obstacle_is_blocked) {
  Lowering l;
  l.distances.update(l.places, beside_link(-0.01), l.blocked);
  BOOST_TEST(l.blocked);
  l.distances.update(l.places, beside_link(0.01), l.blocked);
  BOOST_TEST(!l.blocked);
  GeometricSystem::Workspace other(*l.model.system);
  Eigen::VectorXd activations;
  BOOST_TEST(l.distances.lower_at(l.places, beside_link(-0.01), other, activations));
  l.distances.take(activations);
  BOOST_TEST((l.distances.values() == activations));
}

BOOST_AUTO_TEST_CASE(nothing_is_looked_at_again_until_places_or_obstacles_are_others) {
  Lowering l;
  const Obstacles near = beside_link(0.03);
  l.distances.update(l.places, near, l.blocked);
  const Eigen::VectorXd found = l.distances.values();
  const auto looks = [&](const Obstacles& obstacles) {
    l.blocked = true;  // A look finds that it is not.
    l.distances.update(l.places, obstacles, l.blocked);
    return !l.blocked;
  };
  BOOST_TEST(!looks(near));
  BOOST_TEST(looks(beside_link(0.03)));  // others, in the same place
  const Obstacles again = beside_link(0.03);
  BOOST_TEST(looks(again));
  BOOST_TEST((l.distances.values() == found));
  BOOST_TEST(!looks(again));
  l.distances.forget();
  BOOST_TEST(looks(again));
  l.places.q(1, 0) = 0.1;
  BOOST_TEST(looks(again));
  BOOST_TEST((l.distances.values() != found));
}

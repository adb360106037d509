// Velocities of what has a name: told ones, and shapes that are moved from set to set.
#include "sidestep/scene/velocity_estimate.hpp"

#include <Eigen/Geometry>
#include <boost/test/unit_test.hpp>
#include <string>
#include <vector>

#include "support/numbers.hpp"
#include "support/random.hpp"

using namespace sidestep;
using test::Random;

namespace {

constexpr double rounding = 1e-9;  // of differences of places over some milliseconds [m/s]

/// Corners of a box of 20 × 14 × 10 cm, turned about z by `angle` [rad], with its middle at `place` [m].
Eigen::Matrix3Xd box_at(const Eigen::Vector3d& place, double angle = 0.0) {
  Eigen::Matrix3Xd corners(3, 8);
  for (int k = 0; k < 8; ++k) {
    corners.col(k) << (k & 1 ? 0.1 : -0.1), (k & 2 ? 0.07 : -0.07), (k & 4 ? 0.05 : -0.05);
  }
  return (Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix() * corners).colwise() + place;
}

Obstacles named(const Eigen::Matrix3Xd& points, const std::string& name,
                const Eigen::Vector3d& told = Eigen::Vector3d::Zero()) {
  return Obstacles(points, Eigen::VectorXd::Constant(points.cols(), 0.03), told.replicate(1, points.cols()))
      .named({name}, {points.cols()});
}

double largest_error(const VelocityEstimate::Result& result, const Eigen::Vector3d& velocity) {
  return (result.velocities.colwise() - velocity).colwise().norm().maxCoeff();
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_told_velocity_is_kept) {
  const Eigen::Vector3d told(0.0, -0.3, 0.1);
  VelocityEstimate estimate;
  for (int k = 0; k < 3; ++k) {  // it moves by another velocity than it says
    const auto result = estimate.update(named(box_at({0.1 * k, 0.0, 0.5}), "box", told), 0.1 * k);
    BOOST_TEST(largest_error(result, told) == 0.0);
    BOOST_TEST(result.uncertainty.maxCoeff() == 0.0);
    BOOST_TEST(result.sets.maxCoeff() == 0);
  }
  Eigen::Matrix3Xd velocities = Eigen::Matrix3Xd::Zero(3, 2);
  velocities.col(1) = told;
  const Obstacles cloud(Eigen::Matrix3Xd::Identity(3, 2), Eigen::VectorXd::Zero(2), velocities);
  const auto result = estimate.update(cloud, 0.4);  // points without names are told one by one
  BOOST_TEST(result.sets[0] == 1);
  BOOST_TEST(result.sets[1] == 0);
  BOOST_TEST(result.velocities.col(1) == told);
}

BOOST_AUTO_TEST_CASE(a_named_shape_that_is_moved_has_its_velocity_from_the_second_set_on) {
  const Eigen::Vector3d velocity(0.3, 0.4, 0.0);
  for (const double rate : {10.0, 30.0, 100.0}) {
    VelocityEstimate estimate;
    for (int k = 0; k < 10; ++k) {
      const auto result = estimate.update(named(box_at(velocity * k / rate), "box"), k / rate);
      if (k == 0) {
        BOOST_TEST(largest_error(result, Eigen::Vector3d::Zero()) == 0.0);
        BOOST_TEST(result.uncertainty.minCoeff() == 2.0);
      } else {
        BOOST_TEST(largest_error(result, velocity) < rounding);
      }
      if (k >= 2) {
        BOOST_TEST(result.uncertainty.maxCoeff() < 1e-4);  // rounding in single precision over a period
      }
      BOOST_TEST(result.sets.minCoeff() == std::min(k + 1, 6));
    }
  }
}

BOOST_AUTO_TEST_CASE(a_named_shape_that_turns_moves_its_points_around_its_middle) {
  VelocityEstimate estimate;
  VelocityEstimate::Result result;
  const double turning = 1.5, period = 0.033;
  for (int k = 0; k < 4; ++k) {
    result = estimate.update(named(box_at({0.5, 0.0, 0.3}, turning * period * k), "box"), period * k);
  }
  const Eigen::Matrix3Xd arms = box_at(Eigen::Vector3d::Zero(), turning * period * 3);
  for (Eigen::Index n = 0; n < arms.cols(); ++n) {
    const Eigen::Vector3d truth = turning * Eigen::Vector3d::UnitZ().cross(arms.col(n));
    BOOST_TEST((result.velocities.col(n) - truth).norm() < 1e-6);
  }
}

BOOST_AUTO_TEST_CASE(a_named_ball_follows_a_motion_that_changes) {
  VelocityEstimate estimate;
  const double period = 1.0 / 30.0;
  for (int k = 0; k < 60; ++k) {  // 30 cm to and fro, once in 3 s: up to 0.63 m/s and 1.3 m/s²
    const double angle = 2.0 * 3.14159 / 3.0 * period * k;
    const Eigen::Vector3d truth(0.3 * 2.0 * 3.14159 / 3.0 * std::cos(angle), 0.0, 0.0);
    const auto result = estimate.update(named(Eigen::Vector3d(0.3 * std::sin(angle), 0.0, 0.0), "ball"), period * k);
    if (k >= 2) {
      BOOST_TEST(largest_error(result, truth) < 0.05);  // two periods of 1.3 m/s² behind: 0.044 m/s
      BOOST_TEST(largest_error(result, truth) <= result.uncertainty[0] + 0.03);
    }
  }
}

BOOST_AUTO_TEST_CASE(a_named_shape_that_rests_has_exactly_no_velocity) {
  VelocityEstimate estimate;
  for (int k = 0; k < 5; ++k) {
    const auto result = estimate.update(named(box_at({0.5, 0.0, 0.3}), "box"), 0.1 * k);
    BOOST_TEST(largest_error(result, Eigen::Vector3d::Zero()) == 0.0);
    BOOST_TEST(result.uncertainty.maxCoeff() == (k == 0 ? 2.0 : 0.0));
  }
  Random random(1);
  VelocityEstimate noisy;
  int moving = 0, uncertain = 0;
  for (int k = 0; k < 1000; ++k) {  // its pose is known to 5 mm
    const auto result = noisy.update(named(box_at(0.005 * random.vector(3)), "box"), k / 30.0);
    moving += k >= 6 && largest_error(result, Eigen::Vector3d::Zero()) > 0.0;
    uncertain += k >= 6 && result.uncertainty.maxCoeff() > 0.0;
  }
  BOOST_TEST(moving < 25);  // a test of 0.5 %, and of 2.5 % until it is sure of rest again
  BOOST_TEST(uncertain < 25);
}

BOOST_AUTO_TEST_CASE(a_named_shape_with_a_noisy_pose_moves_at_its_velocity) {
  Random random(2);
  const Eigen::Vector3d velocity(0.0, 0.5, 0.0);
  VelocityEstimate estimate;
  double sum = 0.0;
  for (int k = 0; k < 200; ++k) {
    const auto result = estimate.update(named(box_at(velocity * k / 30.0 + 0.005 * random.vector(3)), "box"), k / 30.0);
    sum += k >= 6 ? largest_error(result, velocity) / 194.0 : 0.0;
  }
  BOOST_TEST(sum < 0.12);  // a line through six places with 5 mm of noise: 0.036 m/s per axis; shorter lines have more
}

BOOST_AUTO_TEST_CASE(a_named_shape_that_was_put_elsewhere_has_no_velocity) {
  VelocityEstimate estimate;
  estimate.update(named(box_at({0.5, 0.0, 0.3}), "box"), 0.0);
  estimate.update(named(box_at({0.5, 0.0, 0.3}), "box"), 0.033);
  const auto result = estimate.update(named(box_at({0.5, 1.0, 0.3}), "box"), 0.066);
  BOOST_TEST(largest_error(result, Eigen::Vector3d::Zero()) == 0.0);
  BOOST_TEST(result.uncertainty.minCoeff() == 2.0);
  BOOST_TEST(result.sets.maxCoeff() == 1);
}

BOOST_AUTO_TEST_CASE(the_same_place_again_says_nothing_new_for_one_spacing) {
  const Eigen::Vector3d velocity(0.4, 0.0, 0.0);
  VelocityEstimate estimate;
  for (int k = 0; k < 4; ++k) {
    estimate.update(named(box_at(velocity * 0.1 * k), "box"), 0.1 * k);
  }
  const auto again = [&](double time) { return estimate.update(named(box_at(velocity * 0.1 * 3), "box"), time); };
  const auto held = again(0.35);
  BOOST_TEST(largest_error(held, velocity) < rounding);
  BOOST_TEST(held.uncertainty.minCoeff() >= 0.4);  // it may have stopped
  again(0.4);
  VelocityEstimate::Result rests;
  for (int k = 5; k < 9; ++k) {
    rests = again(0.1 * k);
  }
  BOOST_TEST(largest_error(rests, Eigen::Vector3d::Zero()) == 0.0);
}

BOOST_AUTO_TEST_CASE(what_is_no_rigid_motion_is_uncertain) {
  VelocityEstimate estimate;
  Eigen::Matrix3Xd person = box_at({1.0, 0.0, 1.0});
  estimate.update(named(person, "person"), 0.0);
  person(0, 7) += 0.04;  // one hand moves at 1.2 m/s
  const auto result = estimate.update(named(person, "person"), 0.033);
  const Eigen::Vector3d truth(0.04 / 0.033, 0.0, 0.0);
  BOOST_TEST((result.velocities.col(7) - truth).norm() <= result.uncertainty[7]);
  BOOST_TEST(result.uncertainty[7] > 3.0 * result.uncertainty[0] - 1.0);
}

BOOST_AUTO_TEST_CASE(what_cannot_be_compared_is_new) {
  VelocityEstimate estimate({.largest_speed = 0.7});
  estimate.update(named(box_at({0.0, 0.0, 0.0}), "box"), 1.0);
  const auto earlier = estimate.update(named(box_at({0.01, 0.0, 0.0}), "box"), 0.9);  // a clock that went back
  BOOST_TEST(earlier.uncertainty.minCoeff() == 0.7);
  BOOST_TEST(earlier.sets.maxCoeff() == 1);
  const auto other =
      estimate.update(named(box_at({0.02, 0.0, 0.0}).leftCols(5), "box"), 1.0);  // as many points as no shape had
  BOOST_TEST(other.velocities.isZero(0.0));
  estimate.forget();
  BOOST_TEST(estimate.update(named(box_at({0.0, 0.0, 0.0}), "box"), 1.1).sets.maxCoeff() == 1);
  BOOST_TEST(estimate.update(Obstacles::none(), 1.2).velocities.cols() == 0);
}

BOOST_AUTO_TEST_CASE(what_a_velocity_estimate_cannot_use_is_refused) {
  BOOST_CHECK_EXCEPTION(VelocityEstimate({.largest_speed = 0.0}), std::invalid_argument, [](const auto& error) {
    return std::string(error.what()).find("largest_speed is 0.000000, must be finite and positive") == 0;
  });
  VelocityEstimate estimate;
  BOOST_CHECK_THROW(estimate.update(Obstacles::none(), test::not_a_number), std::invalid_argument);
  const Obstacles box = named(box_at({0.0, 0.0, 0.0}), "box");
  const auto says = [](const std::string& words) {
    return [words](const std::invalid_argument& error) { return std::string(error.what()).find(words) == 0; };
  };
  BOOST_CHECK_EXCEPTION(estimate.update(box, 0.0, {}, Eigen::VectorXd::Zero(3)), std::invalid_argument,
                        says("noise has 3 values, must have one for each of 8 points, or none"));
  BOOST_CHECK_EXCEPTION(estimate.update(box, 0.0, {}, Eigen::VectorXd::Constant(8, -0.01)), std::invalid_argument,
                        says("noise is -0.010000, must be finite and not negative"));
  BOOST_TEST(estimate.update(box, 0.0).sets.maxCoeff() == 1);  // A set that was refused is none.
}

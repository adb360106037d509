// The gap is proven: a point of each ellipsoid, so far apart, and a direction along which they are no less apart.
#include "sidestep/clearance/ellipsoid_gap.hpp"

#include <array>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <vector>

#include "sidestep/math/instruction_set.hpp"
#include "support/every_instruction_set.hpp"
#include "support/random_scene.hpp"

using namespace sidestep;
using test::Random;

namespace {

Eigen::Matrix3d shape(Random& random, double least, double most) {
  const Eigen::Matrix3d R = test::random_pose(random, 0.0).linear();
  const Eigen::Vector3d axes = Eigen::Vector3d::NullaryExpr([&] { return random.uniform(least, most); });
  return R * axes.cwiseAbs2().asDiagonal() * R.transpose();
}

/// The boundary point farthest along n, from the centre.
Eigen::Vector3d support(const Eigen::Matrix3d& S, const Eigen::Vector3d& n) { return S * n / std::sqrt(n.dot(S * n)); }

}  // namespace

BOOST_AUTO_TEST_CASE(of_spheres) {
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  const EllipsoidGap apart = ellipsoid_gap({0.3, 0.0, 0.4}, 0.01 * I, 0.0225 * I);
  BOOST_TEST(std::abs(apart.value - 0.25) < 1e-15);
  BOOST_TEST((apart.normal - Eigen::Vector3d(0.6, 0.0, 0.8)).norm() < 1e-15);
  BOOST_TEST(std::abs(ellipsoid_gap({0.0, 0.1, 0.0}, 0.01 * I, 0.0225 * I).value + 0.15) < 1e-15);
  BOOST_TEST(std::abs(ellipsoid_gap({0.0, 0.0, 0.0}, 0.01 * I, 0.0225 * I).value + 0.25) < 1e-5);  // no direction
}

BOOST_AUTO_TEST_CASE(points_of_the_two_are_as_far_apart_as_the_gap) {
  Random random(1);
  int apart = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Eigen::Matrix3d S_a = shape(random, 0.01, 0.2), S_b = shape(random, 0.01, 0.2);
    const Eigen::Vector3d d = random.uniform(0.05, 0.6) * random.vector(3).normalized();
    const EllipsoidGap gap = ellipsoid_gap(d, S_a, S_b);
    const Eigen::Vector3d between = d - support(S_a, gap.normal) - support(S_b, gap.normal);
    BOOST_TEST(std::abs(gap.normal.norm() - 1.0) < 1e-15);
    if (gap.value > 0.0) {
      ++apart;
      BOOST_TEST(std::abs(between.norm() - gap.value) < 1e-12);
      BOOST_TEST((between - gap.value * gap.normal).norm() < 1e-12);
    }
  }
  BOOST_TEST(apart > 500);
}

BOOST_AUTO_TEST_CASE(a_shallow_overlap_is_its_depth) {
  // Two that are apart, moved together along the gap: they overlap by what is beyond it, with the same normal.
  Random random(2);
  int tried = 0;
  while (tried < 200) {
    const Eigen::Matrix3d S_a = shape(random, 0.03, 0.15), S_b = shape(random, 0.03, 0.15);
    const Eigen::Vector3d d = random.uniform(0.1, 0.5) * random.vector(3).normalized();
    const EllipsoidGap gap = ellipsoid_gap(d, S_a, S_b);
    if (gap.value > 0.0) {
      ++tried;
      constexpr double depth = 0.002;
      const EllipsoidGap overlap = ellipsoid_gap(d - (gap.value + depth) * gap.normal, S_a, S_b);
      BOOST_TEST(std::abs(overlap.value + depth) < 1e-12);
      BOOST_TEST((overlap.normal - gap.normal).norm() < 1e-9);
    }
  }
}

BOOST_AUTO_TEST_CASE(deep_overlaps_are_lower_bounds_and_finite) {
  Random random(3);
  for (int trial = 0; trial < 500; ++trial) {
    const Eigen::Matrix3d S_a = shape(random, 0.001, 0.3), S_b = shape(random, 0.001, 0.3);
    const Eigen::Vector3d d = 0.05 * random.vector(3);
    const EllipsoidGap gap = ellipsoid_gap(d, S_a, S_b);
    const Eigen::Vector3d n = d.normalized();
    const double start = n.dot(d) - std::sqrt(n.dot(S_a * n)) - std::sqrt(n.dot(S_b * n));
    BOOST_TEST(gap.value >= start);
    BOOST_TEST(std::isfinite(gap.curvature));
  }
}

BOOST_AUTO_TEST_CASE(every_instruction_set_finds_the_same_in_any_company) {
  const InstructionSet before = instruction_set();
  Random random(4);
  EllipsoidGaps gaps;
  std::vector<EllipsoidGap> alone;
  const auto agree = [](const EllipsoidGap& x, const EllipsoidGap& y, double tolerance) {
    BOOST_TEST(std::abs(x.value - y.value) <= tolerance);
    BOOST_TEST((x.normal - y.normal).norm() <= tolerance);
    BOOST_TEST((x.contact - y.contact).norm() <= tolerance);
  };
  while (!gaps.full()) {
    const Eigen::Matrix3d S_a = shape(random, 0.03, 0.15), S_b = shape(random, 0.03, 0.15);
    const Eigen::Vector3d d = random.uniform(0.3, 0.6) * random.vector(3).normalized();
    gaps.add(Eigen::Vector3d::Zero(), S_a, d, S_b);
    alone.push_back(ellipsoid_gap(d, S_a, S_b));
  }
  for (const InstructionSet set : test::EveryInstructionSet()) {
    BOOST_TEST_CONTEXT(name(set)) {
      gaps.solve();
      for (int k = 0; k < gaps.size(); ++k) {
        // Normals differ by the accuracy at which the iteration ends, 1e-12, over the curvature; the same code not at
        // all.
        agree(gaps[k], alone[static_cast<std::size_t>(k)], set == before ? 0.0 : 1e-11);
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(bounds_are_those_of_the_line_of_centres) {
  Random random(5);
  for (const InstructionSet set : test::EveryInstructionSet()) {
    BOOST_TEST_INFO_SCOPE(name(set));
    for (int trial = 0; trial < 100; ++trial) {
      const Eigen::Matrix3d R = test::random_pose(random, 0.0).linear(), S_b = shape(random, 0.01, 0.2);
      const Eigen::Vector3d b = random.uniform(0.0, 0.6) * random.vector(3).normalized();
      EllipsoidRow row;
      std::vector<Eigen::Vector3d> centres;
      std::vector<Eigen::Matrix3d> shapes;
      for (int k = random.integer(1, EllipsoidRow::capacity); k > 0; --k) {
        centres.push_back(0.3 * random.vector(3));
        shapes.push_back(shape(random, 0.01, 0.2));
        row.add(centres.back(), shapes.back());
      }
      BOOST_TEST(row.size() == static_cast<int>(centres.size()));
      BOOST_TEST(row.full() == (row.size() == EllipsoidRow::capacity));
      std::array<double, EllipsoidRow::capacity> bounds;
      row.bound(R, b, S_b, bounds);
      for (std::size_t k = 0; k < centres.size(); ++k) {
        const Eigen::Vector3d d = b - centres[k], n = d.normalized();
        const Eigen::Matrix3d S_here = R * S_b * R.transpose();
        const double bound = d.norm() - std::sqrt(n.dot(shapes[k] * n)) - std::sqrt(n.dot(S_here * n));
        BOOST_TEST(std::abs(bounds[k] - bound) < 1e-14);
        BOOST_TEST(bounds[k] <= ellipsoid_gap(d, shapes[k], S_here).value + 1e-14);
      }
    }
  }
}

// Means over the gaps of some pairs of ellipsoids, against those over all.
#include "sidestep/attractor/clearance_barrier.hpp"

#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <vector>

#include "sidestep/math/instruction_set.hpp"
#include "support/every_instruction_set.hpp"
#include "support/numbers.hpp"
#include "support/random_scene.hpp"

using namespace sidestep;
using test::Random;

namespace {

constexpr double smoothing = 0.004;

Body of_links(Random& random, const std::vector<std::pair<std::string, int>>& numbers, double spread) {
  std::vector<std::string> links;
  std::vector<double> weights;
  std::vector<Eigen::Matrix3d> covariances;
  for (const auto& [link, number] : numbers) {
    for (int k = 0; k < number; ++k) {
      const Eigen::Matrix3d R = test::random_pose(random, 0.0).linear();
      const Eigen::Vector3d axes(random.uniform(0.01, 0.1), random.uniform(0.01, 0.1), random.uniform(0.01, 0.1));
      links.push_back(link);
      weights.push_back(1.0 / number);
      covariances.push_back(R * axes.cwiseAbs2().asDiagonal() * R.transpose());
    }
  }
  const auto num = static_cast<int>(links.size());
  return Body(std::move(links), Eigen::VectorXd::Map(weights.data(), num), spread * random.matrix(3, num),
              std::move(covariances), Eigen::VectorXd::Ones(num));
}

/// Of every pair, in the order of the ellipsoids.
std::vector<double> gaps(const Robot& robot, const Body& body, const Eigen::VectorXd& q) {
  KinematicState state(robot);
  state.update(robot, q, Eigen::VectorXd::Zero(q.size()));
  std::vector<double> values;
  const auto ellipsoids = body_ellipsoids(robot, body, "test");
  for (const BodyEllipsoid& a : ellipsoids) {
    for (const BodyEllipsoid& b : ellipsoids) {
      const auto is_on = [&](const BodyEllipsoid& e, const char* link) {
        return body.links[static_cast<std::size_t>(e.component)] == link;
      };
      if (is_on(a, "link0") && is_on(b, "link2")) {
        const KinematicState::Link &first = state.link(a.joint), &second = state.link(b.joint);
        const auto turned = [](const KinematicState::Link& link, const Eigen::Matrix3d& S) -> Eigen::Matrix3d {
          return link.R_WL * S * link.R_WL.transpose();
        };
        values.push_back(ellipsoid_gap(second.p_WL + second.R_WL * b.mean - first.p_WL - first.R_WL * a.mean,
                                       turned(first, a.shape), turned(second, b.shape))
                             .value);
      }
    }
  }
  return values;
}

/// Weights exp(−by/T).
double mean(const std::vector<double>& values, const std::vector<double>& by) {
  const double least = *std::min_element(by.begin(), by.end());
  double sum = 0.0, weights = 0.0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const double weight = std::exp((least - by[k]) / smoothing);
    sum += weight * values[k];
    weights += weight;
  }
  return sum / weights;
}

}  // namespace

BOOST_AUTO_TEST_CASE(is_the_mean_over_all_pairs) {
  constexpr double activation = 0.1, reach = 0.3, step = 1e-6;
  for (const InstructionSet set : test::EveryInstructionSet()) {
    BOOST_TEST_INFO_SCOPE(name(set));
    Random random(1);
    int within = 0, apart = 0, approaching = 0;
    for (int trial = 0; trial < 100; ++trial) {
      const Robot robot = test::random_tree(random, 3);
      // More than are bounded at once of the first, and more pairs than are listed at once.
      const Body body = of_links(random, {{"link0", 20}, {"link1", 1}, {"link2", 14}}, random.magnitude(0.02, 0.3));
      const SelfCollisionBarrier barrier(robot, body, {{"link0", "link2"}}, {activation, 1.0, 2.0, 0.002}, smoothing, reach);
      const Eigen::VectorXd q = random.vector(robot.num_coordinates()).cwiseMax(-3.0).cwiseMin(3.0);
      const Eigen::VectorXd v = random.uniform(0.0, 2.0) * random.vector(robot.num_coordinates());
      const EmbeddingEvaluation found = evaluate(barrier, q, v, Obstacles::none());
      const std::vector<double> now = gaps(robot, body, q), later = gaps(robot, body, q + step * v),
                                sooner = gaps(robot, body, q - step * v);
      const double tau = Horizon::of_stop(v, robot.limits()), least = mean(now, now);
      if (!(least < reach)) {
        BOOST_TEST((found.clearances.values[0] == test::infinity || std::abs(found.clearances.values[0] - least) < 1e-9));
        continue;
      }
      ++within;
      BOOST_TEST(std::abs(found.clearances.values[0] - least) < 1e-9);
      if (*std::min_element(now.begin(), now.end()) < 0.0) {
        continue;  // gaps of deep overlaps jump, where another maximum is the nearest
      }
      ++apart;
      BOOST_TEST(std::abs(found.clearances.rates[0] - (mean(later, later) - mean(sooner, sooner)) / (2.0 * step)) <
                 1e-5 * (1.0 + v.norm()));
      std::vector<double> rates, ahead;
      for (std::size_t k = 0; k < now.size(); ++k) {
        rates.push_back((later[k] - sooner[k]) / (2.0 * step));
        ahead.push_back(now[k] + tau * rates[k]);
      }
      if (*std::min_element(ahead.begin(), ahead.end()) < activation) {
        ++approaching;
        BOOST_TEST(std::abs(found.clearances.approach.values[0] - mean(now, ahead)) < 1e-6);
        BOOST_TEST(std::abs(found.clearances.approach.rates[0] - mean(rates, ahead)) < 1e-5);
      }
    }
    BOOST_TEST(within > 40);
    BOOST_TEST(apart > 20);
    BOOST_TEST(approaching > 8);
  }
}

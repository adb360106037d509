// The nearest node against a plain scan, and the domains of nodes.
#include "sidestep/planning/search_tree.hpp"

#include <boost/test/unit_test.hpp>
#include <limits>

#include "support/random.hpp"

using namespace sidestep;

BOOST_AUTO_TEST_CASE(finds_the_nearest_node_and_keeps_domains) {
  test::Random random(1);
  Eigen::VectorXd weights(6);
  weights << 2.0, 1.5, 1.0, 0.5, 0.2, 0.1;
  SearchTree tree(weights, 200);
  for (int k = 0; k < 200; ++k) {
    BOOST_TEST(tree.add(random.vector(6), k - 1) == k);
    BOOST_TEST(tree.domain(k) == std::numeric_limits<double>::infinity());
    BOOST_TEST(tree.parent(k) == k - 1);
  }
  BOOST_TEST(tree.full());
  for (int query = 0; query < 100; ++query) {
    const Eigen::VectorXd q = random.vector(6);
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < tree.size(); ++k) {
      const double distance = (weights.asDiagonal() * (q - tree.node(k))).norm();
      BOOST_TEST(std::abs(tree.distance(k, q) - distance) < 1e-14);
      least = std::min(least, distance);
    }
    BOOST_TEST(std::abs(tree.distance(tree.nearest(q), q) - least) < 1e-5);  // it scans in single precision
  }
  BOOST_TEST(!tree.bounded(7));
  tree.bound(7, 0.5);
  BOOST_TEST(tree.bounded(7));
  BOOST_TEST(tree.domain(7) == 0.5);
  tree.clear();
  tree.add(random.vector(6), -1);
  BOOST_TEST(tree.domain(0) == std::numeric_limits<double>::infinity());
}

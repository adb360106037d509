// The allocation guard itself: it must see every kind of allocation, or the tests that use it prove nothing.
#include "support/allocations.hpp"

#include <Eigen/Core>
#include <boost/test/unit_test.hpp>
#include <cstdlib>
#include <memory>
#include <vector>

using sidestep::test::allocations_of;

namespace {
const void* volatile sink = nullptr;  // keeps the compiler from removing allocations that nobody uses

struct alignas(64) CacheLine {
  double data[8];
};
}  // namespace

BOOST_AUTO_TEST_CASE(nothing_is_counted_without_allocation) {
  Eigen::VectorXd x = Eigen::VectorXd::Ones(7), y = x;
  BOOST_TEST(allocations_of([&] { y.noalias() += 2.0 * x; }) == 0u);
  BOOST_TEST(y[6] == 3.0);
}

BOOST_AUTO_TEST_CASE(operator_new_is_seen) {
  BOOST_TEST(allocations_of([] { sink = std::make_unique<double>(1.0).get(); }) == 1u);
  BOOST_TEST(allocations_of([] { sink = std::vector<int>(10).data(); }) == 1u);
}

BOOST_AUTO_TEST_CASE(over_aligned_new_is_seen) {
  BOOST_TEST(allocations_of([] { sink = std::make_unique<CacheLine>().get(); }) == 1u);
}

BOOST_AUTO_TEST_CASE(malloc_is_seen) {
  BOOST_TEST(allocations_of([] {
               void* p = std::malloc(8);
               sink = p;
               std::free(p);
             }) == 1u);
}

BOOST_AUTO_TEST_CASE(eigen_is_seen) {
  const Eigen::VectorXd x = Eigen::VectorXd::Ones(7);
  BOOST_TEST(allocations_of([&] { sink = Eigen::VectorXd(2.0 * x).data(); }) == 1u);
  // A product whose result is also an operand goes through a temporary: the usual slip in a control loop.
  Eigen::MatrixXd A = Eigen::MatrixXd::Identity(7, 7);
  BOOST_TEST(allocations_of([&] { A = A * A; }) > 0u);
}

// What points belong to, by name.
#include <boost/test/unit_test.hpp>

#include "sidestep/scene/obstacles.hpp"
#include "support/allocations.hpp"

using namespace sidestep;

namespace {

Obstacles row(Eigen::Index num) {
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, num);
  points.row(0).setLinSpaced(0.0, static_cast<double>(num - 1));
  return Obstacles(points, Eigen::VectorXd::Constant(num, 0.1), Eigen::Matrix3Xd::Ones(3, num));
}

}  // namespace

BOOST_AUTO_TEST_CASE(points_have_the_names_of_what_they_belong_to) {
  const Obstacles plain = row(4);
  BOOST_TEST(plain.name_of(0).empty());
  BOOST_TEST(plain.words_for(3) == "obstacle point 3");
  BOOST_TEST(plain.words_for(-1) == "an obstacle");
  Obstacles named = plain.named({"table", "nothing", "", "cup"}, {1, 0, 1, 2});
  BOOST_TEST(named.name_of(0) == "table");
  BOOST_TEST(named.words_for(0) == "'table'");
  BOOST_TEST(named.words_for(1) == "obstacle point 1");
  BOOST_TEST(named.words_for(2) == "'cup'");
  BOOST_TEST(named.name_of(4).empty());
  BOOST_TEST(named.name_of(-1).empty());
  BOOST_TEST(named.version() == plain.version());  // the same points
  const auto groups = named.groups();
  BOOST_REQUIRE(groups.size() == 4u);
  BOOST_TEST(groups[3].first == "cup");
  BOOST_TEST(groups[3].second == 2);
  BOOST_TEST(named.advance(0.5));
  BOOST_TEST(named.frozen().name_of(3) == "cup");
}

BOOST_AUTO_TEST_CASE(names_that_do_not_fit_the_points_are_refused) {
  const Obstacles plain = row(3);
  BOOST_CHECK_THROW(plain.named({"a"}, {1, 2}), std::invalid_argument);
  BOOST_CHECK_THROW(plain.named({"a", "b"}, {1, 3}), std::invalid_argument);
  BOOST_CHECK_THROW(plain.named({"a", "b"}, {4, -1}), std::invalid_argument);
  BOOST_CHECK_THROW(plain.named({"a"}, {2}), std::invalid_argument);
}

BOOST_AUTO_TEST_CASE(names_cost_nothing_in_the_loop) {
  Obstacles named = row(100).named({"a", "b"}, {40, 60});
  const std::size_t allocations = test::allocations_of([&] {
    static_cast<void>(named.advance(1e-3));
    static_cast<void>(named.name_of(70));
  });
  BOOST_TEST(allocations == 0);
}

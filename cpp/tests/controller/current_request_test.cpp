// The request that a step follows, alone: what is taken over, and what following makes of it.
#include <boost/test/unit_test.hpp>

#include "../../src/controller/current_request.hpp"

using namespace sidestep;

namespace {

const Eigen::Vector2d asked_position(1.0, -1.0), asked_velocity(0.5, 0.25);

}  // namespace

BOOST_AUTO_TEST_CASE(a_request_is_taken_over_once_and_ages_by_periods) {
  TripleBuffer<NumberedRequest> buffer{NumberedRequest{}};
  CurrentRequest request(buffer);
  BOOST_TEST(!request.update(0.01));
  BOOST_TEST(!request.is_any());
  buffer.put({3, VelocityRequest{asked_velocity}});
  BOOST_TEST(request.update(0.01));
  BOOST_TEST(request.number() == 3u);
  BOOST_TEST(request.age() == 0.0);
  BOOST_TEST(request.has_input());
  BOOST_TEST(request.begins_input());
  BOOST_TEST((request.goal() == nullptr));
  BOOST_TEST(!request.update(0.01));
  BOOST_TEST(request.age() == 0.01);
  request.begun();
  BOOST_TEST(!request.begins_input());
  request.stand();
  BOOST_TEST(!request.has_input());
  BOOST_TEST(request.is_any());
}

BOOST_AUTO_TEST_CASE(a_goal_that_moves_goes_on_by_its_velocity_and_one_at_rest_stays) {
  TripleBuffer<NumberedRequest> buffer{NumberedRequest{}};
  CurrentRequest request(buffer);
  buffer.put({1, Goal(JointGoal(asked_position, asked_velocity))});
  BOOST_TEST(request.update(0.01));
  BOOST_TEST(request.moves());
  BOOST_TEST(!request.has_input());
  request.update(0.01);
  const Eigen::VectorXd& position = std::get<JointGoal>(*request.goal()).position;
  BOOST_TEST((position - asked_position - 0.01 * asked_velocity).cwiseAbs().maxCoeff() < 1e-15);  // rounding near 1
  buffer.put({2, Goal(JointGoal(asked_position))});
  BOOST_TEST(request.update(0.01));
  BOOST_TEST(!request.moves());
  request.update(0.01);
  BOOST_TEST((std::get<JointGoal>(*request.goal()).position == asked_position));
}

BOOST_AUTO_TEST_CASE(another_arm_goes_on_with_what_following_made_of_the_same_request_and_with_a_newer_one_as_it_is) {
  TripleBuffer<NumberedRequest> buffer{NumberedRequest{}}, same{NumberedRequest{}}, newer{NumberedRequest{}};
  const NumberedRequest moving{1, Goal(JointGoal(asked_position, asked_velocity))};
  CurrentRequest before(buffer), after(same), later(newer);
  buffer.put(moving);
  same.put(moving);
  newer.put({2, VelocityRequest{asked_velocity}});
  before.update(0.1);
  before.update(0.1);
  later.go_on_from(before);
  BOOST_TEST(later.number() == 1u);
  BOOST_TEST(later.update(0.1));  // the next step takes it over
  BOOST_TEST(later.number() == 2u);
  after.go_on_from(before);
  BOOST_TEST(after.age() == 0.1);
  const Eigen::VectorXd& position = std::get<JointGoal>(*after.goal()).position;
  BOOST_TEST((position - asked_position - 0.1 * asked_velocity).cwiseAbs().maxCoeff() < 1e-15);  // rounding near 1
  BOOST_TEST(!after.update(0.1));
}

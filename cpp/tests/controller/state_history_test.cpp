// Where the arm was: between two steps, before the first, after the last, and while another thread writes.
#include <atomic>
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <thread>

#include "sidestep/controller/state_history.hpp"
#include "support/allocations.hpp"

using namespace sidestep;

BOOST_AUTO_TEST_CASE(a_history_is_linear_between_steps) {
  StateHistory history(2);
  Eigen::VectorXd q = Eigen::Vector2d(7.0, 7.0);
  BOOST_TEST(!history.at(0.0, q));
  BOOST_TEST(std::isnan(history.last_time()));
  history.put(1.0, Eigen::Vector2d(0.0, 10.0));
  history.put(2.0, Eigen::Vector2d(4.0, 20.0));
  BOOST_TEST(!history.at(0.999, q));
  BOOST_TEST(q == Eigen::Vector2d(7.0, 7.0));
  BOOST_TEST(history.at(1.25, q));
  BOOST_TEST(q == Eigen::Vector2d(1.0, 12.5));
  BOOST_TEST(history.at(5.0, q));
  BOOST_TEST(q == Eigen::Vector2d(4.0, 20.0));
  BOOST_TEST(history.last_time() == 2.0);
}

BOOST_AUTO_TEST_CASE(a_time_that_goes_back_begins_a_history_anew) {
  StateHistory history(1);
  history.put(1.0, Eigen::VectorXd::Constant(1, 1.0));
  history.put(2.0, Eigen::VectorXd::Constant(1, 2.0));
  history.put(0.5, Eigen::VectorXd::Constant(1, 5.0));
  Eigen::VectorXd q(1);
  BOOST_TEST(history.at(0.5, q));
  BOOST_TEST(q[0] == 5.0);
  BOOST_TEST(history.at(1.5, q));
  BOOST_TEST(q[0] == 5.0);
}

BOOST_AUTO_TEST_CASE(a_history_keeps_its_last_states) {
  StateHistory history(1);
  const auto num = static_cast<int>(StateHistory::capacity) + 100;
  const std::size_t allocated = test::allocations_of([&] {
    Eigen::Matrix<double, 1, 1> q;
    for (int n = 0; n < num; ++n) {
      q[0] = n;
      history.put(n, q);
    }
  });
  BOOST_TEST(allocated == 0u);
  Eigen::VectorXd q(1);
  BOOST_TEST(!history.at(50.0, q));
  BOOST_TEST(history.at(num - 1000.5, q));
  BOOST_TEST(q[0] == num - 1000.5);
}

BOOST_AUTO_TEST_CASE(a_reader_never_sees_half_a_state) {
  StateHistory history(8);
  std::atomic<bool> ends{false};
  std::thread writer([&] {
    Eigen::VectorXd q(8);
    for (int n = 1; !ends.load(); ++n) {
      q.setConstant(n);
      history.put(n, q);
    }
  });
  int num_read = 0;
  bool is_whole = true;
  Eigen::VectorXd q(8);
  while (num_read < 2000) {
    const double time = history.last_time();
    if (std::isnan(time) || !history.at(time - 2.5, q)) {
      std::this_thread::yield();
      continue;
    }
    ++num_read;
    is_whole = is_whole && (q.array() == q[0]).all() && q[0] == time - 2.5;
  }
  ends = true;
  writer.join();
  BOOST_TEST(is_whole);
}

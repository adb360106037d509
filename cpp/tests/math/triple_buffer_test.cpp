// The newest value reaches the reader whole, whoever writes.
#include "sidestep/math/triple_buffer.hpp"

#include <array>
#include <boost/test/unit_test.hpp>
#include <memory>
#include <thread>
#include <vector>

#include "support/allocations.hpp"

using namespace sidestep;

BOOST_AUTO_TEST_CASE(hands_over_the_newest_value_across_threads) {
  TripleBuffer<std::array<int, 16>> buffer({});
  constexpr int last = 200000;
  std::thread writer([&] {
    for (int i = 1; i <= last; ++i) {
      buffer.draft().fill(i);
      buffer.submit();
    }
  });
  int seen = 0;
  bool whole = true, forward = true;
  while (seen < last) {
    if (buffer.update()) {
      const std::array<int, 16> value = buffer.get();
      forward = forward && value[0] > seen;
      for (const int v : value) {
        whole = whole && v == value[0];
      }
      seen = value[0];
    }
  }
  writer.join();
  BOOST_TEST(whole);
  BOOST_TEST(forward);
  BOOST_TEST(!buffer.update());
}

BOOST_AUTO_TEST_CASE(values_of_many_writers_arrive_whole_and_cost_the_reader_nothing) {
  using Value = std::vector<int>;
  TripleBuffer<std::shared_ptr<const Value>> buffer(std::make_shared<const Value>(16, 0));
  constexpr int last = 5000;
  const auto write = [&](int writer) {
    for (int i = 1; i <= last; ++i) {
      buffer.put(std::make_shared<const Value>(16, writer * last + i));
    }
  };
  std::thread one(write, 0), other(write, 1);
  bool whole = true;
  std::size_t allocations = 0;
  std::array<int, 2> seen{0, 0};
  while (seen[0] < last && seen[1] < last) {  // the very last value is that of one of them
    const Value* newest = nullptr;
    allocations += test::allocations_of([&] { newest = buffer.get().get(); });
    const Value& value = *newest;
    for (const int v : value) {
      whole = whole && v == value[0];
    }
    seen[value[0] > last ? 1 : 0] = value[0] > last ? value[0] - last : value[0];
  }
  one.join();
  other.join();
  BOOST_TEST(whole);
  BOOST_TEST(allocations == 0);
}

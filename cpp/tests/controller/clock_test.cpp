// The controller's own clock: what a told time, the machine's clock and the settings make of the moment of a step.
#include <boost/test/unit_test.hpp>
#include <cmath>
#include <vector>

#include "../../src/controller/clock.hpp"
#include "support/numbers.hpp"

using namespace sidestep;

namespace {

constexpr double clock_period = 0.001;    // [s]
constexpr double clock_rounding = 1e-12;  // [s] of differences of some seconds
const double untold = test::not_a_number;

bool is(double a, double b) { return std::abs(a - b) < clock_rounding; }

/// Steps that come at these intervals by the machine's clock [s].
const Tick& run(Clock& clock, const std::vector<double>& intervals) {
  for (const double interval : intervals) {
    clock.advance(untold, {interval, interval});
  }
  return clock.tick();
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_synchronous_run_counts_exactly_a_period_whatever_the_machine_says) {
  Clock clock(clock_period, true);
  for (int k = 1; k <= 1000; ++k) {
    const Tick& tick = clock.advance(untold, {0.5, 0.5});
    BOOST_TEST(tick.time == k * clock_period);
    BOOST_TEST(tick.elapsed == clock_period);
    BOOST_TEST(tick.held == clock_period);
    BOOST_TEST(tick.period == clock_period);
    BOOST_TEST(!tick.gap);
    BOOST_TEST(tick.pauses);  // for a sample that disagrees: something else has moved the arm meanwhile
  }
  BOOST_TEST(clock.tick().late == 0);
  BOOST_TEST(clock.tick().missed == 0);
}

BOOST_AUTO_TEST_CASE(a_loop_faster_than_real_time_is_a_simulation_and_a_slower_one_is_late) {
  Clock fast(clock_period, false), slow(clock_period, false);
  const Tick& simulated = run(fast, std::vector<double>(100, 0.0001));
  BOOST_TEST(simulated.time == 100 * clock_period);
  BOOST_TEST(simulated.period == clock_period);
  BOOST_TEST(simulated.late == 0);
  const Tick& late = run(slow, {0.004, 0.004, 0.004, 0.004});
  BOOST_TEST(is(late.time, 0.016));
  BOOST_TEST(is(late.elapsed, 0.004));
  BOOST_TEST(is(late.period, 0.004));  // the median of five from the third on
  BOOST_TEST(is(late.held, 0.004));
  BOOST_TEST(is(late.expected, 0.004));
  BOOST_TEST(late.late == 4);
  BOOST_TEST(late.missed == 12);
  BOOST_TEST(late.torque_period() == clock_period);
  BOOST_TEST(slow.explain() == "called every 4.0 ms, told 1.0 ms");
  run(slow, {0.001, 0.001, 0.001});
  BOOST_TEST(slow.tick().period == clock_period);
  BOOST_TEST(slow.explain() == "");
}

BOOST_AUTO_TEST_CASE(jitter_of_the_machine_averages_out_and_one_late_step_counts_whole) {
  Clock clock(clock_period, false);
  for (int k = 0; k < 50; ++k) {
    const Tick& tick = run(clock, {k % 2 == 0 ? 0.0007 : 0.0013});
    BOOST_TEST(tick.elapsed == clock_period);
    BOOST_TEST(tick.is_as_expected());
  }
  const Tick& late = run(clock, {0.0013, 0.005});
  BOOST_TEST(is(late.elapsed, 0.005));
  BOOST_TEST(is(late.held, 0.0053));        // and what the step before was late by
  BOOST_TEST(late.period == clock_period);  // one step says nothing of the next
  BOOST_TEST(late.late == 1);
  BOOST_TEST(late.missed == 4);
}

BOOST_AUTO_TEST_CASE(a_told_time_counts_by_its_difference_in_synchronous_runs_too) {
  for (const bool synchronous : {true, false}) {
    Clock clock(clock_period, synchronous);
    double stamp = 1e6;
    BOOST_TEST(clock.advance(stamp, {}).time == clock_period);  // the first says nothing of what was before
    for (int k = 0; k < 10; ++k) {
      clock.advance(stamp += 0.0005, {});
    }
    const Tick& tick = clock.tick();
    BOOST_TEST(std::abs(tick.elapsed - 0.0005) < 1e-9);  // rounding of the stamps
    BOOST_TEST(std::abs(tick.period - 0.0005) < 1e-9);
    BOOST_TEST(std::abs(tick.time - 0.006) < 1e-8);
    BOOST_TEST(tick.torque_period() == tick.elapsed);
    BOOST_TEST(tick.late == 0);
    BOOST_TEST(std::abs(clock.tick().own_time(stamp - 0.03) - (tick.time - 0.03)) < 1e-9);
  }
  Clock exact(clock_period, true);
  double stamp = 0.0;
  for (int k = 1; k <= 1000; ++k) {
    BOOST_TEST(exact.advance(stamp += clock_period, {}).time == k * clock_period);  // rounding of stamps is none of time
  }
}

BOOST_AUTO_TEST_CASE(what_the_reference_counts_leaves_out_jitter_and_loses_no_time) {
  Clock clock(clock_period, true);
  double stamp = 0.0, held = 0.0;
  int others = 0;
  clock.advance(stamp, {});
  for (int k = 0; k < 300; ++k) {
    const Tick& tick = clock.advance(stamp += k % 3 == 0 ? 0.0013 : 0.0008, {});  // 29 ms in 30 steps
    held += tick.held;
    others += !tick.is_as_expected();
    BOOST_TEST(std::abs(held - stamp) < 0.51 * clock_period);
  }
  BOOST_TEST(others <= 25);  // 10 ms in halves of a period
  BOOST_TEST(clock.tick().period == clock_period);
}

BOOST_AUTO_TEST_CASE(a_time_that_goes_back_is_told_and_the_own_time_goes_on) {
  Clock clock(clock_period, true);
  clock.advance(5.0, {});
  clock.advance(5.001, {});
  const Tick& back = clock.advance(4.701, {});
  BOOST_TEST(!back.goes_on());
  BOOST_TEST(is(back.back, 0.3));
  BOOST_TEST(is(back.time, 0.003));
  BOOST_TEST(clock.explain() == "the time went back by 0.3 s");
  BOOST_TEST(clock.advance(4.702, {}).goes_on());
  BOOST_TEST(is(clock.tick().time, 0.004));
  BOOST_TEST(is(clock.tick().own_time(4.7), 0.002));
  BOOST_TEST(clock.advance(4.702, {}).back == 0.0);
  BOOST_TEST(clock.explain() == "the time stands still");
  BOOST_TEST(is(clock.tick().time, 0.005));
}

BOOST_AUTO_TEST_CASE(a_step_whose_time_is_not_told_counts_a_period_and_none_twice) {
  Clock clock(clock_period, true);
  clock.advance(1.0, {});
  clock.advance(1.001, {});
  for (const double none : {untold, test::infinity}) {
    BOOST_TEST(clock.advance(none, {}).elapsed == clock_period);
    BOOST_TEST(clock.tick().goes_on());
  }
  const Tick& told = clock.advance(1.006, {});
  BOOST_TEST(is(told.elapsed, 0.003));
  BOOST_TEST(is(told.time, 0.007));
}

BOOST_AUTO_TEST_CASE(a_jump_forward_is_a_pause_that_ages_and_moves_nothing) {
  Clock told(clock_period, true), untold_time(clock_period, false);
  told.advance(1.0, {});
  const Tick& jump = told.advance(2.0, {});
  BOOST_TEST(jump.gap);
  BOOST_TEST(jump.pauses);
  BOOST_TEST(is(jump.elapsed, 1.0));
  BOOST_TEST(jump.moved == clock_period);
  BOOST_TEST(jump.held == clock_period);
  BOOST_TEST(jump.period == clock_period);
  BOOST_TEST(jump.missed == 999);
  BOOST_TEST(told.advance(2.001, {}).is_as_expected());
  BOOST_TEST(run(untold_time, {1.0}).gap);
  BOOST_TEST(is(untold_time.tick().elapsed, 1.0));
  Clock slow(0.05, true);
  slow.advance(0.0, {});
  BOOST_TEST(!slow.advance(0.24, {}).gap);  // five periods
  BOOST_TEST(slow.advance(0.6, {}).gap);
}

BOOST_AUTO_TEST_CASE(an_arm_whose_torques_change_rarely_is_slower_below_half_of_the_told_rate) {
  Tick tick = Tick::regular(clock_period);
  BOOST_TEST(tick.speed_share() == 1.0);
  tick.period = 0.002;
  BOOST_TEST(tick.speed_share() == 1.0);
  tick.period = 0.008;
  BOOST_TEST(is(tick.speed_share(), 0.25));
}

BOOST_AUTO_TEST_CASE(an_arm_whose_torques_get_lost_is_slower) {
  // Every tenth step is missing, after a while; then none is.
  Clock clock(clock_period, false);
  double now = 0.0;
  for (int k = 0; k < 3000; ++k) {
    now += k % 9 == 8 ? 2 * clock_period : clock_period;
    BOOST_TEST(clock.advance(now, {}).period == clock_period);
  }
  BOOST_TEST(std::abs(clock.tick().missed_share - 0.1) < 0.005);
  BOOST_TEST(std::abs(clock.tick().speed_share() - 0.8) < 0.02);
  BOOST_TEST(std::abs(clock.tick().inside() - 0.8e-3) < 0.08e-3);
  BOOST_TEST(clock.explain() == "10 % of the steps are missing");
  for (int k = 0; k < 2000; ++k) {
    now += clock_period;
    clock.advance(now, {});
  }
  BOOST_TEST(clock.tick().missed_share < 0.015);  // e^-2 of it
  BOOST_TEST(clock.tick().speed_share() == 1.0);
  BOOST_TEST(clock.tick().inside() == 0.0);
  BOOST_TEST(clock.explain().empty());
}

BOOST_AUTO_TEST_CASE(slow_loops_pauses_stalls_and_rare_late_steps_are_no_losses) {
  Clock slow(clock_period, false), rests(clock_period, false), rare(clock_period, false), stalls(clock_period, false);
  double now = 0.0;
  for (int k = 0; k < 500; ++k) {
    slow.advance(now += 2 * clock_period, {});
  }
  BOOST_TEST(slow.tick().missed_share < 0.01);  // of the first two, until its period is measured
  BOOST_TEST(slow.tick().speed_share() == 1.0);
  rests.advance(0.0, {});
  rests.advance(1.0, {});
  BOOST_TEST(rests.tick().missed_share == 0.0);
  stalls.advance(0.0, {});
  stalls.advance(0.09, {});
  BOOST_TEST(stalls.tick().missed == 89);
  BOOST_TEST(stalls.tick().missed_share < 0.01);
  BOOST_TEST(stalls.tick().speed_share() == 1.0);
  now = 0.0;
  for (int k = 0; k < 2000; ++k) {  // 1 %
    rare.advance(now += k % 99 == 98 ? 2 * clock_period : clock_period, {});
  }
  BOOST_TEST(rare.tick().missed_share < 0.02);
  BOOST_TEST(rare.tick().speed_share() == 1.0);
}

// Times of a link: round trip of a request, and age of the state when every cycle is sent.
//     link_benchmark ADDRESS [SECONDS]
// prints JSON; ADDRESS is served by `sidestep serve` on this machine.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <vector>

#include "sidestep/link/client.hpp"
#include "sidestep/link/token.hpp"

using namespace sidestep::link;

namespace {

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

void print(const char* name, std::vector<double> seconds, const char* end) {
  std::ranges::sort(seconds);
  const auto at = [&](double share) {
    return 1e6 * seconds[static_cast<std::size_t>(share * static_cast<double>(seconds.size() - 1))];
  };
  std::printf("  \"%s\": {\"count\": %zu, \"p50_us\": %.1f, \"p99_us\": %.1f, \"p99.9_us\": %.1f, \"worst_us\": %.1f}%s\n",
              name, seconds.size(), at(0.5), at(0.99), at(0.999), at(1.0), end);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: link_benchmark ADDRESS [SECONDS]\n");
    return 2;
  }
  const Address address(argv[1]);
  const double duration = argc > 2 ? std::atof(argv[2]) : 10.0;
  Client client(address, {.name = "benchmark", .token = read_token(default_token_file(address)), .rate = 0.0});
  std::vector<double> trips, ages;
  for (const double end = now() + duration; now() < end;) {
    trips.push_back(client.ping());
  }
  client.subscribe(std::numeric_limits<double>::infinity());
  CycleMessage cycle;
  std::uint64_t first = 0;
  for (const double end = now() + duration; now() < end;) {
    if (client.next_cycle(cycle, cycle.cycle, 1.0)) {
      ages.push_back(now() - cycle.now);
      first = first == 0 ? cycle.cycle : first;
    }
  }
  std::printf("{\n");
  print("round_trip", trips, ",");
  print("state_age", ages, ",");
  std::printf("  \"cycles_missed\": %lld\n}\n",
              static_cast<long long>(cycle.cycle - first + 1) - static_cast<long long>(ages.size()));
  return 0;
}

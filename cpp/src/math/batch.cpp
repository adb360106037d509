#include "batch.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace sidestep {
namespace {

constexpr int most_threads = 1024;            // Largest number of threads that may be asked for.
constexpr std::chrono::milliseconds nap{10};  // Time between two checks for an interruption while other threads work.
constexpr double most_record_bytes = 8.0 * 1024.0 * 1024.0 * 1024.0;  // Largest memory that one record may take [B].

}  // namespace

Eigen::Index most_rows(double bytes_per_row, Eigen::Index motions) noexcept {
  return static_cast<Eigen::Index>(most_record_bytes /
                                   (bytes_per_row * static_cast<double>(std::max<Eigen::Index>(motions, 1))));
}

void share(Eigen::Index num, int threads, const Interrupted& interrupted,
           const std::function<void(Eigen::Index k, const Interrupted& halted)>& work) {
  if (threads < 0 || threads > most_threads) {
    throw std::invalid_argument("batch: threads is " + std::to_string(threads) + ", must be from 0 to 1024");
  }
  const Eigen::Index wanted = threads > 0 ? threads : std::max(1u, std::thread::hardware_concurrency());
  std::atomic<Eigen::Index> counter{0};
  std::atomic<bool> stopped{false};
  std::exception_ptr error;
  std::size_t ended = 0;
  std::mutex mutex;  // Guards `error` and `ended`.
  std::condition_variable end;
  const auto run = [&](const Interrupted& halted) {
    try {
      for (Eigen::Index k = counter.fetch_add(1); k < num && !halted(); k = counter.fetch_add(1)) {
        work(k, halted);
      }
    } catch (...) {
      stopped = true;
      const std::lock_guard lock(mutex);
      error = error ? error : std::current_exception();
    }
  };
  const auto is_stopped = [&] { return stopped.load(std::memory_order_relaxed); };
  const auto asks = [&] {
    if (interrupted()) {
      stopped = true;
    }
    return is_stopped();
  };
  std::vector<std::thread> pool;
  const auto others = static_cast<std::size_t>(std::max<Eigen::Index>(std::min(wanted, num) - 1, 0));
  pool.reserve(others);
  try {
    while (pool.size() < others) {
      pool.emplace_back([&] {
        run(is_stopped);
        const std::lock_guard lock(mutex);
        ++ended;
        end.notify_one();
      });
    }
  } catch (const std::exception&) {  // the machine gives no more: those there are do it
  }
  run(asks);
  for (std::unique_lock lock(mutex); ended < pool.size();) {
    if (end.wait_for(lock, nap, [&] { return ended == pool.size(); })) {
      break;
    }
    lock.unlock();
    asks();
    lock.lock();
  }
  for (std::thread& thread : pool) {
    thread.join();
  }
  if (error) {
    std::rethrow_exception(error);
  }
  if (stopped) {
    throw Interruption();
  }
}

}  // namespace sidestep

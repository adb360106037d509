#include "sidestep/dynamical_system/batch.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>

#include "rollout_rows.hpp"

namespace sidestep {
namespace {

void check(const GeometricSystem& system, const Eigen::MatrixXd& q, const Eigen::MatrixXd& v,
           const Eigen::MatrixXd& goals) {
  const Eigen::Index nv = system.robot().num_coordinates();
  const auto require = [&q, nv](const Eigen::MatrixXd& matrix, const char* name) {
    if (matrix.rows() != q.rows() || matrix.cols() != nv) {
      throw std::invalid_argument(std::string("batch: ") + name + " is " + std::to_string(matrix.rows()) + " × " +
                                  std::to_string(matrix.cols()) + ", expected " + std::to_string(q.rows()) + " × " +
                                  std::to_string(nv));
    }
  };
  require(q, "q");
  require(v, "v");
  require(goals, "goals");
}

constexpr int most_threads = 1024;
constexpr std::chrono::milliseconds nap{10};  // between two looks for an interruption, while other threads work

/// Runs work(next, halted) on every thread, where next() gives each of 0 … num − 1 once and then num, and halted() says
/// whether to end at once: at an error, or an interruption, which the calling thread asks for. Rethrows the first error.
template <class Work>
void share(Eigen::Index num, int threads, const Interrupted& interrupted, Work&& work) {
  if (threads < 0 || threads > most_threads) {
    throw std::invalid_argument("batch: threads is " + std::to_string(threads) + ", must be from 0 to 1024");
  }
  const Eigen::Index wanted = threads > 0 ? threads : std::max(1u, std::thread::hardware_concurrency());
  std::atomic<Eigen::Index> counter{0};
  std::atomic<bool> stopped{false};
  std::exception_ptr error;
  std::size_t ended = 0;
  std::mutex mutex;  // of the two above
  std::condition_variable end;
  const auto run = [&](const Interrupted& halted) {
    try {
      work([&] { return halted() ? num : std::min(counter.fetch_add(1), num); }, halted);
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

}  // namespace

std::vector<Rollout> rollout_batch(const GeometricSystem& system, const Eigen::MatrixXd& q, const Eigen::MatrixXd& v,
                                   const Eigen::MatrixXd& goals, const Obstacles& obstacles,
                                   const RolloutSettings& settings, int threads) {
  check(system, q, v, goals);
  check_records(system, settings, q.rows());
  std::vector<Rollout> result(static_cast<std::size_t>(q.rows()));
  share(q.rows(), threads, settings.interrupted, [&](auto&& next, const Interrupted& halted) {
    RolloutSettings own = settings;
    own.interrupted = halted;
    for (Eigen::Index k = next(); k < q.rows(); k = next()) {
      result[static_cast<std::size_t>(k)] =
          rollout(system, q.row(k).transpose(), v.row(k).transpose(),
                  Goal(JointGoal(Eigen::VectorXd(goals.row(k).transpose()))), obstacles, own);
    }
  });
  return result;
}

}  // namespace sidestep

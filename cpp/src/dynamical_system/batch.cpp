#include "sidestep/dynamical_system/batch.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <exception>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>

#include "rollout_rows.hpp"
#include "sidestep/dynamical_system/step_block.hpp"

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

/// Runs work(block, first, halted) on every thread, where `first` is that of every block of states.
template <class Work>
void share_blocks(const GeometricSystem& system, Eigen::Index num, int threads, const Interrupted& interrupted, Work&& work) {
  const Eigen::Index blocks = (num + block_states - 1) / block_states;
  share(blocks, threads, interrupted, [&](auto&& next, const Interrupted& halted) {
    StepBlock block(system);
    for (Eigen::Index k = next(); k < blocks; k = next()) {
      work(block, k * block_states, halted);
    }
  });
}

/// Copies states [first, first + num) of column `from`, and the last of them for what is left of the block.
void copy(const Eigen::MatrixXd& from, Eigen::Index column, Eigen::Index first, Eigen::Index num, BlockRow& to) {
  const double* const states = from.data() + column * from.rows() + first;
  if (num == block_states) {
    std::memcpy(to.of, states, sizeof to.of);
    return;
  }
  for (Eigen::Index i = 0; i < block_states; ++i) {
    to.of[i] = states[std::min(i, num - 1)];
  }
}

/// Fills a block with the states from `first` on and returns how many there are.
Eigen::Index load(StepBlock& block, Eigen::Index first, const Eigen::MatrixXd& q, const Eigen::MatrixXd& v,
                  const Eigen::MatrixXd& goals) {
  const Eigen::Index num = std::min<Eigen::Index>(block_states, q.rows() - first);
  for (Eigen::Index j = 0; j < q.cols(); ++j) {
    const auto row = static_cast<std::size_t>(j);
    copy(q, j, first, num, block.q[row]);
    copy(v, j, first, num, block.v[row]);
    copy(goals, j, first, num, block.goal[row]);
  }
  return num;
}

/// The states from `first` on, as many as a block holds.
void evaluate(StepBlock& block, Eigen::Index first, const Eigen::MatrixXd& q, const Eigen::MatrixXd& v,
              const Eigen::MatrixXd& goals, const Obstacles& obstacles, BatchEvaluation& result) {
  const Eigen::Index num = load(block, first, q, v, goals);
  block.update(obstacles);
  for (Eigen::Index j = 0; j < q.cols(); ++j) {
    std::copy_n(block.acceleration[static_cast<std::size_t>(j)].of, num, &result.accelerations(first, j));
  }
  std::copy_n(block.value.of, num, &result.values(first, 0));
  std::copy_n(block.statuses.begin(), num, result.statuses.begin() + first);
}

/// Motions [first, first + num) of `result`, side by side.
void roll_out(StepBlock& block, Eigen::Index first, const Eigen::MatrixXd& q, const Eigen::MatrixXd& v,
              const Eigen::MatrixXd& goals, const Obstacles& start_obstacles, const RolloutSettings& settings,
              const Interrupted& halted, std::vector<Rollout>& result) {
  const Eigen::Index num = load(block, first, q, v, goals);
  ObstaclesInMotion obstacles(start_obstacles);
  const auto motions = result.begin() + first;
  std::generate_n(motions, num, [&] { return make_rollout(block.system(), settings); });
  using Numbers = Eigen::Array<double, block_states, 1>;
  for (Eigen::Index k = 0; k <= settings.steps; ++k) {
    if (halted()) {
      throw Interruption();
    }
    block.update(obstacles.now());
    for (Eigen::Index i = 0; i < num; ++i) {
      Rollout& motion = motions[i];
      StepBlock::get(block.q, static_cast<int>(i), motion.q.row(k));
      StepBlock::get(block.v, static_cast<int>(i), motion.v.row(k));
      StepBlock::get(block.acceleration, static_cast<int>(i), motion.acceleration.row(k));
      motion.values(k, 0) = block.value.of[i];
      motion.switch_weights.row(k).setConstant(block.switch_weight.of[i]);
      motion.statuses.push_back(block.statuses[static_cast<std::size_t>(i)]);
    }
    for (std::size_t j = 0; j < block.q.size(); ++j) {
      Eigen::Map<Numbers> position(block.q[j].of), velocity(block.v[j].of);
      const Eigen::Map<Numbers> acceleration(block.acceleration[j].of);
      hold(settings.integrator, settings.period, acceleration, position, velocity);
    }
    obstacles.advance(settings.period);
  }
}

}  // namespace

BatchEvaluation evaluate_batch(const GeometricSystem& system, const Eigen::MatrixXd& q, const Eigen::MatrixXd& v,
                               const Eigen::MatrixXd& goals, const Obstacles& obstacles, int threads,
                               const Interrupted& interrupted) {
  check(system, q, v, goals);
  BatchEvaluation result{Eigen::MatrixXd(q.rows(), q.cols()),
                         Eigen::MatrixXd(q.rows(), system.num_embedding_coordinates()),
                         std::vector<StepStatus>(static_cast<std::size_t>(q.rows()))};
  if (StepBlock::takes(system)) {
    share_blocks(system, q.rows(), threads, interrupted, [&](StepBlock& block, Eigen::Index first, const Interrupted&) {
      evaluate(block, first, q, v, goals, obstacles, result);
    });
    return result;
  }
  share(q.rows(), threads, interrupted, [&](auto&& next, const Interrupted&) {
    GeometricSystem::Workspace workspace(system);
    for (Eigen::Index k = next(); k < q.rows(); k = next()) {
      const Eigen::VectorXd position = q.row(k), velocity = v.row(k), goal = goals.row(k);
      const StepStatus status = system.acceleration(position, velocity, goal, obstacles, workspace);
      result.statuses[static_cast<std::size_t>(k)] = status;
      result.accelerations.row(k) = workspace.acceleration;
      if (is_fallback(status)) {
        result.values.row(k).setConstant(std::numeric_limits<double>::quiet_NaN());
      } else {
        result.values.row(k) = workspace.values;
      }
    }
  });
  return result;
}

std::vector<Rollout> rollout_batch(const GeometricSystem& system, const Eigen::MatrixXd& q, const Eigen::MatrixXd& v,
                                   const Eigen::MatrixXd& goals, const Obstacles& obstacles,
                                   const RolloutSettings& settings, int threads) {
  check(system, q, v, goals);
  if (settings.escape != nullptr || settings.evasion != nullptr) {
    throw std::invalid_argument("batch: an escape or evasion belongs to one motion; give none");
  }
  check_records(system, settings, q.rows());
  std::vector<Rollout> result(static_cast<std::size_t>(q.rows()));
  if (StepBlock::takes(system) && !settings.filter && !settings.time_steps &&
      settings.integrator != Integrator::runge_kutta_4) {
    share_blocks(system, q.rows(), threads, settings.interrupted,
                 [&](StepBlock& block, Eigen::Index first, const Interrupted& halted) {
      roll_out(block, first, q, v, goals, obstacles, settings, halted, result);
    });
    return result;
  }
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

#include "sidestep/dynamical_system/batch.hpp"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <exception>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>

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

/// Runs work(next) on every thread, where next() gives each of 0 … num − 1 once and then num. Rethrows.
template <class Work>
void share(Eigen::Index num, int threads, Work&& work) {
  if (threads < 0) {
    throw std::invalid_argument("batch: threads is " + std::to_string(threads) + ", must be >= 0");
  }
  const Eigen::Index wanted = threads > 0 ? threads : std::max(1u, std::thread::hardware_concurrency());
  std::atomic<Eigen::Index> counter{0};
  std::exception_ptr error;
  std::mutex error_mutex;
  const auto guarded = [&] {
    try {
      work([&] { return std::min(counter.fetch_add(1), num); });
    } catch (...) {
      const std::lock_guard lock(error_mutex);
      error = std::current_exception();
    }
  };
  std::vector<std::thread> pool;
  for (Eigen::Index i = 1; i < std::min(wanted, num); ++i) {
    pool.emplace_back(guarded);
  }
  guarded();
  for (std::thread& thread : pool) {
    thread.join();
  }
  if (error) {
    std::rethrow_exception(error);
  }
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

/// The states from `first` on, as many as a block holds.
void evaluate(StepBlock& block, Eigen::Index first, const Eigen::MatrixXd& q, const Eigen::MatrixXd& v,
              const Eigen::MatrixXd& goals, const Obstacles& obstacles, BatchEvaluation& result) {
  const Eigen::Index num = std::min<Eigen::Index>(block_states, q.rows() - first);
  for (Eigen::Index j = 0; j < q.cols(); ++j) {
    const auto row = static_cast<std::size_t>(j);
    copy(q, j, first, num, block.q[row]);
    copy(v, j, first, num, block.v[row]);
    copy(goals, j, first, num, block.goal[row]);
  }
  block.update(obstacles);
  for (Eigen::Index j = 0; j < q.cols(); ++j) {
    std::copy_n(block.acceleration[static_cast<std::size_t>(j)].of, num, &result.accelerations(first, j));
  }
  std::copy_n(block.value.of, num, &result.values(first, 0));
  std::copy_n(block.statuses.begin(), num, result.statuses.begin() + first);
}

}  // namespace

BatchEvaluation evaluate_batch(const GeometricSystem& system, const Eigen::MatrixXd& q, const Eigen::MatrixXd& v,
                               const Eigen::MatrixXd& goals, const Obstacles& obstacles, int threads) {
  check(system, q, v, goals);
  BatchEvaluation result{Eigen::MatrixXd(q.rows(), q.cols()),
                         Eigen::MatrixXd(q.rows(), system.num_embedding_coordinates()),
                         std::vector<StepStatus>(static_cast<std::size_t>(q.rows()))};
  if (StepBlock::takes(system)) {
    share((q.rows() + block_states - 1) / block_states, threads, [&](auto&& next) {
      StepBlock block(system);
      for (Eigen::Index k = next(); k * block_states < q.rows(); k = next()) {
        evaluate(block, k * block_states, q, v, goals, obstacles, result);
      }
    });
    return result;
  }
  share(q.rows(), threads, [&](auto&& next) {
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
  std::vector<Rollout> result(static_cast<std::size_t>(q.rows()));
  share(q.rows(), threads, [&](auto&& next) {
    for (Eigen::Index k = next(); k < q.rows(); k = next()) {
      result[static_cast<std::size_t>(k)] =
          rollout(system, q.row(k).transpose(), v.row(k).transpose(),
                  Goal(JointGoal(Eigen::VectorXd(goals.row(k).transpose()))), obstacles, settings);
    }
  });
  return result;
}

}  // namespace sidestep

#include "sidestep/dynamical_system/batch.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>

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

}  // namespace

BatchEvaluation evaluate_batch(const GeometricSystem& system, const Eigen::MatrixXd& q, const Eigen::MatrixXd& v,
                               const Eigen::MatrixXd& goals, const Obstacles& obstacles, int threads) {
  check(system, q, v, goals);
  BatchEvaluation result{Eigen::MatrixXd(q.rows(), q.cols()),
                         Eigen::MatrixXd(q.rows(), system.num_embedding_coordinates()),
                         std::vector<StepStatus>(static_cast<std::size_t>(q.rows()))};
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

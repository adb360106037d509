#include "sidestep/thesis/rollout_batch.hpp"

#include <stdexcept>
#include <string>

#include "../math/batch.hpp"
#include "rollout_rows.hpp"

namespace sidestep {
namespace {

void check(const GeometricSystem& system, const Eigen::MatrixXd& q, const Eigen::MatrixXd& v, const Eigen::MatrixXd& goals) {
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

}  // namespace

std::vector<Rollout> rollout_batch(const GeometricSystem& system, const Eigen::MatrixXd& q, const Eigen::MatrixXd& v,
                                   const Eigen::MatrixXd& goals, const Obstacles& obstacles, const RolloutSettings& settings,
                                   int threads) {
  check(system, q, v, goals);
  check_records(system, settings, q.rows());
  std::vector<Rollout> result(static_cast<std::size_t>(q.rows()));
  share(q.rows(), threads, settings.interrupted, [&](Eigen::Index k, const Interrupted& halted) {
    RolloutSettings own = settings;
    own.interrupted = halted;
    result[static_cast<std::size_t>(k)] = rollout(system, q.row(k).transpose(), v.row(k).transpose(),
                                                  Goal(JointGoal(Eigen::VectorXd(goals.row(k).transpose()))), obstacles, own);
  });
  return result;
}

}  // namespace sidestep

#include "sidestep/thesis/rollout.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "../math/batch.hpp"
#include "rollout_rows.hpp"

namespace sidestep {
namespace {

using Clock = std::chrono::steady_clock;

void check_size(const Eigen::VectorXd& vector, const char* name, int nv) {
  if (vector.size() != nv) {
    throw std::invalid_argument(std::string(name) + " has " + std::to_string(vector.size()) + " entries, expected " +
                                std::to_string(nv));
  }
}

/// One step of the classical scheme; `a1` is the acceleration at (q, v, t). Leaves the obstacles and the goal at t +
/// dt. A stage that falls back brakes; the status that is recorded is that of the step's own state.
void runge_kutta_4(const GeometricSystem& system, GeometricSystem::Workspace& w, Goal& goal, ObstaclesInMotion& obstacles,
                   double dt, const Eigen::VectorXd& a1, Eigen::VectorXd& q, Eigen::VectorXd& v) {
  const double half = 0.5 * dt;
  const auto stage = [&](const Eigen::VectorXd& stage_q, const Eigen::VectorXd& stage_v) -> Eigen::VectorXd {
    static_cast<void>(system.acceleration(stage_q, stage_v, goal, obstacles.now(), w));
    return w.acceleration;
  };
  obstacles.advance(half);
  advance(goal, half);
  const Eigen::VectorXd v2 = v + half * a1;
  const Eigen::VectorXd a2 = stage(q + half * v, v2);
  const Eigen::VectorXd v3 = v + half * a2;
  const Eigen::VectorXd a3 = stage(q + half * v2, v3);
  obstacles.advance(half);
  advance(goal, half);
  const Eigen::VectorXd v4 = v + dt * a3;
  const Eigen::VectorXd a4 = stage(q + dt * v3, v4);
  q += dt / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4);
  v += dt / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
}

}  // namespace

void check_records(const GeometricSystem& system, const RolloutSettings& settings, Eigen::Index motions) {
  if (!(settings.period > 0.0) || !std::isfinite(settings.period)) {
    throw std::invalid_argument("period is " + std::to_string(settings.period) + " s, must be positive and finite");
  }
  if (settings.steps < 1) {
    throw std::invalid_argument("steps is " + std::to_string(settings.steps) + ", must be at least 1");
  }
  if (!std::isfinite(settings.period * settings.steps)) {
    throw std::invalid_argument("period times steps is not finite");
  }
  const double numbers =
      1.0 + 4.0 * system.robot().num_coordinates() + system.num_embedding_coordinates() + (settings.time_steps ? 1.0 : 0.0);
  const double row = numbers * sizeof(double) + sizeof(StepStatus);
  const Eigen::Index most_steps = std::max<Eigen::Index>(most_rows(row, motions) - 1, 0);
  if (settings.steps > most_steps) {
    throw std::invalid_argument("steps is " + std::to_string(settings.steps) + ", must be at most " +
                                std::to_string(most_steps) + " for " + std::to_string(motions) +
                                " motions: their records may have 8 GiB");
  }
}

Rollout make_rollout(const GeometricSystem& system, const RolloutSettings& settings) {
  check_records(system, settings, 1);
  const Eigen::Index rows = static_cast<Eigen::Index>(settings.steps) + 1, nv = system.robot().num_coordinates();
  Rollout result{Eigen::VectorXd::LinSpaced(rows, 0.0, settings.period * settings.steps),
                 Eigen::MatrixXd(rows, nv),
                 Eigen::MatrixXd(rows, nv),
                 Eigen::MatrixXd(rows, nv),
                 Eigen::MatrixXd(rows, system.num_embedding_coordinates()),
                 Eigen::MatrixXd(rows, nv),
                 {},
                 Eigen::VectorXd(settings.time_steps ? rows : 0)};
  result.statuses.reserve(static_cast<std::size_t>(rows));
  return result;
}

Rollout rollout(const GeometricSystem& system, const Eigen::VectorXd& start, const Eigen::VectorXd& start_velocity, Goal goal,
                const Obstacles& start_obstacles, const RolloutSettings& settings) {
  const int nv = system.robot().num_coordinates();
  check_size(start, "q", nv);
  check_size(start_velocity, "v", nv);
  if (const auto* joint = std::get_if<JointGoal>(&goal)) {
    check_size(joint->position, "goal", nv);
  }
  Rollout result = make_rollout(system, settings);
  const Eigen::Index rows = result.time.size();
  const double dt = settings.period;
  GeometricSystem::Workspace w(system);
  ObstaclesInMotion obstacles(start_obstacles);
  Eigen::VectorXd q = start;
  Eigen::VectorXd v = start_velocity;
  for (Eigen::Index k = 0; k < rows; ++k) {
    if (settings.interrupted()) {
      throw Interruption();
    }
    const Clock::time_point begin = settings.time_steps ? Clock::now() : Clock::time_point{};
    const StepStatus status = system.acceleration(q, v, goal, obstacles.now(), w);
    const Eigen::VectorXd a = w.acceleration;
    if (settings.time_steps) {
      result.step_seconds[k] = std::chrono::duration<double>(Clock::now() - begin).count();
    }
    result.q.row(k) = q;
    result.v.row(k) = v;
    result.acceleration.row(k) = a;
    if (is_fallback(status)) {
      result.values.row(k).setConstant(std::numeric_limits<double>::quiet_NaN());
      result.switch_weights.row(k).setConstant(std::numeric_limits<double>::quiet_NaN());
    } else {
      result.values.row(k) = w.values;
      result.switch_weights.row(k) = w.switch_weights;
    }
    result.statuses.push_back(status);
    if (settings.integrator == Integrator::runge_kutta_4) {
      runge_kutta_4(system, w, goal, obstacles, dt, a, q, v);
    } else {
      hold(settings.integrator, dt, a, q, v);
      obstacles.advance(dt);
      advance(goal, dt);
    }
  }
  return result;
}

}  // namespace sidestep

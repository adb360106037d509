#include "sidestep/controller/motion.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "impl.hpp"

namespace sidestep {
namespace {

// Rows are kept in memory: 10 million of 7 joints take 2 GB.
constexpr int most_steps = 10'000'000;

void check(const Eigen::VectorXd& value, const char* name, Eigen::Index nv) {
  if (value.size() != nv || !value.allFinite()) {
    throw std::invalid_argument(std::string("integrate: ") + name + " has " + std::to_string(value.size()) +
                                " entries, needed are " + std::to_string(nv) + " finite ones");
  }
}

}  // namespace

MotionRecord integrate(Controller& controller, const Eigen::VectorXd& q, const Eigen::VectorXd& v, int steps,
                       const Eigen::VectorXd& goal, double tolerance, const Interrupted& interrupted) {
  const Eigen::Index nv = controller.arm().num_coordinates();
  check(q, "q", nv);
  check(v, "v", nv);
  if (goal.size() != 0) {
    check(goal, "goal", nv);
  }
  if (steps < 1 || steps > most_steps) {
    throw std::invalid_argument("integrate: steps is " + std::to_string(steps) + ", allowed: 1 to " +
                                std::to_string(most_steps));
  }
  if (!controller.settings().synchronous) {
    throw std::invalid_argument("integrate: the controller must be synchronous, as its threads keep the machine's time");
  }
  const double period = controller.settings().period;
  MotionRecord record{Eigen::MatrixXd(steps, nv), Eigen::MatrixXd(steps, nv), Eigen::MatrixXd(steps, nv), {}, {},
                      Eigen::VectorXd(steps),     Eigen::VectorXd(steps),     q,                          v};
  const std::vector<bool> unlimited = unlimited_joints(controller.arm().robot());
  const auto away = [&](const Eigen::VectorXd& at) {  // of the goal; a turn more or less is the same place
    double largest = 0.0;
    for (Eigen::Index j = 0; j < nv; ++j) {
      const double error = at[j] - goal[j];
      largest = std::max(largest, std::abs(unlimited[static_cast<std::size_t>(j)] ? std::remainder(error, 2.0 * std::numbers::pi) : error));
    }
    return largest;
  };
  int done = 0;
  while (done < steps && !record.arrived) {
    if (interrupted()) {
      throw Interruption();
    }
    const auto begin = std::chrono::steady_clock::now();
    const Command& command = controller.step(record.last_q, record.last_v);
    record.step_seconds[done] = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    record.q.row(done) = record.last_q;
    record.v.row(done) = record.last_v;
    record.acceleration.row(done) = command.acceleration;
    record.clearance[done] = command.clearance;
    record.statuses.push_back(command.status);
    record.activities.push_back(command.activity);
    ++done;
    if (goal.size() != 0 && away(record.last_q) < tolerance) {
      record.arrived = true;
      break;
    }
    record.last_v += period * command.acceleration;
    record.last_q += period * record.last_v;
  }
  for (Eigen::MatrixXd* rows : {&record.q, &record.v, &record.acceleration}) {
    rows->conservativeResize(done, Eigen::NoChange);
  }
  record.clearance.conservativeResize(done);
  record.step_seconds.conservativeResize(done);
  return record;
}

}  // namespace sidestep

#include "sidestep/controller/motion.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <numbers>
#include <set>
#include <stdexcept>
#include <string>

#include "../math/batch.hpp"
#include "impl.hpp"

namespace sidestep {
namespace {

// Rows are kept in memory: 10 million of 7 joints take 2 GB.
constexpr int most_steps = 10'000'000;
constexpr double prismatic_tolerance =
    0.1;  // Tolerance of prismatic joints as a share of that of revolute ones, as in ArrivalSettings [m/rad].

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
    throw std::invalid_argument(
        "integrate: the controller must be synchronous, as its threads keep the machine's time: make it with "
        "ControllerSettings(synchronous=True), in C++ settings.synchronous = true");
  }
  const double period = controller.settings().period;
  MotionRecord record{Eigen::MatrixXd(steps, nv),
                      Eigen::MatrixXd(steps, nv),
                      Eigen::MatrixXd(steps, nv),
                      {},
                      {},
                      Eigen::VectorXd(steps),
                      Eigen::VectorXd(steps),
                      q,
                      v};
  const Robot robot = controller.arm().robot();
  const std::vector<bool> unlimited = unlimited_joints(robot);
  std::vector<bool> slides(unlimited.size());
  for (std::size_t j = 0; j < slides.size(); ++j) {
    slides[j] = robot.is_prismatic(static_cast<int>(j));
  }
  const auto away = [&](const Eigen::VectorXd& at) {  // of the goal; a turn more or less is the same place
    double largest = 0.0;
    for (Eigen::Index j = 0; j < nv; ++j) {
      const double error = at[j] - goal[j];
      const double way =
          std::abs(unlimited[static_cast<std::size_t>(j)] ? std::remainder(error, 2.0 * std::numbers::pi) : error);
      largest = std::max(largest, slides[static_cast<std::size_t>(j)] ? way / prismatic_tolerance : way);
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

std::vector<MotionRecord> integrate_batch(const std::vector<Controller*>& controllers, const Eigen::MatrixXd& q,
                                          const Eigen::MatrixXd& v, int steps, const Eigen::MatrixXd& goals, double tolerance,
                                          int threads, const Interrupted& interrupted) {
  const auto num = static_cast<Eigen::Index>(controllers.size());
  for (const Eigen::MatrixXd* rows : {&q, &v, &goals}) {
    if (rows->rows() != num && !(rows == &goals && goals.size() == 0)) {
      const char* const name = rows == &q ? "q" : rows == &v ? "v" : "goals";
      throw std::invalid_argument(std::string("integrate_batch: ") + name + " has " + std::to_string(rows->rows()) +
                                  " rows, needed is one for each of the " + std::to_string(num) + " controllers");
    }
  }
  if (std::set<Controller*>(controllers.begin(), controllers.end()).size() != controllers.size()) {
    throw std::invalid_argument("integrate_batch: a controller is there twice; each motion needs its own");
  }
  const double row = (3.0 * static_cast<double>(q.cols()) + 2.0) * sizeof(double) + sizeof(SafetyStatus) + sizeof(Activity);
  if (const Eigen::Index most = most_rows(row, num); steps > most) {
    throw std::invalid_argument("integrate_batch: steps is " + std::to_string(steps) + ", must be at most " +
                                std::to_string(most) + " for " + std::to_string(num) +
                                " motions: their records may have 8 GiB");
  }
  std::deque<Controller::ClaimedController> uses;
  for (Controller* const controller : controllers) {
    uses.emplace_back(*controller);
  }
  std::vector<MotionRecord> records(controllers.size());
  share(num, threads, interrupted, [&](Eigen::Index k, const Interrupted& halted) {
    const Eigen::VectorXd goal = goals.size() == 0 ? Eigen::VectorXd() : Eigen::VectorXd(goals.row(k).transpose());
    const auto i = static_cast<std::size_t>(k);
    records[i] = integrate(*controllers[i], q.row(k).transpose(), v.row(k).transpose(), steps, goal, tolerance, halted);
  });
  return records;
}

}  // namespace sidestep

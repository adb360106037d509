#include "sidestep/loop/franka_driver.hpp"

#include <franka/active_control_base.h>
#include <franka/exception.h>
#include <franka/robot.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <optional>
#include <stdexcept>

#include "real_time_thread.hpp"
#include "sidestep/loop/stream_limiter.hpp"

namespace sidestep {
namespace {

using Output = ControllerSettings::Output;
using Joints = std::array<double, 7>;

constexpr double franka_cycle = 0.001;  // [s]
constexpr double answer_share = 0.7;    // of the cycle, after which an answer may come too late [-]
constexpr double waited_for = 2e-5;     // a read that took longer waited for its state [s]
constexpr double stale_share = 1.5;  // of the cycle, after which a read that waited has slept on, while newer states came [-]
constexpr double resting_speed = 0.02;  // joint speed below which a motion is finished, not stopped [rad/s]
constexpr double rate_rounding = 1e-6;  // of a success rate [-]
// Differences of what the robot says it was told from what was sent, beyond rounding to single precision.
constexpr double torque_rounding = 1e-3, acceleration_rounding = 0.15;  // [Nm], [rad/s²]; rounding of positions makes 0.12

Eigen::VectorXd franka_joints(std::initializer_list<double> values) {
  return Eigen::Map<const Eigen::VectorXd>(values.begin(), static_cast<Eigen::Index>(values.size()));
}

Eigen::Map<const Eigen::VectorXd> joint_vector(const Joints& values) { return {values.data(), 7}; }

Joints joint_array(const Eigen::VectorXd& values) noexcept {
  Joints out{};
  std::copy_n(values.data(), 7, out.begin());
  return out;
}

// What the robot enforces: Franka's "Robot and interface specifications" of the Research 3.
StreamLimits franka_limits() {
  const auto same = [](double value) { return Eigen::VectorXd::Constant(7, value); };
  return {{franka_joints({-2.7501, -1.7918, -2.9065, -3.0481, -2.8101, 0.54092, -3.0196}),
           franka_joints({2.7501, 1.7918, 2.9065, -0.1458, 2.8101, 4.5205, 3.0196}),
           franka_joints({2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26}), same(10.0), franka_joints({87, 87, 87, 87, 12, 12, 12}),
           same(5000.0), same(1000.0)},
          franka_joints({6.0, 2.585, 3.5, 4.0, 17.0, 5.5, 17.0}),
          franka_joints({0.3, 0.2, 0.2, 0.3, 0.35, 0.35, 0.35})};
}

RobotDescription franka_description() {
  RobotDescription description;
  description.name = "Franka Research 3";
  for (int k = 1; k <= 7; ++k) {
    description.joints.push_back("fr3_joint" + std::to_string(k));
  }
  description.limits = franka_limits().joints;
  description.outputs = {Output::torque, Output::velocity, Output::position};
  description.period = franka_cycle;
  description.when_silent = "goes on at its last acceleration or torque, and stops itself after 20 ms";
  return description;
}

#ifdef SIDESTEP_FRANKA_CLOCK
double franka_now() noexcept { return SIDESTEP_FRANKA_CLOCK; }  // of a test [s]
#else
double franka_now() noexcept { return monotonic_time(); }
#endif

}  // namespace

struct FrankaDriver::Impl {
  Impl(const std::string& address, bool enforce)
      : robot(address, enforce ? franka::RealtimeConfig::kEnforce : franka::RealtimeConfig::kIgnore) {}

  struct Received {
    int passed = 0;     // cycles since the state before
    bool fresh = true;  // it has just come
  };

  // Reads the newest state into `newest`.
  Received receive() {
    Received received;
    const double began = franka_now();
    if (control) {
      auto [state, span] = control->readOnce();
      newest = state;
      received.passed = static_cast<int>(span.toMSec());
    } else {
      newest = robot.readOnce();
    }
    const double now = franka_now();
    const double waited = now - began;
    arrived = waited > waited_for ? now : std::min(now, arrived + received.passed * franka_cycle);
    received.fresh = waited < stale_share * franka_cycle && (waited > waited_for || received.passed <= 1);
    return received;
  }

  // Whether the answer to the last state was lost: the robot counts it, or goes on from something else.
  bool was_lost() const noexcept {
    const double rate = newest.control_command_success_rate;
    if (rate >= 1.0 || !sent) {
      return false;
    }
    if (rate < before.control_command_success_rate - rate_rounding) {
      return true;
    }
    double most = 0.0;
    for (std::size_t j = 0; j < 7; ++j) {
      const double v = output == Output::position ? ((*sent)[j] - before.q_d[j]) / franka_cycle : (*sent)[j];
      most = std::max(most, output == Output::torque ? std::abs(newest.tau_J_d[j] - (*sent)[j])
                                                     : std::abs((v - before.dq_d[j]) / franka_cycle - newest.ddq_d[j]));
    }
    return most > (output == Output::torque ? torque_rounding : acceleration_rounding);
  }

  // Reads states until one may be answered; cycles that the robot went on without a command.
  int read() {
    const bool in_flight = sent.has_value();
    Received got = receive();
    int lost = first ? 0 : got.passed - (in_flight ? 1 : 0);
    bool unsure = in_flight;
    while (control && (!got.fresh || (unsure && (got.passed > 1 || was_lost())))) {
      got = receive();
      lost += got.passed;
      unsure = false;
    }
    first = false;
    before = newest;
    sent.reset();
    return std::max(0, lost);
  }

  void write(const Command& command) {
    told_position =
        joint_vector(output == Output::velocity ? before.q : before.q_d);  // a sum of velocities is not where the arm is
    told_velocity = joint_vector(before.dq_d);
    told_acceleration = joint_vector(before.ddq_d);
    const StreamLimiter::Motion told{told_position, told_velocity, told_acceleration};
    const StreamLimiter::Motion wanted{command.position, command.velocity, command.acceleration};
    if (output == Output::torque) {
      told_position = joint_vector(before.tau_J_d);
      sent = joint_array(limiter.limit_torques(told_position, command.torque_without_gravity));
      control->writeOnce(franka::Torques(*sent));
    } else if (output == Output::velocity) {
      sent = joint_array(limiter.limit_velocities(told, wanted));
      control->writeOnce(franka::JointVelocities(*sent));
    } else {
      sent = joint_array(limiter.limit_positions(told, wanted));
      control->writeOnce(franka::JointPositions(*sent));
    }
  }

  // Ends a motion that rests, or has the robot brake.
  void stop() {
    const auto ended = std::move(control);
    const franka::RobotState state = ended->readOnce().first;
    if (joint_vector(state.dq).cwiseAbs().maxCoeff() >= resting_speed) {
      robot.stop();
    } else if (output == Output::torque) {
      ended->writeOnce(franka::MotionFinished(franka::Torques(state.tau_J_d)));
    } else if (output == Output::velocity) {
      ended->writeOnce(franka::MotionFinished(franka::JointVelocities(Joints{})));
    } else {
      ended->writeOnce(franka::MotionFinished(franka::JointPositions(state.q_d)));
    }
  }

  // Calls libfranka; what it throws becomes a result and words.
  template <class Call>
  DriverResult guarded(Call&& call) noexcept {
    DriverResult result = DriverResult::ok;
    try {
      return call();
    } catch (const franka::ControlException& error) {
      result = DriverResult::stopped;
      say(error.what());
    } catch (const franka::CommandException& error) {
      result = DriverResult::stopped;
      say(error.what());
    } catch (const std::exception& error) {
      result = DriverResult::lost;
      say(error.what());
    }
    control.reset();
    return result;
  }

  void say(const char* what) noexcept {
    try {
      const std::lock_guard lock(words);
      trouble = what;
    } catch (...) {  // out of memory: without words
    }
  }

  const RobotDescription description = franka_description();
  franka::Robot robot;
  std::unique_ptr<franka::ActiveControlBase> control;
  StreamLimiter limiter{franka_limits(), franka_cycle};
  Output output = Output::torque;
  franka::RobotState newest, before;  // the latter: of the last `read`
  std::optional<Joints> sent;         // the answer to it
  bool first = true;
  double arrived = 0.0;  // when it came [s]
  int late = 0;
  Eigen::VectorXd told_position = Eigen::VectorXd::Zero(7), told_velocity = told_position, told_acceleration = told_position;
  mutable std::mutex words;
  std::string trouble;
};

FrankaDriver::FrankaDriver(const std::string& address, bool enforce_real_time)
    : impl_(std::make_unique<Impl>(address, enforce_real_time)) {}
FrankaDriver::~FrankaDriver() { stop(); }

const RobotDescription& FrankaDriver::description() const noexcept { return impl_->description; }

void FrankaDriver::start(Output output) {
  using Mode = research_interface::robot::Move::ControllerMode;
  const franka::RobotState state = impl_->robot.readOnce();
  if (state.robot_mode != franka::RobotMode::kIdle) {
    throw std::runtime_error("franka: the robot cannot be moved: it is in mode " +
                             std::to_string(static_cast<int>(state.robot_mode)) + "; recover() ends a reflex");
  }
  if (output == Output::torque) {
    impl_->control = impl_->robot.startTorqueControl();
  } else if (output == Output::velocity) {
    impl_->control = impl_->robot.startJointVelocityControl(Mode::kJointImpedance);
  } else if (output == Output::position) {
    impl_->control = impl_->robot.startJointPositionControl(Mode::kJointImpedance);
  } else {
    throw std::invalid_argument("franka: output is acceleration, allowed: torque, velocity or position");
  }
  impl_->output = output;
  impl_->first = true;
  impl_->sent.reset();
  impl_->limiter.begin(joint_vector(state.q_d), joint_vector(state.tau_J_d));
}

DriverResult FrankaDriver::read(RobotState& state, double) noexcept {
  return impl_->guarded([&] {
    state.lost_cycles = impl_->read();
    const franka::RobotState& now = impl_->before;
    state.time = impl_->arrived;
    state.q = joint_vector(now.q);
    state.v = joint_vector(now.dq);
    state.torque = joint_vector(now.tau_J);
    if (impl_->control && impl_->output != Output::torque) {
      if (impl_->output == Output::position) {
        state.told_position = joint_vector(now.q_d);
      }
      state.told_velocity = joint_vector(now.dq_d);
      state.told_acceleration = joint_vector(now.ddq_d);
    }
    return DriverResult::ok;
  });
}

DriverResult FrankaDriver::write(const Command& command) noexcept {
  return impl_->guarded([&] {
    if (!impl_->control) {
      impl_->say("the robot is not controlled: start() begins");
      return DriverResult::stopped;
    }
    if (franka_now() - impl_->arrived > answer_share * franka_cycle) {
      ++impl_->late;  // it goes on by itself; a late answer would be taken for one to its next state
      return DriverResult::ok;
    }
    impl_->write(command);
    return DriverResult::ok;
  });
}

void FrankaDriver::stop() noexcept {
  if (impl_->control) {
    impl_->guarded([&] {
      impl_->stop();
      return DriverResult::ok;
    });
  }
}

std::string FrankaDriver::trouble() const {
  const std::lock_guard lock(impl_->words);
  return impl_->trouble;
}

void FrankaDriver::recover() { impl_->robot.automaticErrorRecovery(); }
int FrankaDriver::late() const noexcept { return impl_->late; }

}  // namespace sidestep

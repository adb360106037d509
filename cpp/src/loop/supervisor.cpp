#include "sidestep/loop/supervisor.hpp"

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <new>
#include <stdexcept>
#include <system_error>
#include <thread>

#include "real_time_thread.hpp"
#include "supervised_memory.hpp"

#if defined(__unix__) || defined(__APPLE__)
#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#endif
#ifdef __linux__
#include <linux/futex.h>
#include <sys/syscall.h>
#include <ctime>
#endif

namespace sidestep {
namespace {

constexpr double answer_patience = 3e-4;  // Longest wait for the answer to a report [s].
constexpr double look_period = 2e-3;      // Time between two looks of a supervisor that nobody wakes [s].
constexpr double clock_drift = 1e-3;      // Largest difference in speed of the robot's clock and the machine's [-].
constexpr double start_pause = 5e-3;      // Time between two looks for its first sign of life [s].
constexpr int supervisor_priority = 70;   // Above the loop's, which waits for it.

[[noreturn]] void fail(const std::string& what) {
  throw std::system_error(errno != 0 ? errno : EIO, std::generic_category(), what);
}

void unmap([[maybe_unused]] SupervisedMemory* memory) {
#if defined(__unix__) || defined(__APPLE__)
  munmap(memory, sizeof(SupervisedMemory));
#endif
}

/// Maps a file, and closes it; null: that was refused.
SupervisedMemory* map_file([[maybe_unused]] int file) {
#if defined(__unix__) || defined(__APPLE__)
  void* const at = mmap(nullptr, sizeof(SupervisedMemory), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  const int refused = errno;
  close(file);
  errno = refused;
  return at == MAP_FAILED ? nullptr : static_cast<SupervisedMemory*>(at);
#else
  return nullptr;
#endif
}

/// A new file in memory that only this user may open.
SupervisedMemory* make_memory([[maybe_unused]] std::string& path) {
#if defined(__unix__) || defined(__APPLE__)
  path = std::string(access("/dev/shm", W_OK) == 0 ? "/dev/shm" : "/tmp") + "/sidestep-supervisor-XXXXXX";
  const int file = mkstemp(path.data());
  const std::string words = "supervisor: cannot make memory for two processes at '" + path + "'";
  if (file < 0) {
    fail(words);
  }
  const bool is_sized = ftruncate(file, sizeof(SupervisedMemory)) == 0;
  SupervisedMemory* const memory = map_file(file);
  if (!is_sized || memory == nullptr) {
    const int refused = errno;
    if (memory != nullptr) {
      unmap(memory);
    }
    unlink(path.c_str());
    errno = refused;
    fail(words);
  }
  return new (memory) SupervisedMemory;
#else
  throw std::runtime_error("supervisor: this system has no memory that two processes share by files");
#endif
}

/// Whether a process still runs; its child sees it end although nobody has waited for it yet.
class WatchedProcess {
 public:
  explicit WatchedProcess([[maybe_unused]] std::int32_t process) {
#if defined(__unix__) || defined(__APPLE__)
    process_ = process;
    is_parent_ = getppid() == process;
#endif
  }
  bool is_alive() const noexcept {
#if defined(__unix__) || defined(__APPLE__)
    return is_parent_ ? getppid() == process_ : kill(process_, 0) == 0 || errno == EPERM;
#else
    return true;
#endif
  }

 private:
  std::int32_t process_ = 0;
  bool is_parent_ = false;
};

JointLimits limits_of(const SupervisedMemory& memory) {
  const auto numbers = [&](const CycleReport::Numbers& all) {
    return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(all.data(), memory.joints));
  };
  JointLimits limits;
  limits.lower = numbers(memory.lower);
  limits.upper = numbers(memory.upper);
  limits.velocity = numbers(memory.velocity);
  limits.effort = numbers(memory.effort);
  limits.effort_rate = numbers(memory.effort_rate);
  return limits;
}

}  // namespace

void wait_for_change(std::atomic<std::uint32_t>& number, std::uint32_t seen, double timeout) noexcept {
#ifdef __linux__
  const auto whole = static_cast<std::time_t>(timeout);
  const timespec time{whole, static_cast<long>((timeout - static_cast<double>(whole)) * 1e9)};
  if (number.load(std::memory_order_acquire) == seen) {
    syscall(SYS_futex, reinterpret_cast<std::uint32_t*>(&number), FUTEX_WAIT, seen, &time, nullptr, 0);
  }
#else
  const double until = monotonic_time() + timeout;
  while (number.load(std::memory_order_acquire) == seen && monotonic_time() < until) {
    std::this_thread::sleep_for(std::chrono::microseconds(50));
  }
#endif
}

void wake([[maybe_unused]] std::atomic<std::uint32_t>& number) noexcept {
#ifdef __linux__
  syscall(SYS_futex, reinterpret_cast<std::uint32_t*>(&number), FUTEX_WAKE, 1, nullptr, nullptr, 0);
#endif
}

SupervisorLink::SupervisorLink(const Robot& arm, ControllerSettings::Output output, double period,
                               const SupervisorSettings& settings)
    : joints_(arm.coordinate_names()),
      settings_((static_cast<void>(SupervisorRules(arm.limits(), period, settings)), settings)),
      memory_(make_memory(path_), unmap),
      writes_torque_(output == ControllerSettings::Output::torque),
      writes_position_(output == ControllerSettings::Output::position) {
  SupervisedMemory& memory = *memory_;
#if defined(__unix__) || defined(__APPLE__)
  memory.loop_process = static_cast<std::int32_t>(getpid());
#endif
  memory.joints = arm.num_coordinates();
  memory.period = period;
  memory.settings = settings;
  const JointLimits& limits = arm.limits();
  for (int j = 0; j < memory.joints; ++j) {
    const auto k = static_cast<std::size_t>(j);
    memory.lower[k] = limits.lower[j];
    memory.upper[k] = limits.upper[j];
    memory.velocity[k] = limits.velocity[j];
    memory.effort[k] = limits.effort[j];
    memory.effort_rate[k] = limits.effort_rate.size() == 0 ? std::numeric_limits<double>::infinity() : limits.effort_rate[j];
  }
}

SupervisorLink::~SupervisorLink() {
#if defined(__unix__) || defined(__APPLE__)
  unlink(path_.c_str());
#endif
}

bool SupervisorLink::wait_for_supervisor(double timeout) const noexcept {
  const double until = monotonic_time() + timeout;
  while (monotonic_time() < until) {
    if (monotonic_time() - verdict().now < settings_.approval_age) {
      return true;
    }
    sleep_until(monotonic_time() + start_pause);
  }
  return false;
}

void SupervisorLink::observe(const RobotState& state, const Command& command, double now) noexcept {
  CycleReport report;
  report.cycle = ++cycle_;
  report.now = now;
  report.is_blind = state.is_lost;
  report.state_age = state.is_lost ? 0.0 : state_age(now, state.time);
  report.stale = command.activity == Activity::stale;
  report.writes_torque = writes_torque_;
  report.writes_position = writes_position_;
  const auto joints = static_cast<std::size_t>(memory_->joints);
  const bool fits = state.q.size() == memory_->joints && command.position.size() == memory_->joints;
  for (std::size_t k = 0; k < joints; ++k) {
    const auto j = static_cast<Eigen::Index>(k);
    if (!fits) {  // another arm's: denied
      report.q[k] = std::numeric_limits<double>::quiet_NaN();
      continue;
    }
    report.q[k] = state.q[j];
    report.v[k] = state.v[j];
    report.position[k] = command.position[j];
    report.velocity[k] = command.velocity[j];
    report.torque[k] = command.torque[j];
  }
  memory_->reports.write(report);
  wake(memory_->reports.number());
}

double SupervisorLink::state_age(double now, double measured) noexcept {
  const double behind = now - measured;
  // A robot's clock has an offset, and drifts: the freshest state of late has no age.
  const double least = least_behind_ + clock_drift * (now - last_now_);
  least_behind_ = behind < least || std::isnan(least) ? behind : least;
  last_now_ = now;
  return behind - least_behind_;
}

bool SupervisorLink::approves() noexcept {
  std::atomic<std::uint32_t>& answers = memory_->verdicts.number();
  const double asked = monotonic_time();
  std::uint32_t seen = answers.load(std::memory_order_acquire);
  last_ = verdict();
  while (last_.cycle != cycle_ && monotonic_time() - asked < answer_patience) {
    wait_for_change(answers, seen, answer_patience - (monotonic_time() - asked));
    seen = answers.load(std::memory_order_acquire);
    last_ = verdict();
  }
  if (const double age = monotonic_time() - last_.now; age > settings_.approval_age && last_.approves()) {
    last_.denial = Denial::silent_supervisor;
    last_.joint = -1;
    last_.value = age;
    last_.limit = settings_.approval_age;
  }
  return last_.approves();
}

std::string SupervisorLink::why() const { return last_.words(joints_); }

Verdict SupervisorLink::verdict() const noexcept {
  Verdict newest;
  memory_->verdicts.read(newest);
  return newest;
}

void SupervisorLink::end() noexcept {
  CycleReport report;
  report.now = monotonic_time();
  report.is_over = true;
  memory_->reports.write(report);
  wake(memory_->reports.number());
  least_behind_ = std::numeric_limits<double>::quiet_NaN();  // the next run may be of another robot's clock
}

void SupervisorLink::reset() noexcept {
  least_behind_ = std::numeric_limits<double>::quiet_NaN();
  memory_->resets.fetch_add(1, std::memory_order_release);
  wake(memory_->reports.number());
}

void supervise([[maybe_unused]] const std::string& path, [[maybe_unused]] const std::function<bool()>& ends) {
#if defined(__unix__) || defined(__APPLE__)
  errno = 0;
  const int file = open(path.c_str(), O_RDWR | O_CLOEXEC);
  struct stat about{};
  if (file < 0 || fstat(file, &about) != 0) {
    fail("supervisor: cannot open '" + path + "'");
  }
  if (about.st_size != static_cast<off_t>(sizeof(SupervisedMemory))) {
    close(file);
    throw std::runtime_error("supervisor: '" + path + "' is not the memory of a loop of this version");
  }
  const std::unique_ptr<SupervisedMemory, void (*)(SupervisedMemory*)> memory(map_file(file), unmap);
  if (memory == nullptr) {
    fail("supervisor: cannot map '" + path + "'");
  }
  if (memory->kind != SupervisedMemory::magic || memory->size != sizeof(SupervisedMemory)) {
    throw std::runtime_error("supervisor: '" + path + "' is not the memory of a loop of this version");
  }
  SupervisorRules rules(limits_of(*memory), memory->period, memory->settings);
  static_cast<void>(lock_memory());
  static_cast<void>(ask_for_real_time(supervisor_priority));
  const WatchedProcess loop(memory->loop_process);
  // What was reported to another supervisor before this one is over.
  std::uint32_t seen = memory->reports.number().load(std::memory_order_acquire), resets = memory->resets.load();
  while (!ends() && loop.is_alive()) {
    wait_for_change(memory->reports.number(), seen, look_period);
    if (const std::uint32_t now = memory->resets.load(std::memory_order_acquire); now != resets) {
      resets = now;
      rules.reset();
    }
    const std::uint32_t number = memory->reports.number().load(std::memory_order_acquire);
    CycleReport report;
    const bool is_new = number != seen && memory->reports.read(report);
    seen = number;
    memory->verdicts.write(is_new ? rules.judge(report) : rules.wait(monotonic_time()));
    wake(memory->verdicts.number());
  }
  if (!loop.is_alive()) {  // it could not remove it itself
    unlink(path.c_str());
  }
#else
  throw std::runtime_error("supervisor: this system has no memory that two processes share by files");
#endif
}

}  // namespace sidestep

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace sidestep::link {

/// Commands that were sent and move the robot later: a connection that is late has some on their way. Where the robot is when the next one
/// arrives follows from its state and from those. Allocates nothing after construction.
///
/// Commands have sequence numbers, states the cycles of the robot; a command answers the state of a cycle.
class CommandsInFlight {
 public:
  static constexpr std::size_t most = 128;  ///< older ones are forgotten: robots stop by themselves after fewer lost cycles

  /// num_joints: nv. period: of a cycle [s].
  CommandsInFlight(Eigen::Index num_joints, double period);

  /// Nothing was sent yet.
  void clear() noexcept;
  /// A command was sent that answers the state of `cycle` and has the robot accelerate by `acceleration` (nv) [rad/s² | m/s²].
  void sent(std::uint64_t sequence, std::uint64_t cycle, const Eigen::VectorXd& acceleration) noexcept;
  /// A state says that the newest command that moves the robot is `sequence`, since `cycle`.
  void taken(std::uint64_t sequence, std::uint64_t cycle) noexcept;
  /// Moves q, v (nv) of the state of `cycle` on to the cycle in which a command that is sent now arrives, by the accelerations of the
  /// commands that move the robot meanwhile: v += a T, q += v T. Returns the number of cycles: 0 over a connection without delay.
  int predict(std::uint64_t cycle, Eigen::VectorXd& q, Eigen::VectorXd& v) const noexcept;
  /// Time from a state to the cycle in which its command moves the robot, filtered [cycles].
  double delay() const noexcept { return delay_; }

 private:
  struct Sent {
    std::uint64_t sequence = 0, cycle = 0;
    Eigen::VectorXd acceleration;
  };
  const Sent& at(std::size_t k) const noexcept { return ring_[(begin_ + k) % most]; }

  double period_;
  std::array<Sent, most> ring_;
  std::size_t begin_ = 0, count_ = 0;  // The oldest moves the robot, as far as is known.
  double delay_ = 0.0;
  bool has_delay_ = false;
  std::uint64_t last_sequence_ = 0;  // of the newest command that was taken
};

}  // namespace sidestep::link

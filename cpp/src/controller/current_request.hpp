#pragma once

#include <cstdint>

#include "request.hpp"
#include "sidestep/math/triple_buffer.hpp"

namespace sidestep {

/// The request that the step follows, and for how long.
class CurrentRequest {
 public:
  /// `handed_over`: where other threads put requests; read by `update` alone.
  explicit CurrentRequest(TripleBuffer<NumberedRequest>& handed_over) : buffer_(handed_over) {}

  /// Takes over the newest request: true where it is another one. Otherwise its age, and the place of a goal that moves, go on by the
  /// time that has elapsed [s].
  bool update(double elapsed) noexcept;
  /// A velocity, twist or trajectory has begun.
  void begun() noexcept { begins_input_ = false; }
  /// The input has led to where a goal at rest takes its place.
  void stand() noexcept { moves_ = false; }
  /// Goes on where the request of another arm stopped: one with the same number keeps what following it has made of it.
  void go_on_from(CurrentRequest& before) noexcept;

  const Request& request() const noexcept { return buffer_.current().request; }
  Request& request() noexcept { return buffer_.current().request; }
  std::uint64_t number() const noexcept { return number_; }
  std::uint64_t handed_over() const noexcept { return buffer_.current().number; }
  double age() const noexcept { return age_; }                     ///< [s]
  bool is_any() const noexcept { return request().index() != 0; }  ///< a goal or an input
  bool moves() const noexcept { return moves_; }                   ///< it is a goal that moves, or an input
  bool begins_input() const noexcept { return begins_input_; }     ///< an input that has not begun
  /// The goal that was set; null where it is an input.
  Goal* goal() noexcept { return std::get_if<Goal>(&request()); }
  const Goal* goal() const noexcept { return std::get_if<Goal>(&request()); }
  const PoseGoal* pose_goal() const noexcept { return goal() == nullptr ? nullptr : std::get_if<PoseGoal>(goal()); }
  const TrajectoryRequest* trajectory() const noexcept { return std::get_if<TrajectoryRequest>(&request()); }
  const TwistRequest* twist() const noexcept { return std::get_if<TwistRequest>(&request()); }
  /// A velocity, twist or trajectory, while no goal has taken its place.
  bool has_input() const noexcept { return is_any() && goal() == nullptr && moves_; }
  bool keeps_path() const noexcept {
    return trajectory() != nullptr && trajectory()->behaviour == TrajectoryBehaviour::keep_path;
  }

 private:
  TripleBuffer<NumberedRequest>& buffer_;
  std::uint64_t number_ = 0;
  double age_ = 0.0;
  bool moves_ = false, begins_input_ = false;
};

}  // namespace sidestep

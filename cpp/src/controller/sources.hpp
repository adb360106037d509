#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "closing_estimate.hpp"
#include "sidestep/clearance/clearance_query.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/controller/source.hpp"
#include "sidestep/math/triple_buffer.hpp"
#include "tick.hpp"
#include "world.hpp"

namespace sidestep {

/// Stage `sources`: every source of obstacles where it is now, by its age and velocities, told or found.
///
/// The points of a source are moved from the time of their capture to now, but not beyond the age up to which it is valid: from then
/// on it is overdue, they stand still, and their reach grows by the largest unknown speed × time.
class Sources {
 public:
  /// `handed_over`: where other threads put obstacles; read by `update` alone.
  Sources(TripleBuffer<World>& handed_over, const ClearanceQuery& body, const Robot& robot, const Body& ellipsoids,
          const ControllerSettings& settings);

  /// Moves the obstacles on, or takes those that were set since. True where they are others. The arm is at q.
  bool update(const Eigen::VectorXd& q, const Tick& tick) noexcept;
  /// Whether anything that moves is near the reference at q, or could be within a second.
  bool look_for_movers(const Eigen::VectorXd& q) noexcept;
  /// Goes on where the sources of another body of the same joints stopped: newer obstacles have not moved yet.
  void go_on_from(Sources& before) noexcept;

  const Obstacles& obstacles() const noexcept { return buffer_.current().obstacles; }
  /// The sources of these obstacles: source k is part k of them.
  const std::vector<SourceSet>& sources() const noexcept { return buffer_.current().sources; }
  /// Number of the obstacles in use, 0: none were set; and of those that were handed over.
  std::uint64_t number() const noexcept { return number_; }
  std::uint64_t handed_over() const noexcept { return buffer_.current().number; }
  /// How they have moved since they were given.
  const WorldMotion& motion() const noexcept { return motion_; }
  /// A source is overdue, or none was ever set: nothing is known to be free.
  bool is_stale() const noexcept { return overdue_ >= 0 || number_ == 0; }
  bool has_movers() const noexcept { return has_movers_; }
  const ClosingEstimate& closing() const noexcept { return closing_; }
  /// What is believed of each source.
  std::vector<SourceState> states() const;
  /// Why nothing is believed, as the end of "stopped: ..."; empty where all is.
  std::string explain() const;

 private:
  /// What the steps know of a source.
  struct Known {
    std::uint64_t id = 0, number = 0, heard_number = 0;
    double time = 0.0, heard = 0.0;  // when its points and its newest set were captured [s]
    double ahead = 0.0;              // how far that was in the future when it was taken [s]
    double emptied_at = 0.0;         // [s]
    bool emptied = false, uncertain = false;
  };

  void adopt(const Tick& tick) noexcept;
  /// Moves the points of all sources on by the time of a step.
  void advance(World& world, const Tick& tick) noexcept;
  /// Moves the points of source k on, for `most` [s] at most: beyond that they stand still.
  void move(World& world, std::size_t k, double duration, double most) noexcept;
  /// Believes what has been empty for long enough; true where there is such a source.
  bool believe_empty(double time) noexcept;
  void judge_ages() noexcept;
  double age(std::size_t k) const noexcept;
  /// Whether source k is expected.
  bool has_not_come(std::size_t k) const noexcept;

  const ClearanceQuery& body_;
  ClearanceQuery::Workspace workspace_;
  const ControllerSettings& settings_;
  TripleBuffer<World>& buffer_;
  ClosingEstimate closing_;  // beyond the velocities that obstacles were told with
  std::uint64_t number_ = 0;
  double time_ = 0.0;  // [s]
  std::array<Known, most_sources> known_;
  std::size_t num_known_ = 0;
  WorldMotion motion_;
  int overdue_ = -1;  // The source that is overdue for longest; -1: none.
  bool has_movers_ = false;
};

}  // namespace sidestep

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "closing_estimate.hpp"
#include "request.hpp"
#include "sidestep/clearance/clearance_query.hpp"
#include "sidestep/controller/settings.hpp"
#include "sidestep/math/triple_buffer.hpp"

namespace sidestep {

/// Stage `sources`: the obstacles where they are now, by their age and velocities, told or found.
class Sources {
 public:
  /// `handed_over`: where other threads put obstacles; read by `update` alone.
  Sources(TripleBuffer<NumberedObstacles>& handed_over, const ClearanceQuery& body, const Robot& robot, const Body& ellipsoids,
          const ControllerSettings& settings);

  /// Moves the obstacles on by a period, or takes those that were set since. True where they are others. The arm is at q.
  bool update(const Eigen::VectorXd& q, double time) noexcept;
  /// Whether anything that moves is near the reference at q, or could be within a second.
  bool look_for_movers(const Eigen::VectorXd& q) noexcept;
  /// Goes on where the sources of another body of the same joints stopped: newer obstacles have not moved yet.
  void go_on_from(Sources& before) noexcept;

  const Obstacles& obstacles() const noexcept { return buffer_.current().obstacles; }
  /// Number of the obstacles in use, 0: none were set; and of those that were handed over.
  std::uint64_t number() const noexcept { return number_; }
  std::uint64_t handed_over() const noexcept { return buffer_.current().number; }
  double age() const noexcept { return age_; }  ///< [s] since they were set
  /// Too old. Also where a timeout was set and obstacles never were: nothing is known to be free.
  bool is_stale() const noexcept;
  bool has_movers() const noexcept { return has_movers_; }
  const ClosingEstimate& closing() const noexcept { return closing_; }

 private:
  const ClearanceQuery& body_;
  ClearanceQuery::Workspace workspace_;
  const ControllerSettings& settings_;
  TripleBuffer<NumberedObstacles>& buffer_;
  ClosingEstimate closing_;  // beyond the velocities that obstacles were told with
  std::uint64_t number_ = 0;
  double age_ = 0.0;
  bool has_movers_ = false;
};

}  // namespace sidestep

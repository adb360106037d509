#pragma once

#include <Eigen/Core>
#include <vector>

#include "input_target.hpp"
#include "twist_solver.hpp"
#include "velocity_bounds.hpp"

namespace sidestep {

/// What following a velocity or twist remembers from one step to the next, whatever body the arm has.
struct VelocityMemory {
  explicit VelocityMemory(Eigen::Index nv);

  Eigen::VectorXd wanted, last_wanted;  // after bounds
  bool has_last_wanted = false;
  Eigen::VectorXd response;  // acceleration with which the reference goes to the wanted velocity
  Eigen::VectorXd ideal;     // velocity of an arm that responds to the wanted velocity and meets no limit
  bool has_ideal = false;
  Reduction reduction;
  double missed_for = 0.0;  // time for which the reference has been off `ideal` [s]
  bool is_bent = false;     // barriers keep it off that now
};

/// Follows a velocity or a twist with the response time of the settings: q̈ = k (v_w − q̇), v_w within bounds.
class VelocityFollower : private VelocityMemory {
 public:
  VelocityFollower(const Robot& robot, const JointKinds& joints, const ControllerSettings& settings, const UsableLimits& usable,
                   const std::vector<Eigen::Index>& clearances);

  /// A request begins; of a twist after a twist, what the arm's motion changes in it is followed without a lag.
  void begin(const Request& request, const NearReference& near) noexcept;
  /// Writes to `target` what the request asks of the reference. An old request (`fresh` false) asks for rest.
  /// `pace`: share of the velocity, in [0, 1].
  void follow(const Request& request, bool fresh, double pace, const Reference& reference, const NearReference& near,
              const Tick& tick, InputTarget& target) noexcept;
  /// Something else is followed from now on.
  void end() noexcept { has_last_wanted = false; }
  /// The motion begins anew.
  void begin_anew() noexcept { has_last_wanted = has_ideal = false; }
  /// Nothing is followed: nothing is missed.
  void rest() noexcept {
    has_ideal = is_bent = false;
    missed_for = 0.0;
  }
  /// Judges the reference's next velocity, whose acceleration barriers make `wanted_acceleration`: true where less is done than
  /// asked.
  bool judge(const Request& request, const Reference& reference, const Eigen::VectorXd& wanted_acceleration,
             const Tick& tick) noexcept;
  /// Solves a twist that was not followed in this step, to compare with it.
  void solve_again(const TwistRequest& twist, const Reference& reference, const NearReference& near) noexcept;
  /// Writes what is changed of the request, see Command::input_change.
  void write_change(const Request& request, const Eigen::VectorXd& next_v, Eigen::VectorXd& change) const noexcept;
  void go_on_from(const VelocityFollower& before) noexcept;

  /// Whether that is the velocity or twist that was asked for, within its tolerance.
  bool follows(const Request& request, const Eigen::VectorXd& v) const noexcept;
  const Eigen::VectorXd& wanted_velocity() const noexcept { return wanted; }
  const Reduction& what_reduces() const noexcept { return reduction; }
  const VelocityBounds::First& first_held() const noexcept { return bounds_.first(); }
  bool bends() const noexcept { return is_bent; }
  /// Whether the response has had its time and the reference is still off.
  bool misses_for_long() const noexcept;
  bool misses() const noexcept { return missed_for > 0.0; }
  const TwistSolver& twist() const noexcept { return twist_; }

 private:
  /// Writes with which acceleration v goes to the wanted velocity.
  void respond(const Eigen::VectorXd& v, const Tick& tick) noexcept;
  /// Whether that change of velocity is more than a share of the tolerance of what was asked for.
  bool differs(const Request& request, const Eigen::VectorXd& change, double share) const noexcept;

  const JointKinds& joints_;
  const JointLimits& limits_;
  const ControllerSettings& settings_;
  const UsableLimits& usable_;
  VelocityBounds bounds_;
  TwistSolver twist_;
  Eigen::VectorXd asked_, off_;
};

}  // namespace sidestep

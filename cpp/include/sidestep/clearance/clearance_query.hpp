#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "sidestep/clearance/clearance_items.hpp"
#include "sidestep/clearance/distance_field.hpp"
#include "sidestep/clearance/margins.hpp"
#include "sidestep/robot/robot.hpp"
#include "sidestep/scene/obstacles.hpp"

namespace sidestep {

/// How near an arm is to all that it must keep apart from, see ClearanceItems, in three forms:
///
///   nearest           at a configuration, by positions alone: `nearest`, `clearances`, `distance_left`, `free`;
///   along an edge     everywhere between two configurations: `edge_free`;
///   with derivatives  at a state, for barriers: ClearanceGroup::evaluate of a group of `items()`.
///
/// The first two agree with the third but for the clearance of obstacles, which is the distance of their balls from the ellipsoids,
/// signed, by two steps of Newton towards the nearest place: a lower bound, as a supporting plane gives it.
///
/// An edge is judged without gaps (Schwarzer, Saha and Latombe 2005): a share s of it moves no point of an item farther
/// than
///
///     motion(s Δq) = s Σ_i |Δq_i| R_i      and      s v + s²/2 Σ_i Σ_j |Δq_i| |Δq_j| R_max(i, j),
///
/// R_i the largest distance that the item can have from the axis of joint i and v the speed of its fastest point where
/// the motion begins, |∂²x/∂q_i∂q_j| ≤ R_j of the later joint; of a table it is the first, with the steepest slopes for R;
/// of what a joint holds both, with its slope along the edge for v and bounds of the derivatives. An interval of an edge is
/// free as far around its middle as the clearance there exceeds the smaller of the two; what is left to either side is
/// checked in the same way.
class ClearanceQuery {
 public:
  explicit ClearanceQuery(std::shared_ptr<const ClearanceItems> items);
  /// Of items of its own, see ClearanceItems.
  ClearanceQuery(Robot robot, const Body& body, const std::vector<LinkPair>& pairs = {},
                 const std::vector<KeptPlane>& planes = {}, std::vector<PairDistanceTable> tables = {},
                 std::optional<GravityTorqueLimit> gravity_torque = std::nullopt)
      : ClearanceQuery(std::make_shared<const ClearanceItems>(std::move(robot), body, pairs, planes, std::move(tables),
                                                              std::move(gravity_torque))) {}

  const Robot& robot() const noexcept { return items_->robot(); }
  const ClearanceItems& items() const noexcept { return *items_; }
  int num_items() const noexcept { return items_->size(); }
  /// What an item is: kind, link, and the other link.
  const CoordinateLabel& label(int item) const noexcept { return (*items_)[item].label; }

  /// What changes in a query; one per thread.
  class Workspace {
   public:
    explicit Workspace(const ClearanceQuery& body);

    /// How many clearances of single items were asked for: the work done, the same on every machine.
    std::int64_t checks() const noexcept { return checks_; }
    /// Begins anew, so that what is asked for next takes the same work whatever was before.
    void reset() noexcept {
      checks_ = 0;
      last_ = 0;
    }

   private:
    friend class ClearanceQuery;
    struct Pose {
      Eigen::Matrix3d R;
      Eigen::Vector3d p;
      Eigen::Vector3d angular, linear;  // Velocities along an edge, angular and of p.
    };
    struct Interval {
      double middle, half;
    };
    static constexpr std::size_t most_intervals = 4096;  // Most intervals of an edge: 2 m of motion divided down to 1 mm.
    std::vector<Pose> poses_;
    std::vector<Eigen::Vector3d> centres_;  // Centres of the balls around the links.
    std::vector<Interval> intervals_;
    std::vector<std::uint64_t> open_;       // Items still undecided on an interval, one bit each: `words()` of each interval.
    Eigen::VectorXd motions_, curvatures_;  // Motions and curvatures of the items along an edge.
    Eigen::VectorXd lengths_, products_;    // |Δq_i|, |Δq_i| |Δq_j|
    DistanceField field_;
    std::vector<double> bounds_;  // Bounds of the ellipsoids of a link.
    Eigen::VectorXd q_, difference_;
    Eigen::VectorXd placed_;  // Configuration of the placed body.
    KinematicState state_;    // there, once it is asked for
    Eigen::VectorXd rest_, gradient_;
    bool state_is_old_ = true;
    std::int64_t checks_ = 0;
    int last_ = 0;  // Item that was in the way last: it is checked first.
  };

  /// The smallest clearance of all items, not above `cap` [m].
  struct Nearest {
    double clearance;
    int item = -1;   ///< Index of the item; -1: all are as far as `cap`.
    int point = -1;  ///< Index of the obstacle point, for an item of obstacles.
  };
  Nearest nearest(ConstVectorRef q, const Obstacles& obstacles, double cap, Workspace& w) const noexcept;

  /// The same of one item.
  Nearest nearest(int item, ConstVectorRef q, const Obstacles& obstacles, double cap, Workspace& w) const noexcept;

  /// The same of the obstacles alone, without planes and pairs.
  Nearest nearest_obstacle(ConstVectorRef q, const Obstacles& obstacles, double cap, Workspace& w) const noexcept;

  /// The clearance of every item, not above `cap` [m], into out (num_items).
  void clearances(ConstVectorRef q, const Obstacles& obstacles, double cap, Workspace& w,
                  Eigen::Ref<Eigen::VectorXd> out) const noexcept;

  /// The least of what the clearances have beyond `floors` (num_items), not above `cap` [m]; where it is more than `near`, a lower
  /// bound. Any of what joints hold counts as far. Ends below zero.
  double distance_left(ConstVectorRef q, const Obstacles& obstacles, const Eigen::VectorXd& floors, double near, double cap,
                       Workspace& w) const noexcept;

  /// How near an obstacle that moves is, or could be after `time` [s] at its speed: a lower bound [m], as by balls
  /// around the links; infinity where all are at rest.
  double nearest_moving(ConstVectorRef q, const Obstacles& obstacles, double time, Workspace& w) const noexcept;

  /// What `margins` ask of an item away from the ends [m].
  double margin(int item, const Margins& margins) const noexcept {
    const ClearanceItem& of = (*items_)[item];
    return of.is_own() ? std::min({margins.pair_margin, margins.margin, of.most_margin}) : margins.margin;
  }

  /// What `margins` give an item between the configurations that are looked at [m].
  double slack(int item, const Margins& margins) const noexcept {
    return std::min(margins.slack, 0.5 * (*items_)[item].most_margin);
  }

  /// Whether every item keeps its margin at q. Ends at the first that does not.
  bool free(ConstVectorRef q, const Obstacles& obstacles, const Margins& margins, Workspace& w) const noexcept;

  /// Whether every item keeps its margin, less the slack, everywhere on the straight edge from a to b.
  bool edge_free(ConstVectorRef a, ConstVectorRef b, const Obstacles& obstacles, const Margins& margins,
                 Workspace& w) const noexcept;

  /// How far a point of `item` can move, relative to what it keeps off, for a displacement of the joints [m].
  double motion(int item, ConstVectorRef displacement) const noexcept {
    return (*items_)[item].reach.dot(displacement.cwiseAbs());
  }

  /// The same from q on, by the smaller of the two bounds.
  double motion(int item, ConstVectorRef q, ConstVectorRef displacement, Workspace& w) const noexcept;

  /// R of every coordinate, of the item that moves most: (nv) [m], or 1 for a prismatic joint.
  const Eigen::VectorXd& reach() const noexcept { return items_->reach(); }

 private:
  struct Found {
    double clearance;
    int point;
  };

  std::size_t words() const noexcept { return (static_cast<std::size_t>(items_->size()) + 63) / 64; }
  void place(ConstVectorRef q, Workspace& w) const noexcept;
  void move(ConstVectorRef velocity, Workspace& w) const noexcept;
  double speed(const ClearanceItem& item, Workspace& w) const noexcept;
  const KinematicState& state(Workspace& w) const noexcept;
  void bound_motions(ConstVectorRef displacement, Workspace& w) const noexcept;
  const Workspace::Pose& pose(const Workspace& w, int joint) const noexcept;
  // How exact a clearance must be: not above `cap`, a lower bound from `near` on, and any that is below `stop`.
  struct Asked {
    double cap, near, stop;
  };
  Found measure(const ClearanceItem& item, const Obstacles& obstacles, const Asked& asked, Workspace& w) const noexcept;
  Found measure_obstacles(const ClearanceItem& item, const Obstacles& obstacles, const Asked& asked,
                          Workspace& w) const noexcept;
  double measure_pair(const ClearanceItem& item, const Asked& asked, const Workspace& w) const noexcept;
  double measure_plane(const ClearanceItem& item, double cap, const Workspace& w) const noexcept;
  double margin_at(int item, ConstVectorRef q, const Margins& margins, double& slope) const noexcept;

  std::shared_ptr<const ClearanceItems> items_;
  struct Rotation {
    Eigen::Matrix3d fixed, cosine, sine;  // as in KinematicState
  };
  std::vector<Rotation> rotations_;
};

}  // namespace sidestep

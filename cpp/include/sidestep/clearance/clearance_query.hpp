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

/// Clearances of an arm, see ClearanceItems, in three forms:
///
///   nearest           at a configuration, by positions alone: `nearest`, `clearances`, `distance_left`, `free`;
///   along an edge     everywhere between two configurations: `edge_free`, `path_free`;
///   with derivatives  at a state, for barriers: ClearanceGroup::evaluate of a group of `items()`.
///
/// The first two agree with the third except for obstacles. There they give the signed distance of the obstacles' balls from the
/// ellipsoids, by two Newton steps towards the nearest place: a lower bound, from a supporting plane.
///
/// An edge is judged without gaps (Schwarzer, Saha and Latombe 2005): a share s of it moves no point of an item farther
/// than
///
///     motion(s Δq) = s Σ_i |Δq_i| R_i      and      s v + s²/2 Σ_i Σ_j |Δq_i| |Δq_j| R_max(i, j),
///
/// R_i is the largest distance of the item from the axis of joint i, v the speed of its fastest point where the motion begins,
/// and |∂²x/∂q_i∂q_j| ≤ R_j of the later joint. A table uses the first bound, with its steepest slopes for R. A load uses both,
/// with its slope along the edge for v and bounds of its derivatives. An interval of an edge is free around its middle as far
/// as the clearance there exceeds the smaller bound; the rest on either side is checked in the same way.
class ClearanceQuery {
 public:
  explicit ClearanceQuery(std::shared_ptr<const ClearanceItems> items);
  /// Makes items of its own, see ClearanceItems.
  ClearanceQuery(Robot robot, const Body& body, const std::vector<LinkPair>& pairs = {},
                 const std::vector<KeptPlane>& planes = {}, std::vector<PairDistanceTable> tables = {},
                 std::optional<GravityTorqueLimit> gravity_torque = std::nullopt)
      : ClearanceQuery(std::make_shared<const ClearanceItems>(std::move(robot), body, pairs, planes, std::move(tables),
                                                              std::move(gravity_torque))) {}

  const Robot& robot() const noexcept { return items_->robot(); }
  const ClearanceItems& items() const noexcept { return *items_; }
  int num_items() const noexcept { return items_->size(); }
  /// Label of an item: kind, link, and the other link.
  const CoordinateLabel& label(int item) const noexcept { return (*items_)[item].label; }

  /// Memory of a query; one per thread.
  class Workspace {
   public:
    explicit Workspace(const ClearanceQuery& body);

    /// Number of clearances of single items computed so far: the work done, the same on every machine.
    std::int64_t checks() const noexcept { return checks_; }
    /// Starts anew, so that the next query takes the same work whatever was before.
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
    Eigen::VectorXd lengths_, products_;    // Lengths |Δq_i|, and products |Δq_i| |Δq_j|.
    DistanceField field_;
    std::vector<double> bounds_;  // Bounds of the ellipsoids of a link.
    Eigen::VectorXd q_, difference_;
    Eigen::VectorXd placed_;  // Configuration of the placed body.
    KinematicState state_;    // State of the body there, computed on demand.
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
  Nearest nearest(ConstVectorRef q, const Obstacles& obstacles, double cap, Workspace& w) const noexcept {
    return nearest_of(0, num_items(), q, obstacles, cap, w);
  }
  /// The same of one item.
  Nearest nearest(int item, ConstVectorRef q, const Obstacles& obstacles, double cap, Workspace& w) const noexcept {
    return nearest_of(item, item + 1, q, obstacles, cap, w);
  }
  /// The same of the obstacles alone, without planes and pairs.
  Nearest nearest_obstacle(ConstVectorRef q, const Obstacles& obstacles, double cap, Workspace& w) const noexcept {
    return nearest_of(0, items_->num_obstacles(), q, obstacles, cap, w);
  }

  /// The clearance of every item, not above `cap` [m], into out (num_items).
  void clearances(ConstVectorRef q, const Obstacles& obstacles, double cap, Workspace& w,
                  Eigen::Ref<Eigen::VectorXd> out) const noexcept;

  /// Smallest distance of the clearances above their `floors` (num_items), not above `cap` [m]; a lower bound where it exceeds
  /// `near`. Loads do not count. The search ends at the first below zero.
  double distance_left(ConstVectorRef q, const Obstacles& obstacles, const Eigen::VectorXd& floors, double near, double cap,
                       Workspace& w) const noexcept;

  /// Lower bound [m] of the distance to moving obstacles, now or after `time` [s] at their speed, by balls around the links;
  /// infinity if all are at rest.
  double nearest_moving(ConstVectorRef q, const Obstacles& obstacles, double time, Workspace& w) const noexcept;

  /// Margin of an item away from the ends [m].
  double margin(int item, const Margins& margins) const noexcept {
    const ClearanceItem& of = (*items_)[item];
    return of.is_own() ? std::min({margins.pair_margin, margins.margin, of.most_margin}) : margins.margin;
  }

  /// Whether every item keeps its margin at q. Ends at the first that does not.
  bool free(ConstVectorRef q, const Obstacles& obstacles, const Margins& margins, Workspace& w) const noexcept;

  /// Whether every item keeps its margin, less the slack, everywhere on the straight edge from a to b.
  bool edge_free(ConstVectorRef a, ConstVectorRef b, const Obstacles& obstacles, const Margins& margins,
                 Workspace& w) const noexcept;
  /// The same of all edges from one configuration (nv) of a path to the next. Ends at the first that is not.
  bool path_free(const std::vector<Eigen::VectorXd>& path, const Obstacles& obstacles, const Margins& margins,
                 Workspace& w) const noexcept;

  /// Bound of the relative motion of a point of `item` for a displacement of the joints [m].
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

  /// The smallest clearance of the items from `begin` up to, not including, `end`.
  Nearest nearest_of(int begin, int end, ConstVectorRef q, const Obstacles& obstacles, double cap, Workspace& w) const noexcept;
  std::size_t words() const noexcept { return (static_cast<std::size_t>(items_->size()) + 63) / 64; }
  void place(ConstVectorRef q, Workspace& w) const noexcept;
  void move(ConstVectorRef velocity, Workspace& w) const noexcept;
  double speed(const ClearanceItem& item, Workspace& w) const noexcept;
  const KinematicState& state(Workspace& w) const noexcept;
  void bound_motions(ConstVectorRef displacement, Workspace& w) const noexcept;
  const Workspace::Pose& pose(const Workspace& w, int joint) const noexcept;
  // Required accuracy: values up to `cap`, a lower bound above `near`, and any value below `stop` ends the search.
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
    Eigen::Matrix3d fixed, cosine, sine;  // Parts of the rotation, as in KinematicState.
  };
  std::vector<Rotation> rotations_;
};

}  // namespace sidestep

#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sidestep/body/body.hpp"
#include "sidestep/attractor/embedding.hpp"
#include "sidestep/body/body_ellipsoid.hpp"
#include "sidestep/clearance/clearance_table.hpp"
#include "sidestep/clearance/holding_torque.hpp"
#include "sidestep/body/link_pair.hpp"
#include "sidestep/clearance/ball_cover.hpp"
#include "sidestep/clearance/distance_field.hpp"
#include "sidestep/robot/robot.hpp"
#include "sidestep/scene/obstacles.hpp"

namespace sidestep {

/// A plane that links must not cross: `normal` points to the free side, in the world.
struct KeptPlane {
  Eigen::Vector3d point;
  Eigen::Vector3d normal;
  std::vector<std::string> links;
};

/// How far every item (see BodyClearance) must keep off at a configuration.
///
/// The margin is asked for at every configuration that is looked at, margin − slack is kept everywhere between them.
/// Near an end of the motion where an item is nearer than the margin, by the deficit δ, it may be as near:
///
///     margin(q) = margin − max over ends of δ_end · max(0, 1 − motion(q − q_end) / fade),
///
/// with motion() the bound of how far the item moves, see BodyClearance::motions().
struct Margins {
  struct End {
    Eigen::VectorXd q;         ///< (nv)
    Eigen::VectorXd deficits;  ///< δ of every item [m], zero where the margin holds
  };

  double margin = 0.02;       ///< [m]
  double slack = 0.002;       ///< [m], positive: smaller costs more
  double fade = 0.3;          ///< [m], positive
  std::vector<End> ends;      ///< those with a deficit
  double pair_margin = 0.02;  ///< of two links at most [m]: neighbours are never far apart
};

/// Clearance of a covering body from obstacle points, itself and planes, made for searches: positions alone, no
/// derivative.
///
/// What must keep apart are items: a link and the obstacles, a link and a plane, two links, what a joint holds and its effort limit. The clearances of planes
/// and pairs are those of PlaneBarrier and SelfCollisionBarrier, or of ClearanceTableBarrier; that of obstacles is the
/// distance of their balls from the ellipsoids, signed, by two steps of Newton towards the nearest place: a lower
/// bound, as a supporting plane gives it.
///
/// An edge is judged without gaps (Schwarzer, Saha and Latombe 2005): a share s of it moves no point of an item farther
/// than
///
///     motion(s Δq) = s Σ_i |Δq_i| R_i      and      s v + s²/2 Σ_i Σ_j |Δq_i| |Δq_j| R_max(i, j),
///
/// R_i the largest distance that the item can have from the axis of joint i and v the speed of its fastest point where
/// the motion begins, |∂²x/∂q_i∂q_j| ≤ R_j of the later joint; of a table it is the first, with the steepest slopes for R;
/// of what a joint holds both, with its slope along the edge for v and bounds of the derivatives. An interval of an edge is free as far around its middle as the
/// clearance there exceeds the smaller of the two; what is left to either side is looked at in the same way.
class BodyClearance {
 public:
  /// `pairs` as for SelfCollisionBarrier, `tables` of other pairs as for ClearanceTableBarrier; `holding`:
  /// configurations that the arm cannot rest in are not free. Throws
  /// std::invalid_argument if the body is not calibrated or no joint moves it, a table is at fault, a name is unknown,
  /// or a prismatic joint has no limits.
  BodyClearance(Robot robot, const Body& body, const std::vector<LinkPair>& pairs = {},
                const std::vector<KeptPlane>& planes = {}, std::vector<ClearanceTable> tables = {},
                std::optional<HoldingTorque> holding = std::nullopt);

  const Robot& robot() const noexcept { return robot_; }
  int num_items() const noexcept { return static_cast<int>(items_.size()); }
  /// What an item is: kind, link, and the other link.
  const CoordinateLabel& label(int item) const noexcept { return items_[static_cast<std::size_t>(item)].label; }

  /// What changes in a query; one per thread.
  class Workspace {
   public:
    explicit Workspace(const BodyClearance& body);

    /// How many clearances of single items were asked for: the work done, the same on every machine.
    std::int64_t checks() const noexcept { return checks_; }
    /// Begins anew, so that what is asked for next takes the same work whatever was before.
    void reset() noexcept {
      checks_ = 0;
      last_ = 0;
    }

   private:
    friend class BodyClearance;
    struct Pose {
      Eigen::Matrix3d R;
      Eigen::Vector3d p;
      Eigen::Vector3d angular, linear;  // velocities along an edge, of p
    };
    struct Interval {
      double middle, half;
    };
    static constexpr std::size_t most_intervals = 4096;  // of an edge: 2 m of motion cut down to 1 mm
    std::vector<Pose> poses_;
    std::vector<Eigen::Vector3d> centres_;  // of the balls around the links
    std::vector<Interval> intervals_;
    std::vector<std::uint64_t> open_;       // items that are not decided on an interval, a bit each: `words()` of each interval
    Eigen::VectorXd motions_, curvatures_;  // of the items along an edge
    Eigen::VectorXd lengths_, products_;    // |Δq_i|, |Δq_i| |Δq_j|
    DistanceField field_;
    std::vector<double> bounds_;  // of the ellipsoids of a link
    Eigen::VectorXd q_, difference_;
    Eigen::VectorXd placed_;  // where the body is
    KinematicState state_;    // there, once it is asked for
    Eigen::VectorXd rest_, gradient_;
    bool state_is_old_ = true;
    std::int64_t checks_ = 0;
    int last_ = 0;  // the item that was in the way last: it is looked at first
  };

  /// The smallest clearance of all items, not above `cap` [m].
  struct Nearest {
    double clearance;
    int item = -1;   ///< -1: all are as far as `cap`
    int point = -1;  ///< which obstacle point, for an item of obstacles
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
  double room(ConstVectorRef q, const Obstacles& obstacles, const Eigen::VectorXd& floors, double near, double cap,
              Workspace& w) const noexcept;

  /// How near an obstacle that moves is, or could be after `time` [s] at its speed: a lower bound [m], as by balls
  /// around the links; infinity where all are at rest.
  double nearest_moving(ConstVectorRef q, const Obstacles& obstacles, double time, Workspace& w) const noexcept;

  /// Whether an item is of the arm alone, and known: no sensor's error is in it.
  bool is_own(int item) const noexcept {
    const CoordinateLabel::Kind kind = label(item).kind;
    return kind == CoordinateLabel::Kind::self || kind == CoordinateLabel::Kind::effort;
  }

  /// What `margins` ask of an item away from the ends [m].
  double margin(int item, const Margins& margins) const noexcept {
    return is_own(item) ? std::min({margins.pair_margin, margins.margin, items_[static_cast<std::size_t>(item)].most_margin})
                        : margins.margin;
  }

  /// What `margins` give an item between the configurations that are looked at [m].
  double slack(int item, const Margins& margins) const noexcept {
    return std::min(margins.slack, 0.5 * items_[static_cast<std::size_t>(item)].most_margin);
  }

  /// Whether every item keeps its margin at q. Ends at the first that does not.
  bool free(ConstVectorRef q, const Obstacles& obstacles, const Margins& margins, Workspace& w) const noexcept;

  /// Whether every item keeps its margin, less the slack, everywhere on the straight edge from a to b.
  bool edge_free(ConstVectorRef a, ConstVectorRef b, const Obstacles& obstacles, const Margins& margins,
                 Workspace& w) const noexcept;

  /// How far a point of `item` can move, relative to what it keeps off, for a displacement of the joints [m].
  double motion(int item, ConstVectorRef displacement) const noexcept {
    return items_[static_cast<std::size_t>(item)].reach.dot(displacement.cwiseAbs());
  }

  /// The same from q on, by the smaller of the two bounds.
  double motion(int item, ConstVectorRef q, ConstVectorRef displacement, Workspace& w) const noexcept;

  /// R of every coordinate, of the item that moves most: (nv) [m], or 1 for a prismatic joint.
  const Eigen::VectorXd& reach() const noexcept { return reach_; }

 private:
  struct Ellipsoid {
    Eigen::Vector3d mean;
    Eigen::Matrix3d axes_T;   // rotates into the principal axes, of the joint's child
    Eigen::Vector3d squares;  // of the semi-axes, ascending
    Eigen::Matrix3d shape;
    double extent;
    std::vector<CoverBall> cover;
  };
  struct Link {
    std::string name;
    int joint;
    std::vector<Ellipsoid> ellipsoids;
    Eigen::Vector3d centre;  // of a ball around them
    double radius;
  };
  struct Item {
    Item(CoordinateLabel what, int on, Eigen::Index nv)
        : label(std::move(what)), link(on), reach(Eigen::VectorXd::Zero(nv)), bend(Eigen::MatrixXd::Zero(nv, nv)) {}

    CoordinateLabel label;
    int link, other = -1;   // links_; other: of a pair; both -1 for a table and a load
    int plane = -1;         // planes_
    int table = -1;         // tables_
    int load = -1;          // of holding_
    int base = -1;          // joint that moves both of a pair alike
    Eigen::VectorXd reach;  // R of every coordinate
    Eigen::MatrixXd bend;   // R of the later one of two, row by row in bends_
    double contact = 0.0;   // of a pair [m]

    /// Of links that are usually near, and of loads, see Barrier [m].
    double most_margin = std::numeric_limits<double>::infinity();
  };
  struct Plane {
    Eigen::Vector3d normal;
    double offset;
  };
  struct Found {
    double clearance;
    int point;
  };

  std::size_t words() const noexcept { return (items_.size() + 63) / 64; }
  int add_link(const std::vector<BodyEllipsoid>& all, const Body& body, const std::string& name);
  void add_reach(Item& item, const Link& link) const;
  void add_tables();
  void add_loads();
  void place(ConstVectorRef q, Workspace& w) const noexcept;
  void move(ConstVectorRef velocity, Workspace& w) const noexcept;
  double speed(const Item& item, Workspace& w) const noexcept;
  const KinematicState& state(Workspace& w) const noexcept;
  void bound_motions(ConstVectorRef displacement, Workspace& w) const noexcept;
  const Workspace::Pose& pose(const Workspace& w, int joint) const noexcept;
  // How exact a clearance must be: not above `cap`, a lower bound from `near` on, and any that is below `stop`.
  struct Asked {
    double cap, near, stop;
  };
  Found look(const Item& item, const Obstacles& obstacles, const Asked& asked, Workspace& w) const noexcept;
  Found look_at_points(const Item& item, const Obstacles& obstacles, const Asked& asked, Workspace& w) const noexcept;
  double look_at_pair(const Item& item, const Asked& asked, const Workspace& w) const noexcept;
  double look_at_plane(const Link& link, const Plane& plane, double cap, const Workspace& w) const noexcept;
  double margin_at(int item, ConstVectorRef q, const Margins& margins, double& slope) const noexcept;

  Robot robot_;
  std::vector<Link> links_;
  std::vector<Plane> planes_;
  std::vector<ClearanceTable> tables_;
  std::optional<HoldingTorque> holding_;
  std::vector<Item> items_;
  Eigen::VectorXd reach_;
  Eigen::MatrixXd reaches_, bends_;  // of all items: (items × nv), (items × nv²)
  struct Rotation {
    Eigen::Matrix3d fixed, cosine, sine;  // as in KinematicState
  };
  std::vector<Rotation> rotations_;
};

}  // namespace sidestep

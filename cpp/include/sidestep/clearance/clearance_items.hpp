#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "sidestep/body/body.hpp"
#include "sidestep/body/link_pair.hpp"
#include "sidestep/clearance/clearance_field.hpp"
#include "sidestep/clearance/coordinate_label.hpp"
#include "sidestep/clearance/gravity_torque_limit.hpp"
#include "sidestep/clearance/link_ellipsoids.hpp"
#include "sidestep/clearance/pair_clearances.hpp"
#include "sidestep/clearance/plane_clearances.hpp"
#include "sidestep/clearance/table_clearances.hpp"
#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// One clearance: of a link and the obstacles, of two links, of a link and a plane, or of a gravity torque and its limit.
struct ClearanceItem {
  enum class Source { obstacles, pair, plane, table, load };

  ClearanceItem(Source from, int number, CoordinateLabel what, Eigen::Index nv);

  Source source;
  int index;  ///< Index of the pair, plane, table or load; for an item of obstacles, of the link.
  CoordinateLabel label;
  int link = -1, other = -1;  ///< Index in BodyLinks; `other`: second link of a pair; both -1 for a table and a load.
  int base = -1;              ///< Joint that moves both links of a pair alike; -1: none.
  double contact = 0.0;       ///< Contact gap of a pair [m].

  /// R of every coordinate (nv) [m/rad | 1]: largest relative motion of a point of the item per unit of the coordinate; for a
  /// table and a load the steepest slopes.
  Eigen::VectorXd reach;
  /// R of the later one of two coordinates (nv × nv) [m/rad²].
  Eigen::MatrixXd bend;
  /// Largest margin [m], for links that are usually near and for loads, see ClearanceGroup.
  double most_margin = std::numeric_limits<double>::infinity();

  /// Whether it concerns the arm alone, so that no sensor error is in it.
  bool is_own() const noexcept {
    return label.kind == CoordinateLabel::Kind::self || label.kind == CoordinateLabel::Kind::effort;
  }
};

/// All clearances of an arm, made once: a list for searches, and groups for derivatives, over the same links.
///
/// Barriers, planner, look-ahead and stops share it. Items of obstacles come first, then pairs, planes, tables and loads.
class ClearanceItems {
 public:
  /// `temperature` [m] of the means that have derivatives. Throws std::invalid_argument if the body is not calibrated or no
  /// joint moves it, a pair, plane or table is at fault, a name is unknown, or a prismatic joint has no limits.
  ClearanceItems(Robot robot, const Body& body, const std::vector<LinkPair>& pairs = {},
                 const std::vector<KeptPlane>& planes = {}, std::vector<PairDistanceTable> tables = {},
                 std::optional<GravityTorqueLimit> gravity_torque = std::nullopt,
                 double temperature = PairClearances::default_temperature);

  const Robot& robot() const noexcept { return robot_; }
  const BodyLinks& links() const noexcept { return *links_; }

  int size() const noexcept { return static_cast<int>(items_.size()); }
  int num_obstacles() const noexcept { return num_obstacles_; }  ///< Number of items of obstacles.
  const ClearanceItem& operator[](int i) const noexcept { return items_[static_cast<std::size_t>(i)]; }

  // Groups of clearances; null where there are none.
  const std::shared_ptr<const ClearanceField>& obstacles() const noexcept { return obstacles_; }
  const std::shared_ptr<const PairClearances>& pairs() const noexcept { return pairs_; }
  const std::vector<std::shared_ptr<const PlaneClearances>>& planes() const noexcept { return planes_; }
  const std::shared_ptr<const TableClearances>& tables() const noexcept { return tables_; }
  const std::shared_ptr<const GravityTorqueLimit>& gravity_torque() const noexcept { return gravity_torque_; }

  /// R of every coordinate, of the item that moves most: (nv) [m], or 1 for a prismatic joint.
  const Eigen::VectorXd& reach() const noexcept { return reach_; }
  /// Of all items: (items × nv), (items × nv²), the latter row by row.
  const Eigen::MatrixXd& reaches() const noexcept { return reaches_; }
  const Eigen::MatrixXd& bends() const noexcept { return bends_; }

 private:
  Robot robot_;
  std::shared_ptr<const BodyLinks> links_;
  std::shared_ptr<const ClearanceField> obstacles_;
  std::shared_ptr<const PairClearances> pairs_;
  std::vector<std::shared_ptr<const PlaneClearances>> planes_;
  std::shared_ptr<const TableClearances> tables_;
  std::shared_ptr<const GravityTorqueLimit> gravity_torque_;
  std::vector<ClearanceItem> items_;
  int num_obstacles_;
  Eigen::VectorXd reach_;
  Eigen::MatrixXd reaches_, bends_;
};

}  // namespace sidestep

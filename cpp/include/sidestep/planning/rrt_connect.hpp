#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <utility>

#include "sidestep/math/fields.hpp"
#include "sidestep/clearance/clearance_query.hpp"
#include "sidestep/planning/path_smoothing.hpp"
#include "sidestep/planning/plan.hpp"
#include "sidestep/math/random_stream.hpp"
#include "sidestep/planning/search_tree.hpp"

namespace sidestep {

struct PlannerSettings {
  double margin = 0.06;  ///< Clearance of a wide path, on which barriers hardly act [m].
  double floor = 0.005;  ///< Clearance of the first path, and least clearance of every path [m].
  /// Largest depth at start or goal [m]: an ellipsoid is larger than its link.
  double allowance = 0.02;
  /// Largest distance of the gap of two links below its contact (see LinkPair) at start or goal [m].
  double pair_allowance = 0.02;
  double slack = 0.002;  ///< Least slack [m], see Margins; usually a quarter of the margin.
  double fade = 0.3;     ///< Fade of the margins [m], see Margins.
  /// Longest edge of the trees [rad | m], with joints weighted by how far they reach, see RrtConnect.
  double range = 1.0;
  int max_nodes = 10000;  ///< Largest number of nodes of both trees.
  int max_iterations = 40000;
  /// Largest number of clearance checks in one plan, some 2 s of work: one item counts as one, and so do a thousand nodes that
  /// are visited.
  int max_checks = 2000000;
  double max_seconds = std::numeric_limits<double>::infinity();
  int shortcuts = 100;  ///< Attempts to shorten a path.

  /// Throws std::invalid_argument that names the setting at fault.
  void validate() const;
};
template <>
const std::vector<Field<PlannerSettings>>& fields();

/// A path for a covering body between two configurations: the straight edge if it is free, else RRT-Connect (Kuffner
/// and LaValle 2000) with dynamic domains (Yershova et al. 2005). Deterministic in (start, goal, obstacles, seed)
/// unless the time runs out.
///
/// Distances in the trees are √Σ (w_i Δq_i)², with w_i the reach of joint i over the mean reach. Seven of ten samples are
/// uniform within the limits, the others around a node. Both trees grow as far as they can: one towards the sample, the other
/// towards the end of the first. A node that was trapped grows by steps of random length.
///
/// The first path keeps the `floor`: such paths are many, and found soonest. It is then improved: a path that keeps `margin` is
/// searched with a 400th of the budget, otherwise one that keeps the geometric mean of the two with a 40th, and the result is
/// shortened and widened. The plan states the margin that its path keeps; near start and goal every link may be as close to
/// obstacles as it is there, see Margins. A start or goal with a link deeper than `allowance` in something is in collision.
class RrtConnect {
 public:
  /// The body must outlive the planner, which is mutable: one per thread.
  RrtConnect(const ClearanceQuery& body, const PlannerSettings& settings);

  /// A start or goal outside the position limits by rounding is replaced by the nearest one inside.
  Plan plan(const Eigen::VectorXd& start, const Eigen::VectorXd& goal, const Obstacles& obstacles, std::uint64_t seed);

  /// The two parts of a plan: the first path, then a better one. margin [m] replaces that of the settings; at least the floor.
  Plan find(const Eigen::VectorXd& start, const Eigen::VectorXd& goal, const Obstacles& obstacles, std::uint64_t seed);
  void improve(Plan& plan, const Obstacles& obstacles, std::uint64_t seed, double margin);

  /// Sets a predicate that ends `find` as if time ran out, and `improve` with its result so far.
  void interrupt_when(Interrupted interrupted) { interrupted_ = std::move(interrupted); }

  const PlannerSettings& settings() const noexcept { return settings_; }
  const ClearanceQuery& body() const noexcept { return *body_; }
  ClearanceQuery::Workspace& workspace() noexcept { return workspace_; }

  /// Whether an item is deeper than its allowance inside something at q; writes what.
  bool obstructed(const Eigen::VectorXd& q, const Obstacles& obstacles, Obstruction& obstruction);

  /// Margins between two ends: this distance, and less near an end that has less.
  Margins margins(double distance, const Eigen::VectorXd& start, const Eigen::VectorXd& goal, const Obstacles& obstacles);

  /// Whether the straight way is free with this margin [m], except near its ends.
  bool sees(const Eigen::VectorXd& from, const Eigen::VectorXd& to, double margin, const Obstacles& obstacles);

  /// Makes a path (nv × W) begin `here`, straight to its last visible waypoint, from `first` on. False if none is visible.
  bool enter(Eigen::MatrixXd& path, Eigen::Index first, double margin, const Eigen::VectorXd& here, const Obstacles& obstacles);

 private:
  /// Largest depth of an item at an end [m].
  double allowance(int item) const noexcept;
  enum class Growth { trapped, advanced, reached };

  /// Whether the budget of checks is used up.
  bool spent() const noexcept { return work() - work_before_ > settings_.max_checks; }
  std::int64_t work() const noexcept { return workspace_.checks() + nodes_looked_through_ / 1000; }
  int nearest(SearchTree& tree, const Eigen::VectorXd& q);
  void connect(double margin, int iterations, const Eigen::VectorXd& start, const Eigen::VectorXd& goal,
               const Obstacles& obstacles, double deadline, RandomStream& random, Plan& plan);
  void search(const Eigen::VectorXd& start, const Eigen::VectorXd& goal, const Obstacles& obstacles, const Margins& margins,
              int iterations, double deadline, RandomStream& random, Plan& plan);
  /// Draws sample_ between low and high and returns the node of the tree that is nearest to it.
  int draw_sample(const Eigen::VectorXd& low, const Eigen::VectorXd& high, SearchTree& tree, RandomStream& random);
  /// Grows from a node on until the target is reached or no step is free; `trapped` where not even one was.
  Growth extend(SearchTree& tree, int from, const Eigen::VectorXd& target, const Obstacles& obstacles, const Margins& margins,
                RandomStream& random);
  /// One step of that.
  Growth grow(SearchTree& tree, int from, const Eigen::VectorXd& target, const Obstacles& obstacles, const Margins& margins,
              RandomStream& random);

  const ClearanceQuery* body_;
  PlannerSettings settings_;
  ClearanceQuery::Workspace workspace_;
  std::int64_t nodes_looked_through_ = 0, work_before_ = 0;  // Work so far; before the current plan.
  Interrupted interrupted_ = never_interrupted;
  SearchTree from_start_, from_goal_;
  Eigen::VectorXd sample_, next_, near_, clearances_;
};

}  // namespace sidestep

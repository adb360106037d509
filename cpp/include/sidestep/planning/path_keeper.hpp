#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "sidestep/clearance/clearance_query.hpp"
#include "sidestep/math/interruption.hpp"
#include "sidestep/planning/kept_path.hpp"
#include "sidestep/planning/online_planner_settings.hpp"
#include "sidestep/planning/planner_exchange.hpp"
#include "sidestep/planning/rrt_connect.hpp"

namespace sidestep {

/// The part of an OnlinePlanner beside the loop: checks the scene, finds paths and keeps to them.
///
/// For every state from the exchange it checks whether the way ahead is still free among the newest obstacles and the arm makes
/// progress. If not, it searches again from where the arm is; after a stop with a larger margin. One thread at a time.
class PathKeeper {
 public:
  using State = PlannerExchange::State;
  /// Progress within the patience below which the arm counts as stuck [rad | m]; on a slow path less.
  static constexpr double usual_progress = 0.0202;

  /// All of them must outlive the keeper.
  PathKeeper(const ClearanceQuery& body, const OnlinePlannerConfig& settings, PlannerExchange& exchange);

  /// Checks the way of a state, and answers if something changes. An exception costs this update alone, not the process.
  void update(const State& state) noexcept;
  /// Updates to the newest state, unless already done, and reports it.
  void update_to_newest();

  /// Sets a predicate that ends a search, as if time ran out.
  void interrupt_when(Interrupted interrupted) { search_.interrupt_when(std::move(interrupted)); }
  /// Ends a search once `stopping`, at a new goal, and where something new blocks the path that it improves.
  void interrupt_when_overtaken(const std::atomic<bool>& stopping);

 private:
  void check_way(const State& state);
  void take_goal(const State& state);
  /// Margin [m] with which the straight way to the goal is taken; empty if it is not free, or the present path is kept.
  std::optional<double> straight_margin(const State& state, const Obstacles& obstacles, bool stuck);
  void go_straight(const State& state, double margin, const Obstacles& obstacles);
  void search(const State& state, const Obstacles& obstacles);
  /// Improves the first path of a search, which an arm may follow meanwhile; false if something new blocks that path.
  bool improve(Plan& plan, const State& state, const Obstacles& obstacles, std::uint64_t seed, double margin);
  /// Whether something new blocks the first path, while a better one is made from it.
  bool overtaken();
  /// Whether the arm can keep its path: the straight edge to the reference is free, or another way back to the path is.
  bool holds_on(const State& state, const Obstacles& obstacles);
  void follow(const State& state, const Eigen::MatrixXd& path, const Margins& margins, const Obstacles& obstacles,
              bool measured);
  Eigen::VectorXd within_limits(const Eigen::VectorXd& q) const { return body_.robot().limits().nearest_within(q); }
  void answer(const State& state, PlanStatus status);

  const ClearanceQuery& body_;
  const OnlinePlannerConfig& settings_;
  PlannerExchange& exchange_;
  RrtConnect search_;
  KeptPath path_;
  std::shared_ptr<const Obstacles> obstacles_;  // Obstacles among which it plans.
  std::uint64_t seen_scene_ = 0, seen_goal_ = 0, seen_stops_ = 0, path_number_ = 0, searches_ = 0;
  bool newer_ = false;  // Whether a state arrived that it has not checked.
  bool have_path_ = false, direct_ = false, failed_ = false;
  bool changed_ = false;  // Whether the scene has changed since the path was last checked.
  bool improving_ = false, overtaken_ = false;
  std::uint64_t watched_scene_ = 0;
  ClearanceQuery::Workspace watch_;  // Workspace of its own, since that of the search is in use then.
  double margin_, failed_at_ = 0.0;
  PlanStatus status_ = PlanStatus::no_path;
};

}  // namespace sidestep

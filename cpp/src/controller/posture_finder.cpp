#include "posture_finder.hpp"

#include <algorithm>

#include "../math/settings.hpp"

namespace sidestep {
namespace {

constexpr int starts = 40;        // configurations from which a posture for a pose is searched at first
constexpr int starts_again = 20;  // and for another one

}  // namespace

PostureFinder::PostureFinder(const ClearanceQuery& body, const ControllerSettings& settings)
    : body_(body),
      settings_(settings),
      endpoint_checker_(body, settings.planner ? settings.planner->search : PlannerSettings{}),
      workspace_(body) {}

Posture PostureFinder::find(const PoseGoal& goal, const Eigen::VectorXd& near, const Obstacles& obstacles,
                            std::uint64_t attempt) {
  Obstruction obstruction;
  const Eigen::VectorXd& rest = goal.settings.rest;
  PostureSearchSettings search;
  search.starts = attempt == 0 ? starts : starts_again;
  search.seed = settings_.seed + attempt;
  search.another = attempt > 0;
  search.limit_distance = settings_.position_margin + settings_.barriers.limit_activation;
  bool free_of_itself = false;
  Posture posture =
      find_posture(body_.robot(), goal, rest.size() == near.size() ? rest : near, search, [&](const Eigen::VectorXd& q) {
        const ClearanceQuery::Nearest own = body_.nearest(q, Obstacles::none(), 0.0, workspace_);
        free_of_itself = free_of_itself || own.clearance >= 0.0 || body_.label(own.item).kind == CoordinateLabel::Kind::effort;
        return endpoint_checker_.obstructed(q, obstacles, obstruction)
                   ? -infinity
                   : std::max(0.0, body_.nearest(q, obstacles, 2.0 * search.clearance, workspace_).clearance);
      });
  posture.touches_itself = posture.found() && !free_of_itself;
  return posture;
}

}  // namespace sidestep

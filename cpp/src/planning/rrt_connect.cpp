#include "sidestep/planning/rrt_connect.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "../math/settings.hpp"
#include "sidestep/planning/path_smoothing.hpp"
#include "sidestep/math/random_stream.hpp"

namespace sidestep {
namespace {

constexpr double pi = 3.14159265358979323846;  // The number π.
// Slack as a share of the margin [-]: the less slack, the more the proof of an edge along it costs.
constexpr double slack_share = 0.25;
constexpr double local = 0.3;        // Share of the samples that are around a node [-]: narrow places are near others.
constexpr double around_node = 2.4;  // Largest distance of each joint of such a sample from the node's [rad | m].
constexpr double octaves = 2.5;      // Octaves of step lengths below the range, from a node that was trapped.
constexpr double domain = 3.0;       // Largest distance of samples from a trapped node, in ranges.
constexpr int draws = 32;            // Most draws of a sample until one is within the domain of its nearest node.
constexpr double touching = 1e-6;    // Deficit that is added at an end [m]: rounding when it is asked for again.

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

std::vector<Eigen::VectorXd> to_root(const SearchTree& tree, int node) {
  std::vector<Eigen::VectorXd> way;
  for (; node >= 0; node = tree.parent(node)) {
    way.emplace_back(tree.node(node));
  }
  return way;
}

}  // namespace

template <>
const std::vector<Field<PlannerSettings>>& fields() {
  using S = PlannerSettings;
  static const std::vector<Field<S>> all{
      {"margin", &S::margin, "m", 0.001, 0.5,
       "preferred clearance of paths: larger stays farther from obstacles, on longer paths"},
      {"floor", &S::floor, "m", 1e-4, 0.5, "least clearance of every path: smaller passes narrower gaps"},
      {"allowance", &S::allowance, "m", 0.0, 0.2,
       "largest depth of a covering ellipsoid in an obstacle that is accepted at start and goal"},
      {"pair_allowance", &S::pair_allowance, "m", 0.0, 0.2,
       "largest depth of two links of the arm in each other that is accepted at start and goal"},
      {"slack", &S::slack, "m", 1e-5, 0.1,
       "distance by which an edge may undercut its margin (a quarter of the margin if that is more): larger checks faster"},
      {"fade", &S::fade, "m", 0.01, 10.0,
       "distance from start or goal over which their smaller margins return to the full one"},
      {"range", &S::range, "rad", 0.01, 10.0, "length of the longest edge in the search trees"},
      {"max_nodes", &S::max_nodes, "-", 2.0, 1e6, "largest number of nodes in both trees: the budget of one search"},
      {"max_iterations", &S::max_iterations, "-", 1.0, 2e9, "largest number of iterations of one search: its budget"},
      {"max_checks", &S::max_checks, "-", 1.0, 2e9,
       "largest number of clearance checks in one plan: its budget, some 2 s of work"},
      {"max_seconds", &S::max_seconds, "s", 1e-9, infinity, "time limit of one search; with a limit motions do not repeat"},
      {"shortcuts", &S::shortcuts, "-", 0.0, 1e6, "number of attempts to shorten a path: more give shorter paths, later"},
  };
  return all;
}

void PlannerSettings::validate() const {
  check_fields("planner: ", *this);
  if (!(margin >= floor)) {
    throw std::invalid_argument("planner: floor is " + std::to_string(floor) + " m and margin " + std::to_string(margin) +
                                " m; allowed: floor <= margin");
  }
}

RrtConnect::RrtConnect(const ClearanceQuery& body, const PlannerSettings& settings)
    : body_(&body),
      settings_(settings),
      workspace_(body),
      from_start_(body.reach() / body.reach().mean(), settings.max_nodes),
      from_goal_(body.reach() / body.reach().mean(), settings.max_nodes),
      sample_(body.robot().num_coordinates()),
      next_(body.robot().num_coordinates()),
      near_(body.robot().num_coordinates()),
      clearances_(body.num_items()) {
  settings_.validate();
}

double RrtConnect::allowance(int item) const noexcept {
  switch (body_->label(item).kind) {
    case CoordinateLabel::Kind::effort: return 0.0;  // it is exact
    case CoordinateLabel::Kind::self: return settings_.pair_allowance;
    default: return settings_.allowance;
  }
}

bool RrtConnect::obstructed(const Eigen::VectorXd& q, const Obstacles& obstacles, Obstruction& obstruction) {
  body_->clearances(q, obstacles, 0.0, workspace_, clearances_);
  int worst = -1;
  double excess = 0.0;
  for (int i = 0; i < body_->num_items(); ++i) {
    const double beyond = -clearances_[i] - allowance(i);
    if (beyond > excess) {
      excess = beyond;
      worst = i;
    }
  }
  if (worst < 0) {
    return false;
  }
  const ClearanceQuery::Nearest nearest = body_->nearest(worst, q, obstacles, 0.0, workspace_);
  obstruction = {body_->label(worst), nearest.point, -nearest.clearance,
                 nearest.point < 0 ? std::string() : obstacles.words_for(nearest.point)};
  return true;
}

Margins RrtConnect::margins(double distance, const Eigen::VectorXd& start, const Eigen::VectorXd& goal,
                            const Obstacles& obstacles) {
  Margins margins{distance, std::max(settings_.slack, slack_share * distance), settings_.fade, {}};
  for (const Eigen::VectorXd* q : {&start, &goal}) {
    body_->clearances(*q, obstacles, distance, workspace_, clearances_);
    Eigen::VectorXd deficits(body_->num_items());
    for (int i = 0; i < body_->num_items(); ++i) {
      const double asked = body_->margin(i, margins);
      deficits[i] = clearances_[i] < asked ? asked + touching - clearances_[i] : 0.0;
    }
    if (deficits.maxCoeff() > 0.0) {
      margins.ends.push_back({*q, deficits});
    }
  }
  return margins;
}

bool RrtConnect::sees(const Eigen::VectorXd& from, const Eigen::VectorXd& to, double margin, const Obstacles& obstacles) {
  return body_->edge_free(from, to, obstacles, margins(margin, from, to, obstacles), workspace_);
}

bool RrtConnect::enter(Eigen::MatrixXd& path, Eigen::Index first, double margin, const Eigen::VectorXd& here,
                       const Obstacles& obstacles) {
  for (Eigen::Index k = path.cols() - 1; k >= first; --k) {
    if (sees(here, path.col(k), margin, obstacles)) {
      Eigen::MatrixXd rest(path.rows(), path.cols() - k + 1);
      rest << here, path.rightCols(path.cols() - k);
      path = std::move(rest);
      return true;
    }
  }
  return false;
}

Plan RrtConnect::plan(const Eigen::VectorXd& start, const Eigen::VectorXd& goal, const Obstacles& obstacles,
                      std::uint64_t seed) {
  Plan plan = find(start, goal, obstacles, seed);
  improve(plan, obstacles, seed, settings_.margin);
  return plan;
}

Plan RrtConnect::find(const Eigen::VectorXd& from, const Eigen::VectorXd& to, const Obstacles& obstacles, std::uint64_t seed) {
  const double begin = seconds();
  Plan plan;
  const JointLimits& limits = body_->robot().limits();
  const auto usable = [&](const Eigen::VectorXd& q) {
    return q.size() == body_->robot().num_coordinates() && q.allFinite() &&
           (q - limits.nearest_within(q)).cwiseAbs().maxCoeff() <= JointLimits::rounding;
  };
  if (!usable(from) || !usable(to)) {
    return plan;
  }
  const Eigen::VectorXd start = limits.nearest_within(from), goal = limits.nearest_within(to);
  if (obstructed(start, obstacles, plan.obstruction)) {
    plan.status = PlanStatus::start_in_collision;
    return plan;
  }
  if (obstructed(goal, obstacles, plan.obstruction)) {
    plan.status = PlanStatus::goal_in_collision;
    return plan;
  }
  workspace_.reset();
  nodes_looked_through_ = work_before_ = 0;
  RandomStream random(seed);
  connect(settings_.floor, settings_.max_iterations, start, goal, obstacles, begin + settings_.max_seconds, random, plan);
  plan.checks = work() - work_before_;
  plan.search_seconds = seconds() - begin;
  return plan;
}

void RrtConnect::improve(Plan& plan, const Obstacles& obstacles, std::uint64_t seed, double margin) {
  if (plan.status != PlanStatus::found) {
    return;
  }
  const double begin = seconds(), deadline = begin + settings_.max_seconds - plan.search_seconds;
  work_before_ = work() - plan.checks;
  const Interrupted ended = [this] { return interrupted_() || spent(); };
  RandomStream random(~seed);
  const Eigen::VectorXd start = plan.path.col(0), goal = plan.path.rightCols(1);
  // A wide way is tried for a little, what lies between for longer.
  for (const auto& [level, share] : {std::pair{margin, 400}, std::pair{std::sqrt(margin * settings_.floor), 40}}) {
    if (level > plan.margin) {
      Plan wider = plan;
      connect(level, settings_.max_iterations / share, start, goal, obstacles, deadline, random, wider);
      plan.nodes = wider.nodes;
      plan.iterations = wider.iterations;
      if (wider.status == PlanStatus::found) {
        plan = std::move(wider);
      }
    }
  }
  if (plan.path.cols() > 2 && settings_.shortcuts > 0 && !ended()) {
    const Margins kept = margins(plan.margin, start, goal, obstacles);
    plan.path = shorten(plan.path, *body_, obstacles, kept, settings_.shortcuts, random, workspace_, ended);
    plan.path = widen(plan.path, *body_, obstacles, kept, settings_.margin, random, workspace_, ended);
  }
  plan.checks = work() - work_before_;
  plan.improvement_seconds = seconds() - begin;
}

void RrtConnect::connect(double margin, int iterations, const Eigen::VectorXd& start, const Eigen::VectorXd& goal,
                         const Obstacles& obstacles, double deadline, RandomStream& random, Plan& plan) {
  plan.status = PlanStatus::no_path;
  plan.margin = margin;
  const Margins kept = margins(margin, start, goal, obstacles);
  if (body_->edge_free(start, goal, obstacles, kept, workspace_)) {
    plan.path.resize(start.size(), 2);
    plan.path << start, goal;
    plan.status = PlanStatus::found;
  } else {
    search(start, goal, obstacles, kept, iterations, deadline, random, plan);
  }
}

void RrtConnect::search(const Eigen::VectorXd& start, const Eigen::VectorXd& goal, const Obstacles& obstacles,
                        const Margins& margins, int iterations, double deadline, RandomStream& random, Plan& plan) {
  from_start_.clear();
  from_goal_.clear();
  from_start_.add(start, -1);
  from_goal_.add(goal, -1);
  const JointLimits& limits = body_->robot().limits();
  // A joint without limits is searched a turn to either side of the two ends.
  const Eigen::VectorXd low = limits.lower.cwiseMax((start.cwiseMin(goal).array() - 2.0 * pi).matrix());
  const Eigen::VectorXd high = limits.upper.cwiseMin((start.cwiseMax(goal).array() + 2.0 * pi).matrix());
  SearchTree *one = &from_start_, *other = &from_goal_;
  const int nodes_before = plan.nodes;
  for (int i = 0; i < iterations && !spent() && !one->full() && !other->full(); ++i) {
    ++plan.iterations;
    plan.nodes = nodes_before + one->size() + other->size();
    if (seconds() > deadline || interrupted_()) {
      plan.status = PlanStatus::timeout;
      return;
    }
    const int at = draw_sample(low, high, *one, random);
    if (extend(*one, at, sample_, obstacles, margins, random) != Growth::trapped) {
      const Eigen::VectorXd met = one->node(one->size() - 1);
      if (extend(*other, nearest(*other, met), met, obstacles, margins, random) == Growth::reached) {
        std::vector<Eigen::VectorXd> way = to_root(from_start_, from_start_.size() - 1);
        std::reverse(way.begin(), way.end());
        const std::vector<Eigen::VectorXd> rest = to_root(from_goal_, from_goal_.size() - 1);
        way.insert(way.end(), rest.begin() + 1, rest.end());  // the two trees share the node where they met
        plan.path.resize(start.size(), static_cast<Eigen::Index>(way.size()));
        for (std::size_t k = 0; k < way.size(); ++k) {
          plan.path.col(static_cast<Eigen::Index>(k)) = way[k];
        }
        plan.nodes = nodes_before + one->size() + other->size();
        plan.status = PlanStatus::found;
        return;
      }
    }
    // The smaller tree is the one in a narrow place: it needs the samples.
    if (one->size() > other->size()) {
      std::swap(one, other);
    }
  }
}

int RrtConnect::nearest(SearchTree& tree, const Eigen::VectorXd& q) {
  nodes_looked_through_ += tree.size();
  return tree.nearest(q);
}

int RrtConnect::draw_sample(const Eigen::VectorXd& low, const Eigen::VectorXd& high, SearchTree& tree, RandomStream& random) {
  if (random.unit() < local) {
    const auto node = tree.node(static_cast<int>(random.unit() * tree.size()));
    for (Eigen::Index k = 0; k < sample_.size(); ++k) {
      sample_[k] = random.uniform(std::max(low[k], node[k] - around_node), std::min(high[k], node[k] + around_node));
    }
    return nearest(tree, sample_);
  }
  // Samples far from nodes that were trapped only find the same walls again.
  int node = 0;
  for (int draw = 0; draw < draws; ++draw) {
    for (Eigen::Index k = 0; k < sample_.size(); ++k) {
      sample_[k] = random.uniform(low[k], high[k]);
    }
    node = nearest(tree, sample_);
    if (tree.distance(node, sample_) <= tree.domain(node)) {
      break;
    }
  }
  return node;
}

RrtConnect::Growth RrtConnect::extend(SearchTree& tree, int from, const Eigen::VectorXd& target, const Obstacles& obstacles,
                                      const Margins& margins, RandomStream& random) {
  const int before = tree.size();
  Growth growth = Growth::advanced;
  while (growth == Growth::advanced && !tree.full()) {
    growth = grow(tree, from, target, obstacles, margins, random);
    from = tree.size() - 1;
  }
  return growth == Growth::trapped && tree.size() > before ? Growth::advanced : growth;
}

RrtConnect::Growth RrtConnect::grow(SearchTree& tree, int from, const Eigen::VectorXd& target, const Obstacles& obstacles,
                                    const Margins& margins, RandomStream& random) {
  near_ = tree.node(from);
  const double distance = tree.distance(from, target);
  const auto step = [&](double range) {
    const bool whole = distance <= range;
    next_ = whole ? target : near_ + range / distance * (target - near_);
    if (!body_->free(next_, obstacles, margins, workspace_) ||
        !body_->edge_free(near_, next_, obstacles, margins, workspace_)) {
      return Growth::trapped;
    }
    tree.add(next_, from);
    return whole ? Growth::reached : Growth::advanced;
  };
  // A long step, unless one was not free before; else a shorter one.
  double longest = settings_.range;
  if (!tree.bounded(from)) {
    const Growth growth = step(longest);
    if (growth != Growth::trapped) {
      return growth;
    }
    longest = std::min(longest, distance);
    tree.bound(from, domain * settings_.range);
  }
  return step(longest * std::exp2(-octaves * random.unit()));
}

}  // namespace sidestep

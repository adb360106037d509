#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <optional>

#include "arguments.hpp"
#include "interruptible.hpp"
#include "module.hpp"
#include "settings.hpp"
#include "sidestep/attractor/goal.hpp"
#include "sidestep/planning/online_planner.hpp"
#include "sidestep/planning/rrt_connect.hpp"

namespace sidestep::python {
namespace {

/// A planner with the body it searches for.
class PathPlanner {
 public:
  PathPlanner(const Robot& robot, const Body& body, const Pairs& pairs, std::vector<PairDistanceTable> tables,
              const PlannerSettings& settings)
      : body_(robot, body, link_pairs(pairs), {}, std::move(tables)), planner_(body_, settings) {}
  PathPlanner(const PathPlanner&) = delete;
  PathPlanner& operator=(const PathPlanner&) = delete;

  Eigen::VectorXd configuration(nb::handle value, const char* name) const {
    return as_finite_vector(value, name, body_.robot().num_coordinates());
  }
  Margins margins(std::optional<double> margin) const {
    const PlannerSettings& s = planner_.settings();
    return {margin.value_or(s.margin), s.slack, s.fade, {}};
  }
  const ClearanceQuery& body() const { return body_; }
  RrtConnect& planner() { return planner_; }

 private:
  ClearanceQuery body_;
  RrtConnect planner_;
};

struct ClearanceReport {
  double clearance;
  CoordinateLabel label;
  int point;
};

void bind_plan(nb::module_& m) {
  nb::enum_<PlanStatus>(m, "PlanStatus", "What a search says about its result.")
      .value("found", PlanStatus::found, "There is a path.")
      .value("no_path", PlanStatus::no_path, "None within the budget of nodes, iterations and checks.")
      .value("timeout", PlanStatus::timeout, "None within the budget of time.")
      .value("start_in_collision", PlanStatus::start_in_collision, "See Plan.obstruction.")
      .value("goal_in_collision", PlanStatus::goal_in_collision, "See Plan.obstruction.")
      .value("invalid", PlanStatus::invalid, "Start or goal is outside the position limits.");

  nb::class_<Obstruction>(m, "Obstruction",
                          "What is in the way at an end of a motion: link, the other link of a pair, or which obstacle\n"
                          "point (-1: none), and depth [m], how far the covering ellipsoids reach into it.")
      .def_prop_ro("kind", [](const Obstruction& o) { return o.label.kind; }, "Whether an obstacle, a plane or another link is in the way.")
      .def_prop_ro("link", [](const Obstruction& o) { return o.label.name; })
      .def_prop_ro("other", [](const Obstruction& o) { return o.label.other; })
      .def_ro("point", &Obstruction::point)
      .def_ro("depth", &Obstruction::depth)
      .def("__str__", [](const Obstruction& o) { return describe(o); })
      .def("__repr__", [](const Obstruction& o) {
        return o.label.name.empty() ? std::string("Obstruction()") : "Obstruction(" + describe(o) + ")";
      });

  nb::class_<Plan>(m, "Plan", "A path, or why there is none.")
      .def_ro("status", &Plan::status, "Whether a path was found, or why not.")
      .def_prop_ro("path", [](const Plan& p) { return to_numpy_matrix(p.path.transpose()); },
                   "(W, nv) waypoints from start to goal, straight between them; empty unless found.")
      .def_prop_ro("length", [](const Plan& p) { return length(p.path); }, "Sum of |dq| [rad | m].")
      .def_ro("margin", &Plan::margin, "[m] that the path keeps, but for its ends.")
      .def_ro("obstruction", &Plan::obstruction, "What is in the way at a start or goal in collision.")
      .def_ro("nodes", &Plan::nodes, "Of both trees.")
      .def_ro("iterations", &Plan::iterations, "Samples that the search drew.")
      .def_ro("checks", &Plan::checks, "The work, see max_checks of PlannerSettings; improvement included.")
      .def_ro("search_seconds", &Plan::search_seconds, "[s] until a path was found, or given up.")
      .def_ro("improvement_seconds", &Plan::improvement_seconds,
              "[s] to look for a wider one, and to make it short.")
      .def("__repr__", [](const Plan& p) {
        return std::string("Plan(") + nb::str(nb::cast(p.status).attr("name")).c_str() + ", " + std::to_string(p.path.cols()) +
               " waypoints, length=" + in_short(length(p.path)) + ")";
      });
}

void bind_planner_settings(nb::module_& m) {
  bind_settings<PlannerSettings>(m, "PlannerSettings", "How a PathPlanner searches.");
  bind_settings<TimedPathSettings>(m, "TimedPathSettings", "How fast the reference of an OnlinePlanner passes a path.");
}

/// What Python gets from a step of an OnlinePlanner.
struct PlannerReference {
  OnlinePlannerStatus status;
  OnlinePlanner::Reference reference;
};

void bind_guide(nb::module_& m) {
  nb::enum_<OnlinePlannerStatus>(m, "OnlinePlannerStatus", "What a motion led by an OnlinePlanner is about.")
      .value("idle", OnlinePlannerStatus::idle, "No goal was given.")
      .value("moving", OnlinePlannerStatus::moving, "On the way.")
      .value("arrived", OnlinePlannerStatus::arrived, "Every joint is at the goal.")
      .value("no_path", OnlinePlannerStatus::no_path, "None was found within the budget; looked for again.")
      .value("goal_in_collision", OnlinePlannerStatus::goal_in_collision, "Gone to when it becomes free.")
      .value("start_in_collision", OnlinePlannerStatus::start_in_collision, "The reactive layer brings the arm out.")
      .value("timeout", OnlinePlannerStatus::timeout, "The time for the motion is over; it goes on.")
      .value("invalid", OnlinePlannerStatus::invalid, "The goal is outside the limits, or the state is not finite.");

  nb::class_<PlannerReference>(m, "PlannerReference",
                               "The current reference of an OnlinePlanner, and what the motion is about.")
      .def_ro("status", &PlannerReference::status, "What the motion is about.")
      .def_prop_ro("goal", [](const PlannerReference& g) { const OnlinePlanner::Reference& a = g.reference;
                     return JointGoal(a.position, a.velocity, a.acceleration); },
                   "The reference, as a goal for a GeometricSystem.")
      .def_prop_ro("places",
                   [](const PlannerReference& g) {
                     const OnlinePlanner::Reference& a = g.reference;
                     return to_numpy_matrix(a.places.leftCols(a.num_places).transpose());
                   },
                   "Waypoints (k, nv) where activation distances shrink: narrow places of the path that the arm is about to\n"
                   "pass, or the goal where there is none. See Controller.activations.")
      .def_prop_ro("arrives", [](const PlannerReference& g) { return g.reference.arrives; },
                   "Whether activation distances shrink at the goal as well: `places` are others, and the end of the path\n"
                   "is within the lead.");

  nb::class_<OnlinePlanner>(
      m, "OnlinePlanner",
      "Leads an arm to a goal by a path that is searched in the background: a reference that runs ahead on the path.\n"
      "Until there is a path the reference is the goal itself; where the straight way to the goal is free, it is the path.\n"
      "robot, body, pairs, tables: as for PathPlanner; planner: PlannerSettings, route: TimedPathSettings, None for the defaults.\n"
      "period [s]: between two looks at the scene; patience [s]: without progress the arm is stuck and another way is\n"
      "searched; retry [s]: after which a failed search is repeated; tolerance [rad]: of arrival; duration [s]: allowed\n"
      "for a motion; synchronous: search in step(), the same every time, else in a thread of its own.\n"
      "Raises ValueError that names what is wrong.")
      .def(
          "__init__",
          [](OnlinePlanner* self, const Robot& robot, const Body& body, const Pairs& pairs, std::vector<PairDistanceTable> tables,
             const std::optional<PlannerSettings>& planner, const std::optional<TimedPathSettings>& route, double period,
             double patience, double retry, double tolerance, double duration, std::uint64_t seed, bool synchronous) {
            check_fitted_to(robot, body);
            OnlinePlannerConfig s;
            s.planner = {planner.value_or(PlannerSettings{}), route.value_or(TimedPathSettings{}), period, patience, retry};
            s.tolerance = tolerance, s.duration = duration, s.seed = seed, s.synchronous = synchronous;
            new (self) OnlinePlanner(ClearanceQuery(robot, body, link_pairs(pairs), {}, std::move(tables)), s);
          },
          nb::arg("robot"), nb::arg("body"), nb::kw_only(), nb::arg("pairs") = Pairs{},
          nb::arg("tables") = std::vector<PairDistanceTable>{}, nb::arg("planner") = nb::none(),
          nb::arg("route") = nb::none(), nb::arg("period") = OnlinePlannerSettings{}.period,
          nb::arg("patience") = OnlinePlannerSettings{}.patience, nb::arg("retry") = OnlinePlannerSettings{}.retry,
          nb::arg("tolerance") = OnlinePlannerConfig{}.tolerance, nb::arg("duration") = OnlinePlannerConfig{}.duration,
          nb::arg("seed") = OnlinePlannerConfig{}.seed, nb::arg("synchronous") = OnlinePlannerConfig{}.synchronous)
      .def(
          "set_goal",
          [](OnlinePlanner& g, const ArrayLike& goal) {
            const Exclusive use(&g, "the planner");
            g.set_goal(as_finite_vector(goal, "goal", g.body().robot().num_coordinates()));
          },
          nb::arg("goal"), "A configuration (nv,) [rad] to go to; from the loop that calls step().")
      .def("set_obstacles", &OnlinePlanner::set_obstacles, nb::arg("obstacles"),
           "The obstacles as they are seen now; from any thread.")
      .def(
          "step",
          [](OnlinePlanner& g, const ArrayLike& q, double time) {
            PlannerReference guidance{OnlinePlannerStatus::idle, OnlinePlanner::Reference(g.body().robot().num_coordinates())};
            const Eigen::VectorXd at = as_vector(q, "q", g.body().robot().num_coordinates());
            const Exclusive use(&g, "the planner");
            if (!g.settings().synchronous) {
              guidance.status = g.step(at, time, guidance.reference);
              return guidance;
            }
            return interruptible([&](const Interrupted& interrupted) {
              const InterruptedWhile search(&g, interrupted);
              guidance.status = g.step(at, time, guidance.reference);
              return std::move(guidance);
            });
          },
          nb::arg("q"), nb::arg("time"), "The current reference from q (nv,) [rad] at a time [s] that does not go back.")
      .def(
          "disturbed",
          [](OnlinePlanner& g, const ArrayLike& q, const Obstacles& obstacles) {
            const Exclusive use(&g, "the planner");
            return g.disturbed(as_finite_vector(q, "q", g.body().robot().num_coordinates()), obstacles);
          },
          nb::arg("q"), nb::arg("obstacles"),
          "Whether an obstacle that moves is within 10 cm of the arm at q (nv,) [rad], or could be in a second at its\n"
          "speed, by balls around the links.")
      .def_prop_ro("plan", &OnlinePlanner::last_plan, "What the last search found.")
      .def_prop_ro("searches", [](const OnlinePlanner& g) { return g.counts().searches; }, "How often it searched.")
      .def_prop_ro("period", [](const OnlinePlanner& g) { return g.settings().planner.period; }, "[s] between two looks at the scene.");
}

}  // namespace

void bind_guidance(nb::module_& m) {
  bind_plan(m);
  bind_planner_settings(m);
  bind_guide(m);

  nb::class_<ClearanceReport>(m, "BodyClearance", "The smallest clearance of a body, and of what.")
      .def_ro("clearance", &ClearanceReport::clearance, "[m], a lower bound of the distance; not above the cap.")
      .def_prop_ro("kind", [](const ClearanceReport& r) { return r.label.kind; })
      .def_prop_ro("link", [](const ClearanceReport& r) { return r.label.name; }, "Empty where nothing is nearer than the cap.")
      .def_prop_ro("other", [](const ClearanceReport& r) { return r.label.other; }, "The other link of a pair.")
      .def_ro("point", &ClearanceReport::point, "Which obstacle point; -1: none.");

  nb::class_<PathPlanner>(
      m, "PathPlanner",
      "Plans a path of a covering body among obstacle points: the straight edge if it is free, else RRT-Connect\n"
      "(Kuffner and LaValle 2000), widened where there is room, and shortened. Deterministic in (start, goal, obstacles,\n"
      "seed) unless time runs out.\n"
      "Edges are proven free by bounds of how far the body moves, so that nothing thin is skipped.\n"
      "robot; body: calibrated (Body.cover); pairs: links that must not touch, as for SelfCollisionBarrier; tables: of other\n"
      "pairs, as for ClearanceTableBarrier; settings: a PlannerSettings, None for the defaults. Raises ValueError that names what is wrong.")
      .def(
          "__init__",
          [](PathPlanner* self, const Robot& robot, const Body& body, const Pairs& pairs, std::vector<PairDistanceTable> tables,
             const std::optional<PlannerSettings>& settings) {
            check_fitted_to(robot, body);
            new (self) PathPlanner(robot, body, pairs, std::move(tables), settings.value_or(PlannerSettings{}));
          },
          nb::arg("robot"), nb::arg("body"), nb::kw_only(), nb::arg("pairs") = Pairs{},
          nb::arg("tables") = std::vector<PairDistanceTable>{}, nb::arg("settings") = nb::none())
      .def(
          "plan",
          [](PathPlanner& p, const ArrayLike& start, const ArrayLike& goal, const Obstacles& obstacles,
             std::uint64_t seed) {
            const Eigen::VectorXd from = p.configuration(start, "start"), to = p.configuration(goal, "goal");
            const Exclusive use(&p, "the planner");
            const HeldObstacles held(obstacles);
            return interruptible([&](const Interrupted& interrupted) {
              const InterruptedWhile search(&p.planner(), interrupted);
              return p.planner().plan(from, to, held, seed);
            });
          },
          nb::arg("start"), nb::arg("goal"), nb::arg("obstacles"), nb::kw_only(), nb::arg("seed") = 0,
          "A path from start (nv,) to goal (nv,) [rad] among the obstacles where they are now.")
      .def(
          "clearance",
          [](PathPlanner& p, const ArrayLike& q, const Obstacles& obstacles, double cap) {
            const Exclusive use(&p, "the planner");
            const ClearanceQuery::Nearest n =
                p.body().nearest(p.configuration(q, "q"), obstacles, cap, p.planner().workspace());
            return ClearanceReport{n.clearance, n.item < 0 ? CoordinateLabel{} : p.body().label(n.item), n.point};
          },
          nb::arg("q"), nb::arg("obstacles"), nb::kw_only(), nb::arg("cap") = 1.0,
          "The smallest clearance at q (nv,), not above cap [m], and of what.")
      .def(
          "is_free",
          [](PathPlanner& p, const ArrayLike& q, const Obstacles& obstacles, std::optional<double> margin) {
            const Exclusive use(&p, "the planner");
            return p.body().free(p.configuration(q, "q"), obstacles, p.margins(margin),
                                 p.planner().workspace());
          },
          nb::arg("q"), nb::arg("obstacles"), nb::kw_only(), nb::arg("margin") = nb::none(),
          "Whether everything keeps the margin [m] (by default the planner's) at q (nv,).")
      .def(
          "is_edge_free",
          [](PathPlanner& p, const ArrayLike& a, const ArrayLike& b, const Obstacles& obstacles,
             std::optional<double> margin) {
            const Exclusive use(&p, "the planner");
            return p.body().edge_free(p.configuration(a, "a"), p.configuration(b, "b"), obstacles,
                                      p.margins(margin), p.planner().workspace());
          },
          nb::arg("a"), nb::arg("b"), nb::arg("obstacles"), nb::kw_only(), nb::arg("margin") = nb::none(),
          "Whether everything keeps the margin [m], less the slack, everywhere on the straight edge from a to b (nv,).");
}

}  // namespace sidestep::python

#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <optional>

#include "arguments.hpp"
#include "module.hpp"
#include "sidestep/guidance/rrt_connect.hpp"

namespace sidestep::python {
namespace {

using Pairs = std::vector<std::pair<std::string, std::string>>;

/// A planner with the body it searches for.
class PathPlanner {
 public:
  PathPlanner(const Robot& robot, const Body& body, const Pairs& pairs, const PlannerSettings& settings)
      : body_(robot, body, pairs), planner_(body_, settings) {}
  PathPlanner(const PathPlanner&) = delete;
  PathPlanner& operator=(const PathPlanner&) = delete;

  Eigen::VectorXd configuration(nb::handle value, const char* name) const {
    return as_finite_vector(value, name, body_.robot().num_coordinates());
  }
  Margins margins(std::optional<double> margin) const {
    const PlannerSettings& s = planner_.settings();
    return {margin.value_or(s.margin), s.slack, s.fade, {}};
  }
  const BodyClearance& body() const { return body_; }
  RrtConnect& planner() { return planner_; }

 private:
  BodyClearance body_;
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
      .value("no_path", PlanStatus::no_path, "None within the budget of nodes.")
      .value("timeout", PlanStatus::timeout, "None within the budget of time.")
      .value("start_in_collision", PlanStatus::start_in_collision, "See Plan.obstruction.")
      .value("goal_in_collision", PlanStatus::goal_in_collision, "See Plan.obstruction.")
      .value("invalid", PlanStatus::invalid, "Start or goal is outside the position limits.");

  nb::class_<Obstruction>(m, "Obstruction",
                          "What is in the way at an end of a motion: link, the other link of a pair, or which obstacle\n"
                          "point (-1: none), and depth [m], how far the covering ellipsoids reach into it.")
      .def_prop_ro("kind", [](const Obstruction& o) { return o.label.kind; })
      .def_prop_ro("link", [](const Obstruction& o) { return o.label.name; })
      .def_prop_ro("other", [](const Obstruction& o) { return o.label.other; })
      .def_ro("point", &Obstruction::point)
      .def_ro("depth", &Obstruction::depth)
      .def("__str__", [](const Obstruction& o) { return describe(o); });

  nb::class_<Plan>(m, "Plan", "A path, or why there is none.")
      .def_ro("status", &Plan::status)
      .def_prop_ro("path", [](const Plan& p) { return to_numpy_matrix(p.path.transpose()); },
                   "(W, nv) waypoints from start to goal, straight between them; empty unless found.")
      .def_prop_ro("length", [](const Plan& p) { return length(p.path); }, "Sum of |dq| [rad | m].")
      .def_ro("margin", &Plan::margin, "[m] that the path keeps, but for its ends.")
      .def_ro("obstruction", &Plan::obstruction, "What is in the way at a start or goal in collision.")
      .def_ro("nodes", &Plan::nodes, "Of both trees.")
      .def_ro("iterations", &Plan::iterations)
      .def_ro("search_seconds", &Plan::search_seconds, "[s] until a path was found, or given up.")
      .def_ro("smoothing_seconds", &Plan::smoothing_seconds, "[s] to make it short.");
}

}  // namespace

void bind_guidance(nb::module_& m) {
  bind_plan(m);

  nb::class_<ClearanceReport>(m, "BodyClearance", "The smallest clearance of a body, and of what.")
      .def_ro("clearance", &ClearanceReport::clearance, "[m], a lower bound of the distance; not above the cap.")
      .def_prop_ro("kind", [](const ClearanceReport& r) { return r.label.kind; })
      .def_prop_ro("link", [](const ClearanceReport& r) { return r.label.name; }, "Empty where nothing is nearer than the cap.")
      .def_prop_ro("other", [](const ClearanceReport& r) { return r.label.other; }, "The other link of a pair.")
      .def_ro("point", &ClearanceReport::point, "Which obstacle point; -1: none.");

  nb::class_<PathPlanner>(
      m, "PathPlanner",
      "Plans a path of a covering body among obstacle points: the straight edge if it is free, else RRT-Connect\n"
      "(Kuffner and LaValle 2000), shortened. Deterministic in (start, goal, obstacles, seed) unless time runs out.\n"
      "Edges are proven free by bounds of how far the body moves, so that nothing thin is skipped.\n"
      "robot; body: calibrated (Body.cover); pairs: names of links that must not touch, see presets.barrier_pairs.\n"
      "margin [m]: clearance asked for at first; floor [m]: where there is no path with it. allowance [m]: how deep\n"
      "ellipsoids, larger than links, may be in something at start and goal; fade [m]: motion within which an end's\n"
      "smaller margin fades. range [rad]: longest edge of the trees. max_nodes, max_iterations, max_seconds: the budget.\n"
      "shortcuts: attempts to shorten. Raises ValueError that names the setting at fault.")
      .def(
          "__init__",
          [](PathPlanner* self, const Robot& robot, const Body& body, const Pairs& pairs, double margin, double floor,
             double allowance, double slack, double fade, double range, int max_nodes, int max_iterations,
             double max_seconds, int shortcuts) {
            check_fitted_to(robot, body);
            PlannerSettings s{margin, floor, allowance, slack, fade, range, max_nodes, max_iterations, max_seconds,
                              shortcuts};
            s.validate();
            new (self) PathPlanner(robot, body, pairs, s);
          },
          nb::arg("robot"), nb::arg("body"), nb::kw_only(), nb::arg("pairs") = Pairs{},
          nb::arg("margin") = PlannerSettings{}.margin, nb::arg("floor") = PlannerSettings{}.floor,
          nb::arg("allowance") = PlannerSettings{}.allowance, nb::arg("slack") = PlannerSettings{}.slack,
          nb::arg("fade") = PlannerSettings{}.fade, nb::arg("range") = PlannerSettings{}.range,
          nb::arg("max_nodes") = PlannerSettings{}.max_nodes,
          nb::arg("max_iterations") = PlannerSettings{}.max_iterations,
          nb::arg("max_seconds") = PlannerSettings{}.max_seconds, nb::arg("shortcuts") = PlannerSettings{}.shortcuts)
      .def(
          "plan",
          [](PathPlanner& p, const ArrayLike& start, const ArrayLike& goal, const Obstacles& obstacles,
             std::uint64_t seed) {
            const Eigen::VectorXd from = p.configuration(start, "start"), to = p.configuration(goal, "goal");
            const nb::gil_scoped_release release;
            return p.planner().plan(from, to, PointIndex(obstacles), seed);
          },
          nb::arg("start"), nb::arg("goal"), nb::arg("obstacles"), nb::kw_only(), nb::arg("seed") = 0,
          "A path from start (nv,) to goal (nv,) [rad] among the obstacles where they are now.")
      .def(
          "clearance",
          [](PathPlanner& p, const ArrayLike& q, const Obstacles& obstacles, double cap) {
            const BodyClearance::Nearest n =
                p.body().nearest(p.configuration(q, "q"), PointIndex(obstacles), cap, p.planner().workspace());
            return ClearanceReport{n.clearance, n.item < 0 ? CoordinateLabel{} : p.body().label(n.item), n.point};
          },
          nb::arg("q"), nb::arg("obstacles"), nb::kw_only(), nb::arg("cap") = 1.0,
          "The smallest clearance at q (nv,), not above cap [m], and of what.")
      .def(
          "is_free",
          [](PathPlanner& p, const ArrayLike& q, const Obstacles& obstacles, std::optional<double> margin) {
            return p.body().free(p.configuration(q, "q"), PointIndex(obstacles), p.margins(margin),
                                 p.planner().workspace());
          },
          nb::arg("q"), nb::arg("obstacles"), nb::kw_only(), nb::arg("margin") = nb::none(),
          "Whether everything keeps the margin [m] (by default the planner's) at q (nv,).")
      .def(
          "is_edge_free",
          [](PathPlanner& p, const ArrayLike& a, const ArrayLike& b, const Obstacles& obstacles,
             std::optional<double> margin) {
            return p.body().edge_free(p.configuration(a, "a"), p.configuration(b, "b"), PointIndex(obstacles),
                                      p.margins(margin), p.planner().workspace());
          },
          nb::arg("a"), nb::arg("b"), nb::arg("obstacles"), nb::kw_only(), nb::arg("margin") = nb::none(),
          "Whether everything keeps the margin [m], less the slack, everywhere on the straight edge from a to b (nv,).");
}

}  // namespace sidestep::python

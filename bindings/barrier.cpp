#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <limits>
#include <stdexcept>
#include <string>

#include "arguments.hpp"
#include "module.hpp"
#include "sidestep/attractor/clearance_barrier.hpp"
#include "sidestep/attractor/joint_limit_barrier.hpp"
#include "sidestep/math/instruction_set.hpp"
#include "sidestep/math/multiply_add_rate.hpp"

namespace sidestep::python {
void check_fitted_to(const Robot& robot, const Body& body) {
  const auto text = [](const nb::object& owner, const char* name) {
    return nb::hasattr(owner, name) ? nb::cast<std::string>(owner.attr(name)) : std::string();
  };
  const nb::object body_object = nb::find(body), robot_object = nb::find(robot);
  const std::string fitted_to = text(body_object, "fingerprint");
  if (fitted_to.empty()) {
    return;
  }
  const std::string here = text(robot_object, "fingerprint");
  if (!here.empty() && fitted_to != here) {
    throw std::invalid_argument("the body was fitted to robot '" + text(body_object, "robot_name") +
                                "' (fingerprint " + fitted_to.substr(0, 12) + ") and cannot be used with robot '" +
                                robot.name() + "' (fingerprint " + here.substr(0, 12) +
                                "); their kinematic structure or geometry differs");
  }
}

void bind_embedding(nb::module_& m) {
  m.def("multiply_add_rate", &multiply_add_rate, nb::arg("duration") = 0.2,
        "Floating-point operations a second of one core that does nothing but multiply and add doubles in the widest\n"
        "registers, at most within `duration` [s]. Raises ValueError unless that is positive and finite.");
  m.def("instruction_set", [] { return std::string(name(instruction_set())); },
        "What the inner loops over points run with on this machine: \"avx512\", \"avx2\" or \"baseline\".");

  nb::class_<EmbeddingEvaluation>(m, "EmbeddingEvaluation", "Values, Jacobian and curvatures of an embedding.")
      .def_prop_ro("values", [](const EmbeddingEvaluation& e) { return to_numpy(e.values); }, "psi (m,).")
      .def_prop_ro("jacobian", [](const EmbeddingEvaluation& e) { return to_numpy_matrix(e.jacobian); },
                   "dpsi/dq (m, nv).")
      .def_prop_ro("curvatures", [](const EmbeddingEvaluation& e) { return to_numpy(e.curvatures); },
                   "d2psi/dt2 (m,) along the motion with constant joint velocity.")
      .def_prop_ro("clearances", [](const EmbeddingEvaluation& e) { return to_numpy(e.clearances.values); },
                   "h (m,) [m] where the coordinates are barriers of clearances; inf beyond their reach.")
      .def_prop_ro("clearance_rates", [](const EmbeddingEvaluation& e) { return to_numpy(e.clearances.rates); },
                   "dh/dt (m,) [m/s].")
      .def_prop_ro("clearance_curvatures",
                   [](const EmbeddingEvaluation& e) { return to_numpy(e.clearances.curvatures); },
                   "d2h/dt2 (m,) [m/s^2] along the motion with constant joint velocity.")
      .def_prop_ro("clearance_gradients",
                   [](const EmbeddingEvaluation& e) { return to_numpy_matrix(e.clearances.gradients.transpose()); },
                   "dh/dq (m, nv) [m/rad].");

  nb::class_<Embedding>(m, "Embedding",
                        "Extra coordinates psi(q, t) that embed the joint space as the graph q -> (q, psi(q, t)).")
      .def_prop_ro("num_coordinates", &Embedding::num_coordinates, "Number of coordinates m.")
      .def(
          "evaluate",
          [](const Embedding& e, const ArrayLike& q, const ArrayLike& v, const Obstacles& obstacles) {
            const int nv = e.robot().num_coordinates();
            return evaluate(e, as_finite_vector(q, "q", nv), as_finite_vector(v, "v", nv), obstacles);
          },
          nb::arg("q"), nb::arg("v"), nb::arg("obstacles"),
          "psi, dpsi/dq and d2psi/dt2 at q (nv,) [rad] and v (nv,) [rad/s], obstacle velocities included.")
      .def(
          "hessian",
          [](const Embedding& e, const ArrayLike& q, const Obstacles& obstacles) -> NumpyArray {
            const auto all = hessians(e, as_finite_vector(q, "q", e.robot().num_coordinates()), obstacles);
            if (all.size() == 1) {
              return to_numpy_matrix(all.front());
            }
            nb::list arrays;
            for (const Eigen::MatrixXd& hessian : all) {
              arrays.append(to_numpy_matrix(hessian));
            }
            return nb::cast<NumpyArray>(nb::module_::import_("numpy").attr("stack")(arrays));
          },
          nb::arg("q"), nb::arg("obstacles"),
          "d2psi/dq2, (nv, nv) where m = 1, else (m, nv, nv); exact. For tests and plots, not for the loop.");

  nb::class_<ClearanceBarrier, Embedding>(
      m, "ClearanceBarrier",
      "One coordinate per covering ellipsoid of the body, a barrier of its clearance h_k to the obstacles,\n"
      "    psi_k = strength (activation / h_k - 1)^power  for h_k < activation, else 0.\n"
      "activation [m]: where it begins; larger reacts earlier and gentler, and closes narrow passages.\n"
      "strength: larger turns the motion away earlier within that distance. power >= 2: larger stays flat longer\n"
      "and rises steeper. floor [m]: below it psi goes on along its tangent. temperature [m]: smoothing between\n"
      "neighbouring points. reach [m]: clearances are measured up to here, at least to the activation distance. More\n"
      "costs time; it is for who wants to see them. What\n"
      "approaches is seen from as far as the arm needs to stop. window [temperatures]: points that are farther than\n"
      "the nearest by more do not count, each of which would change the mean by window exp(-window) temperature at most,\n"
      "2e-7 m; fewer cost less. The body must be calibrated (Body.cover); raises ValueError that names what is wrong.")
      .def(
          "__init__",
          [](ClearanceBarrier* self, const Robot& robot, const Body& body, double activation, double strength,
             double power, double floor, double temperature, double reach, double window) {
            check_fitted_to(robot, body);
            new (self) ClearanceBarrier(robot, body, {activation, strength, power, floor}, temperature, reach, window);
          },
          nb::arg("robot"), nb::arg("body"), nb::kw_only(), nb::arg("activation") = 0.10, nb::arg("strength") = 0.1,
          nb::arg("power") = 2.0, nb::arg("floor") = 0.002, nb::arg("temperature") = 0.002,
          nb::arg("reach") = 0.0, nb::arg("window") = ClearanceField::default_window)
      .def_prop_ro("activation", [](const ClearanceBarrier& b) { return b.function().activation; })
      .def_prop_ro("reach", &ClearanceBarrier::reach)
      .def_prop_ro("components",
                   [](const ClearanceBarrier& b) {
                     std::vector<int> components;
                     const auto& field = dynamic_cast<const ClearanceField&>(b.group());
                     for (int k = 0; k < field.size(); ++k) {
                       components.push_back(field.component(k));
                     }
                     return components;
                   },
                   "Which component of the body each coordinate belongs to.");

  nb::class_<JointLimitBarrier, Embedding>(
      m, "JointLimitBarrier",
      "One coordinate per finite position limit, a barrier of the way h [rad | m] left to it, as in ClearanceBarrier. The\n"
      "activation distance of a sliding joint is at most a twentieth of its range, its floor shorter by the same share.")
      .def(
          "__init__",
          [](JointLimitBarrier* self, const Robot& robot, double activation, double strength, double power,
             double floor) {
            new (self) JointLimitBarrier(robot, {activation, strength, power, floor});
          },
          nb::arg("robot"), nb::kw_only(), nb::arg("activation") = 0.1, nb::arg("strength") = 0.02,
          nb::arg("power") = 2.0, nb::arg("floor") = 0.002);

  nb::class_<SelfCollisionBarrier, Embedding>(
      m, "SelfCollisionBarrier",
      "One coordinate per pair of links, a barrier of the clearance between their covering ellipsoids: their\n"
      "distance, or minus their depth, less the gap at which the links touch. pairs: (first, second) or\n"
      "(first, second, contact), names of links and that gap [m], see link_pairs.barrier_pairs. Other parameters as in\n"
      "ClearanceBarrier.")
      .def(
          "__init__",
          [](SelfCollisionBarrier* self, const Robot& robot, const Body& body, const Pairs& pairs, double activation,
             double strength, double power, double floor, double temperature, double reach) {
            check_fitted_to(robot, body);
            new (self) SelfCollisionBarrier(robot, body, link_pairs(pairs), {activation, strength, power, floor},
                                            temperature, reach);
          },
          nb::arg("robot"), nb::arg("body"), nb::arg("pairs"), nb::kw_only(), nb::arg("activation") = 0.05,
          nb::arg("strength") = 0.02, nb::arg("power") = 2.0, nb::arg("floor") = 0.002,
          nb::arg("temperature") = 0.002, nb::arg("reach") = 0.0);

  nb::class_<PairDistanceTable>(
      m, "ClearanceTable",
      "The clearance h [m] of two links that only two coordinates x, y [rad | m] move relative to each other, as a\n"
      "function of these: a uniform cubic B-spline in either, h(x, y) = sum_ij B_i(x) B_j(y) control[i, j]. Control\n"
      "point i is at begin + i spacing; beyond the ends h and its derivatives stay as they are there, and where\n"
      "periodic the points span one turn. first, second: names of the links; coordinates, begin, spacing, periodic: two\n"
      "each; control (n, m) [m], at least 4 each. Raises ValueError that names what is wrong.")
      .def(
          "__init__",
          [](PairDistanceTable* self, std::string first, std::string second, std::array<int, 2> coordinates,
             std::array<double, 2> begin, std::array<double, 2> spacing, std::array<bool, 2> periodic,
             const ArrayLike& control) {
            new (self) PairDistanceTable{std::move(first), std::move(second),
                                      {{{coordinates[0], begin[0], spacing[0], periodic[0]},
                                        {coordinates[1], begin[1], spacing[1], periodic[1]}}},
                                      as_matrix(control, "control", -1, -1)};
            self->validate(std::numeric_limits<int>::max());
          },
          nb::arg("first"), nb::arg("second"), nb::kw_only(), nb::arg("coordinates"), nb::arg("begin"),
          nb::arg("spacing"), nb::arg("periodic"), nb::arg("control"))
      .def_ro("first", &PairDistanceTable::first)
      .def_ro("second", &PairDistanceTable::second)
      .def_prop_ro("coordinates",
                   [](const PairDistanceTable& t) { return std::pair(t.axes[0].coordinate, t.axes[1].coordinate); })
      .def_prop_ro("begin", [](const PairDistanceTable& t) { return std::pair(t.axes[0].begin, t.axes[1].begin); })
      .def_prop_ro("spacing", [](const PairDistanceTable& t) { return std::pair(t.axes[0].spacing, t.axes[1].spacing); })
      .def_prop_ro("periodic",
                   [](const PairDistanceTable& t) { return std::pair(t.axes[0].periodic, t.axes[1].periodic); })
      .def_prop_ro("control", [](const PairDistanceTable& t) { return to_numpy_matrix(t.control); }, "(n, m) [m].")
      .def(
          "at",
          [](const PairDistanceTable& t, double x, double y) {
            const PairDistanceTable::Sample h = t.at(x, y);
            return std::tuple(h.value, to_numpy(h.gradient), to_numpy_matrix(h.hessian));
          },
          nb::arg("x"), nb::arg("y"), "h [m], its gradient (2,) and Hessian (2, 2) by x and y.");

  nb::class_<PairDistanceTableBarrier, Embedding>(
      m, "ClearanceTableBarrier",
      "One coordinate per table, a barrier of the clearance it holds: self-collision of links with two joints between\n"
      "them, see sidestep.arm.clearance_tables. Other parameters as in ClearanceBarrier.")
      .def(
          "__init__",
          [](PairDistanceTableBarrier* self, const Robot& robot, std::vector<PairDistanceTable> tables, double activation,
             double strength, double power, double floor, double reach) {
            new (self) PairDistanceTableBarrier(robot, std::move(tables), {activation, strength, power, floor}, reach);
          },
          nb::arg("robot"), nb::arg("tables"), nb::kw_only(), nb::arg("activation") = 0.05, nb::arg("strength") = 0.02,
          nb::arg("power") = 2.0, nb::arg("floor") = 0.002, nb::arg("reach") = 0.0);

  nb::class_<PlaneBarrier, Embedding>(
      m, "PlaneBarrier",
      "One coordinate per link, a barrier of its clearance to a plane (a floor, a table, a wall). point (3,) [m] on\n"
      "the plane, normal (3,) to the free side, in the world; other parameters as in ClearanceBarrier.")
      .def(
          "__init__",
          [](PlaneBarrier* self, const Robot& robot, const Body& body, const ArrayLike& point, const ArrayLike& normal,
             const std::vector<std::string>& links, double activation, double strength, double power, double floor,
             double temperature, double reach) {
            check_fitted_to(robot, body);
            new (self) PlaneBarrier(robot, body, {as_vector(point, "point", 3), as_vector(normal, "normal", 3), links},
                                    {activation, strength, power, floor}, temperature, reach);
          },
          nb::arg("robot"), nb::arg("body"), nb::kw_only(), nb::arg("point"), nb::arg("normal"), nb::arg("links"),
          nb::arg("activation") = 0.05, nb::arg("strength") = 0.02, nb::arg("power") = 2.0, nb::arg("floor") = 0.002,
          nb::arg("temperature") = 0.002, nb::arg("reach") = 0.0);
}

}  // namespace sidestep::python

#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include "arguments.hpp"
#include "module.hpp"
#include "sidestep/dynamical_system/rollout.hpp"

namespace sidestep::python {
namespace {

/// What Python gets from a step: the workspace as it was when the step ended.
struct Step {
  StepStatus status;
  GeometricSystem::Workspace result;
};

/// An enumerator, or its name; raises ValueError that lists the allowed names.
template <class Enum>
Enum as_enum(nb::handle value, const char* name) {
  Enum result{};
  if (nb::try_cast<Enum>(value, result)) {
    return result;
  }
  const nb::object members = nb::type<Enum>().attr("__members__");
  if (nb::isinstance<nb::str>(value) && nb::cast<bool>(members.attr("__contains__")(value))) {
    return nb::cast<Enum>(members[value]);
  }
  const std::string allowed = nb::cast<std::string>(nb::str(", ").attr("join")(members));
  throw nb::value_error((std::string(name) + " is " + nb::repr(value).c_str() + ", must be one of: " + allowed).c_str());
}

Switch as_switch(nb::handle value) { return value.is_none() ? Switch{Unswitched{}} : nb::cast<Switch>(value); }

template <class Class, class Member>
void matrix_property(nb::class_<Class>& c, const char* name, Member member, const char* doc) {
  c.def_prop_ro(name, [member](const Class& r) { return to_numpy_matrix(r.*member); }, doc);
}

void bind_switches(nb::module_& m) {
  nb::class_<Unswitched>(m, "Unswitched", "a = h + g (T2.12).").def(nb::init<>());
  nb::class_<HarmonicOnly>(m, "HarmonicOnly", "a = h, the damped spring alone.").def(nb::init<>());
  nb::class_<GeodesicOnly>(m, "GeodesicOnly", "a = g, free fall along a geodesic (T5.3); it knows no goal.")
      .def(nb::init<>());
  nb::class_<BinarySwitch>(m, "BinarySwitch", "a = s h + (1 - s) g with s = [psi <= threshold] (T5.5, T5.6).")
      .def(nb::init<double>(), nb::arg("threshold"))
      .def_ro("threshold", &BinarySwitch::threshold);
  nb::class_<SigmoidSwitch>(m, "SigmoidSwitch",
                            "The same with s = 1 - 1/(1 + exp(-slope (psi - threshold))) (thesis 6.1.1).")
      .def(nb::init<double, double>(), nb::arg("threshold"), nb::arg("slope"))
      .def_ro("threshold", &SigmoidSwitch::threshold)
      .def_ro("slope", &SigmoidSwitch::slope);
  nb::class_<DistanceSwitch>(
      m, "DistanceSwitch",
      "The same joint by joint, s_i = 1/(1 + exp(-slope (d_i - threshold_i))) (T6.1, T6.2), where d_i [m] is the\n"
      "smallest distance between the obstacles and the Gaussian means on the link that joint i carries.")
      .def(
          "__init__",
          [](DistanceSwitch* self, const ArrayLike& thresholds, double slope) {
            new (self) DistanceSwitch{as_vector(thresholds, "thresholds"), slope};
          },
          nb::arg("thresholds"), nb::arg("slope"))
      .def_prop_ro("thresholds", [](const DistanceSwitch& s) { return to_numpy(s.thresholds); })
      .def_ro("slope", &DistanceSwitch::slope);
}

void bind_step(nb::module_& m) {
  nb::enum_<StepStatus>(m, "StepStatus", "What a step of the system says about its result.")
      .value("ok", StepStatus::ok, "The equations hold.")
      .value("outside_limits", StepStatus::outside_limits, "They hold, but a joint is outside its position limits.")
      .value("goal_outside_limits", StepStatus::goal_outside_limits, "Fallback: the goal is outside the limits.")
      .value("invalid_state", StepStatus::invalid_state, "Fallback: q or v is not finite.")
      .value("invalid_goal", StepStatus::invalid_goal, "Fallback: the goal is not finite.")
      .value("not_finite", StepStatus::not_finite, "Fallback: the equations gave a value that is not finite.");
  m.def("is_fallback", &is_fallback, nb::arg("status"),
        "Whether the acceleration is the fallback: a damped stop within the acceleration limits.");

  nb::class_<Step>(m, "Step", "The result of one step; arrays are copies.")
      .def_ro("status", &Step::status)
      .def_prop_ro("acceleration", [](const Step& s) { return to_numpy(s.result.acceleration); }, "a (nv,) [rad/s^2].")
      .def_prop_ro("harmonic", [](const Step& s) { return to_numpy(s.result.harmonic); }, "h (nv,) [rad/s^2].")
      .def_prop_ro("geodesic", [](const Step& s) { return to_numpy(s.result.geodesic); }, "g (nv,) [rad/s^2].")
      .def_prop_ro("switch", [](const Step& s) { return to_numpy(s.result.switch_weights); },
                   "Weights s (nv,) of the harmonic part.")
      .def_prop_ro("values", [](const Step& s) { return to_numpy(s.result.values); }, "psi (m,).")
      .def_prop_ro("curvatures", [](const Step& s) { return to_numpy(s.result.curvatures); }, "d2psi/dt2 (m,).")
      .def_prop_ro("jacobian",
                   [](const Step& s) { return to_numpy_matrix(s.result.jacobian_transposed.transpose()); },
                   "dpsi/dq (m, nv).")
      .def_prop_ro("clearances", [](const Step& s) { return s.result.clearances; },
                   "Clearances of the coordinates that are barriers of them (m).")
      .def_prop_ro("metric", [](const Step& s) { return to_numpy_matrix(s.result.metric.matrix()); },
                   "G = I + J^T J (nv, nv).");
}

void bind_rollout(nb::module_& m) {
  nb::enum_<Integrator>(m, "Integrator", "How a step of length dt is taken.")
      .value("semi_implicit_euler", Integrator::semi_implicit_euler, "v += a dt; q += v dt.")
      .value("second_order", Integrator::second_order, "q += v dt + a dt^2/2; v += a dt (thesis 6.2.1).")
      .value("runge_kutta_4", Integrator::runge_kutta_4, "The classical scheme, with the obstacles moved along.");

  nb::class_<Rollout> result(m, "Rollout", "A kinematic motion: row k is at time k dt, steps + 1 rows.");
  result.def_prop_ro("time", [](const Rollout& r) { return to_numpy(r.time); }, "[s]")
      .def_ro("statuses", &Rollout::statuses, "One StepStatus per row.")
      .def_prop_ro("step_seconds", [](const Rollout& r) { return to_numpy(r.step_seconds); },
                   "(steps + 1,) wall time [s] of the acceleration of each row; empty without time_steps.")
      .def_ro("filter_statuses", &Rollout::filter_statuses, "One TorqueStatus per row; empty without a filter.")
      .def_prop_ro("safety_slack", [](const Rollout& r) { return to_numpy(r.safety_slack); },
                   "(steps + 1,) largest shortfall of a clearance's constraint [m/s^2]; empty without a filter.");
  matrix_property(result, "q", &Rollout::q, "(steps + 1, nv) [rad]");
  matrix_property(result, "v", &Rollout::v, "(steps + 1, nv) [rad/s]");
  matrix_property(result, "acceleration", &Rollout::acceleration, "(steps + 1, nv) [rad/s^2]");
  matrix_property(result, "values", &Rollout::values, "psi (steps + 1, m)");
  matrix_property(result, "switch", &Rollout::switch_weights, "Weights of the harmonic part (steps + 1, nv)");

  m.def(
      "rollout",
      [](const GeometricSystem& system, const ArrayLike& q, const ArrayLike& v, const ArrayLike& goal, const Obstacles& obstacles,
         double period, int steps, nb::handle integrator, bool time_steps, const AccelerationFilter* filter) {
        const int nv = system.robot().num_coordinates();
        const Eigen::VectorXd start = as_vector(q, "q", nv);
        const Eigen::VectorXd velocity = as_vector(v, "v", nv);
        const Eigen::VectorXd target = as_vector(goal, "goal", nv);
        RolloutSettings settings{period, steps, as_enum<Integrator>(integrator, "integrator"), time_steps};
        if (filter != nullptr) {
          settings.filter = *filter;
        }
        nb::gil_scoped_release release;
        return rollout(system, start, velocity, target, obstacles, settings);
      },
      nb::arg("system"), nb::arg("q"), nb::arg("v"), nb::arg("goal"), nb::arg("obstacles"), nb::kw_only(),
      nb::arg("period") = 0.001, nb::arg("steps"), nb::arg("integrator") = "semi_implicit_euler",
      nb::arg("time_steps") = false, nb::arg("filter") = nb::none(),
      nb::sig("def rollout(system: GeometricSystem, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, "
              "goal: numpy.typing.ArrayLike, obstacles: Obstacles, *, period: float = 0.001, steps: int, "
              "integrator: Integrator | str = 'semi_implicit_euler', time_steps: bool = False, "
              "filter: AccelerationFilter | None = None) -> Rollout"),
      "Integrates the system from q, v (nv,) towards goal (nv,), obstacles moving at their velocities.\n"
      "period dt [s]; integrator: an Integrator or its name; time_steps: measure every step, see step_seconds;\n"
      "filter: what the acceleration passes before it is applied, of the same period, not with runge_kutta_4.");
}

}  // namespace

void bind_dynamical_system(nb::module_& m) {
  nb::enum_<DampingForm>(m, "DampingForm", "Where damping acts.")
      .value("plain", DampingForm::plain, "h = -G^-1 K (q - q*) - D v (T5.4).")
      .value("metric", DampingForm::metric, "h = -G^-1 (K (q - q*) + D v) (T2.12).");
  bind_switches(m);
  bind_step(m);

  nb::class_<GeometricSystem>(
      m, "GeometricSystem",
      "A damped spring that moves on the graph of psi: obstacles bend its path (Bosc 2024, chapter 5),\n"
      "    h = -G^-1 K (q - q*) - D v,   g = -G^-1 J^T d2psi/dt2,   a = h + g or as the switch weighs them.\n"
      "Embeddings in the list are stacked, each with its own coordinates; an empty list and robot=... give flat\n"
      "space.\n"
      "stiffness K [1/s^2] and damping D [1/s]: scalar, (nv,) diagonal or (nv, nv), symmetric positive\n"
      "semi-definite. damping_form: a DampingForm or its name. switch: None (unswitched) or one of the switches.\n"
      "Raises ValueError that names the setting at fault.")
      .def(
          "__init__",
          [](GeometricSystem* self, std::vector<std::shared_ptr<const Embedding>> embeddings, const ArrayLike& stiffness,
             const ArrayLike& damping, nb::handle damping_form, nb::handle combination, nb::handle flat) {
            if (embeddings.empty() == flat.is_none()) {
              throw nb::value_error(
                  "give either embeddings, which know their robot, or an empty list and robot=... for flat space");
            }
            const Robot& robot = embeddings.empty() ? nb::cast<const Robot&>(flat) : embeddings.front()->robot();
            const int nv = robot.num_coordinates();
            GeometricSystemSettings settings{as_square_matrix(stiffness, "stiffness", nv),
                                             as_square_matrix(damping, "damping", nv),
                                             as_enum<DampingForm>(damping_form, "damping_form"),
                                             as_switch(combination)};
            new (self) GeometricSystem(robot, std::move(embeddings), std::move(settings));
          },
          nb::arg("embeddings"), nb::kw_only(), nb::arg("stiffness") = 0.5, nb::arg("damping") = 1.5,
          nb::arg("damping_form") = "plain", nb::arg("switch") = nb::none(), nb::arg("robot") = nb::none(),
          nb::sig("def __init__(self, embeddings: Sequence[Embedding], *, stiffness: numpy.typing.ArrayLike = 0.5, "
                  "damping: numpy.typing.ArrayLike = 1.5, damping_form: DampingForm | str = 'plain', "
                  "switch: Unswitched | HarmonicOnly | GeodesicOnly | BinarySwitch | SigmoidSwitch | DistanceSwitch "
                  "| None = None, robot: Robot | None = None) -> None"))
      .def_prop_ro("num_embedding_coordinates", &GeometricSystem::num_embedding_coordinates)
      .def_prop_ro("stiffness", [](const GeometricSystem& s) { return to_numpy_matrix(s.settings().stiffness); })
      .def_prop_ro("damping", [](const GeometricSystem& s) { return to_numpy_matrix(s.settings().damping); })
      .def_prop_ro("damping_form", [](const GeometricSystem& s) { return s.settings().damping_form; })
      .def_prop_ro("switch", [](const GeometricSystem& s) { return s.settings().combination; })
      .def(
          "acceleration",
          [](const GeometricSystem& system, const ArrayLike& q, const ArrayLike& v, const ArrayLike& goal,
             const Obstacles& obstacles) {
            const int nv = system.robot().num_coordinates();
            Step step{StepStatus::ok, GeometricSystem::Workspace(system)};
            step.status = system.acceleration(as_vector(q, "q", nv), as_vector(v, "v", nv),
                                              as_vector(goal, "goal", nv), obstacles, step.result);
            return step;
          },
          nb::arg("q"), nb::arg("v"), nb::arg("goal"), nb::arg("obstacles"),
          "One step at q, v (nv,) [rad, rad/s] towards goal (nv,). Values that are not finite and goals outside\n"
          "the limits give a status and a damped stop, not an exception; wrong shapes raise ValueError.");
  bind_rollout(m);
}

}  // namespace sidestep::python

#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include "arguments.hpp"
#include "system.hpp"
#include "module.hpp"
#include "sidestep/attractor/geometric_system.hpp"

namespace sidestep::python {
namespace {

Switch as_switch(nb::handle value) { return value.is_none() ? Switch{Unswitched{}} : nb::cast<Switch>(value); }

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
      .def_prop_ro("thresholds", [](const DistanceSwitch& s) { return to_numpy(s.thresholds); }, "(nv,) [m], one for each joint.")
      .def_ro("slope", &DistanceSwitch::slope);
}

void bind_diagnosis(nb::module_& m) {
  nb::enum_<MotionState>(m, "MotionState", "What the motion of one step is about.")
      .value("free", MotionState::free, "On the way, nothing in it.")
      .value("sliding", MotionState::sliding, "On the way, bent by a barrier.")
      .value("arriving", MotionState::arriving, "As near to the goal as counts as there.")
      .value("stuck", MotionState::stuck, "At rest short of the goal: a local minimum, or a pose out of reach.")
      .value("blocked_at_goal", MotionState::blocked_at_goal, "Stuck, and the goal itself is inside a barrier.")
      .value("inside_barrier", MotionState::inside_barrier, "A clearance is below its floor: moving out.")
      .value("fallback", MotionState::fallback, "The step is a fallback, nothing is known.");
  nb::enum_<CoordinateLabel::Kind>(m, "CoordinateKind", "What an embedding coordinate is about.")
      .value("potential", CoordinateLabel::Kind::potential, "No clearance: a density, a sum.")
      .value("obstacle", CoordinateLabel::Kind::obstacle, "A link against the obstacle points.")
      .value("self", CoordinateLabel::Kind::self, "Two links of the robot.")
      .value("plane", CoordinateLabel::Kind::plane, "A link against a plane.")
      .value("joint_limit", CoordinateLabel::Kind::joint_limit, "A joint against a position limit.")
      .value("effort", CoordinateLabel::Kind::effort, "What a joint holds of the arm against its effort limit.");
  nb::class_<CoordinateLabel>(m, "CoordinateLabel", "What one coordinate of an embedding is about.")
      .def_ro("kind", &CoordinateLabel::kind, "What the coordinate measures.")
      .def_ro("name", &CoordinateLabel::name, "Of the link, or of the joint for a limit; empty for a potential.")
      .def_ro("other", &CoordinateLabel::other, "The second link of a pair; 'lower' or 'upper' for a joint limit.")
      .def("__repr__", [](const CoordinateLabel& l) {
        return std::string("CoordinateLabel(") + nb::str(nb::cast(l.kind).attr("name")).c_str() +
               (l.name.empty() ? "" : ", '" + l.name + "'") + (l.other.empty() ? "" : ", '" + l.other + "'") + ")";
      });
  using E = Explanation;
  nb::class_<E>(m, "Diagnosis",
                "Why a motion is what it is, from one step. Stuck: |v| < 0.02 rad/s short of the goal, and the metric lets\n"
                "less than 5 % of the goal's pull through (or there is none): a local minimum. The coordinate named is the\n"
                "one with the largest share in what is held back.")
      .def_prop_ro("state", [](const E& e) { return e.diagnosis.state; }, "What the motion of the step is about.")
      .def_prop_ro("coordinate", [](const E& e) { return e.diagnosis.coordinate; }, "The dominating one; -1: none.")
      .def_prop_ro("kind", [](const E& e) { return e.label.kind; }, "Of the dominating coordinate.")
      .def_prop_ro("name", [](const E& e) { return e.label.name; }, "Its link, or joint for a limit; empty: none.")
      .def_prop_ro("other", [](const E& e) { return e.label.other; }, "The second link; or 'lower' or 'upper'.")
      .def_prop_ro("point", [](const E& e) { return e.diagnosis.point; }, "Its nearest obstacle point; -1: none.")
      .def_prop_ro("clearance", [](const E& e) { return e.diagnosis.clearance; }, "Its clearance [m; rad].")
      .def_prop_ro("share", [](const E& e) { return e.diagnosis.share; }, "Its share of what is held back.")
      .def_prop_ro("blocked", [](const E& e) { return e.diagnosis.blocked; },
                   "The part of the goal's pull that is held back, 1 - |G^-1 dU| / |dU|.")
      .def_prop_ro("speed", [](const E& e) { return e.diagnosis.speed; }, "|v| [rad/s].")
      .def_prop_ro("joint_error", [](const E& e) { return e.diagnosis.joint_error; }, "Largest [rad | m]; nan for a pose.")
      .def_prop_ro("position_error", [](const E& e) { return e.diagnosis.position_error; }, "[m]; nan for joints.")
      .def_prop_ro("rotation_error", [](const E& e) { return e.diagnosis.rotation_error; }, "[rad]; nan if not wanted.")
      .def_prop_ro("way_left", [](const E& e) { return e.diagnosis.way_left(); },
                   "How far the goal is, in words: '0.31 rad', '12.0 mm' of a sliding joint.")
      .def("describe", [](const E& e) { return e.words; }, "In one English sentence.")
      .def("__str__", [](const E& e) { return e.words; })
      .def("__repr__", [](const E& e) { return "Diagnosis(" + e.words + ")"; });

  nb::class_<PenetrationRecovery>(m, "PenetrationRecovery",
                       "What is done with an arm inside a barrier. speed [m/s] with which it leaves, rate [1/s] at which it\n"
                       "takes that up, margin [m] below the floor at which the push is full, rebound [rad/s]: the largest\n"
                       "joint speed that a barrier gives back.")
      .def(
          "__init__",
          [](PenetrationRecovery* self, double speed, double rate, double margin, double rebound) {
            new (self) PenetrationRecovery{speed, rate, margin, rebound};
            self->validate();
          },
          nb::kw_only(), nb::arg("speed") = PenetrationRecovery().speed, nb::arg("rate") = PenetrationRecovery().rate,
          nb::arg("margin") = PenetrationRecovery().margin, nb::arg("rebound") = PenetrationRecovery().rebound)
      .def_ro("speed", &PenetrationRecovery::speed)
      .def_ro("rate", &PenetrationRecovery::rate)
      .def_ro("margin", &PenetrationRecovery::margin)
      .def_ro("rebound", &PenetrationRecovery::rebound);
}

void bind_step(nb::module_& m) {
  nb::enum_<StepStatus>(m, "StepStatus", "What a step of the system says about its result.")
      .value("ok", StepStatus::ok, "The equations hold.")
      .value("outside_limits", StepStatus::outside_limits, "They hold, but a joint is outside its position limits.")
      .value("goal_out_of_reach", StepStatus::goal_out_of_reach, "They hold, but the frame cannot be where the goal is.")
      .value("inside_barrier", StepStatus::inside_barrier,
             "They hold, with a push out: a clearance is below its barrier's floor.")
      .value("goal_outside_limits", StepStatus::goal_outside_limits, "The goal is outside the limits: no pull.")
      .value("invalid_state", StepStatus::invalid_state, "Fallback: q or v is not finite.")
      .value("invalid_goal", StepStatus::invalid_goal, "The goal is not finite, or of another robot: no pull.")
      .value("not_finite", StepStatus::not_finite, "Fallback: the equations gave a value that is not finite.");
  m.def("is_fallback", &is_fallback, nb::arg("status"),
        "Whether the acceleration is the fallback: a damped stop within the acceleration limits.");

  bind_diagnosis(m);
  nb::class_<Step>(m, "Step", "The result of one step; arrays are copies.")
      .def_ro("status", &Step::status, "How the step ended.")
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
                   "G = I + J^T J (nv, nv).")
      .def_prop_ro("attraction", [](const Step& s) { return to_numpy(s.result.attraction); },
                   "-G^-1 dU/dq (nv) [rad/s^2]: what the metric lets through of the goal's pull.")
      .def_prop_ro("recovery", [](const Step& s) { return to_numpy(s.result.recovery); },
                   "The push out of barriers (nv,) [rad/s^2]; zero outside.")
      .def_prop_ro("inside", [](const Step& s) { return s.result.inside; },
                   "The coordinate deepest below its barrier's floor; -1: none.")
      .def_prop_ro("goal_gradient", [](const Step& s) { return to_numpy(s.result.goal.gradient); }, "dU/dq (nv,).")
      .def_prop_ro("goal_potential", [](const Step& s) { return s.result.goal.potential; },
                   "U [rad^2/s^2], without the posture pull.")
      .def_ro("diagnosis", &Step::explanation, "Why the motion is what it is.");
}

}  // namespace

void bind_dynamical_system(nb::module_& m) {
  nb::enum_<DampingForm>(m, "DampingForm", "Where damping acts.")
      .value("plain", DampingForm::plain, "h = -G^-1 K (q - q*) - D v (T5.4).")
      .value("metric", DampingForm::metric, "h = -G^-1 (K (q - q*) + D v) (T2.12).");
  nb::enum_<PullForm>(m, "PullForm", "How the goal pulls.")
      .value("metric", PullForm::metric, "-G^-1 dU (T5.4): all that changes a psi is held back.")
      .value("one_sided", PullForm::one_sided,
             "argmin_a |a + dU|^2 / 2 + sum_k max(0, J_k a)^2 / 2: only what makes a psi rise is held back.");
  bind_switches(m);
  bind_goals(m);
  bind_step(m);

  nb::class_<GeometricSystem> system(
      m, "GeometricSystem",
      "A damped spring that moves on the graph of psi: obstacles bend its path (Bosc 2024, chapter 5),\n"
      "    h = -G^-1 dU/dq - D (v - v*),   g = -G^-1 J^T d2psi/dt2,   a = h + g or as the switch weighs them,\n"
      "with dU/dq = K (q - q*) and v* = 0 for a configuration at rest.\n"
      "Embeddings in the list are stacked, each with its own coordinates; an empty list and robot=... give flat\n"
      "space.\n"
      "stiffness K [1/s^2] and damping D [1/s]: scalar, (nv,) diagonal or (nv, nv), symmetric positive\n"
      "semi-definite. damping_form, pull_form: a DampingForm, a PullForm, or their names. switch: None (unswitched) or one of the switches.\n"
      "recovery: what a barrier does with an arm inside it, by default PenetrationRecovery().\n"
      "Raises ValueError that names the setting at fault.");
  system
      .def(
          "__init__",
          [](GeometricSystem* self, std::vector<std::shared_ptr<const Embedding>> embeddings, const ArrayLike& stiffness,
             const ArrayLike& damping, nb::handle damping_form, nb::handle combination, nb::handle flat,
             nb::handle pull_form, const PenetrationRecovery* recovery) {
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
            settings.pull_form = as_enum<PullForm>(pull_form, "pull_form");
            if (recovery != nullptr) {
              settings.recovery = *recovery;
            }
            new (self) GeometricSystem(robot, std::move(embeddings), std::move(settings));
          },
          nb::arg("embeddings"), nb::kw_only(), nb::arg("stiffness") = 0.5, nb::arg("damping") = 1.5,
          nb::arg("damping_form") = "plain", nb::arg("switch") = nb::none(), nb::arg("robot") = nb::none(),
          nb::arg("pull_form") = "metric", nb::arg("recovery") = nb::none(),
          nb::sig("def __init__(self, embeddings: Sequence[Embedding], *, stiffness: numpy.typing.ArrayLike = 0.5, "
                  "damping: numpy.typing.ArrayLike = 1.5, damping_form: DampingForm | str = 'plain', "
                  "switch: Unswitched | HarmonicOnly | GeodesicOnly | BinarySwitch | SigmoidSwitch | DistanceSwitch "
                  "| None = None, robot: Robot | None = None, pull_form: PullForm | str = 'metric', recovery: PenetrationRecovery | None = None) -> None"))
      .def_prop_ro("num_embedding_coordinates", &GeometricSystem::num_embedding_coordinates, "Number of coordinates m.")
      .def_prop_ro("labels", [](const GeometricSystem& s) { return s.labels(); },
                   "What every embedding coordinate is about, as CoordinateLabel.")
      .def_prop_ro("stiffness", [](const GeometricSystem& s) { return to_numpy_matrix(s.settings().stiffness); })
      .def_prop_ro("damping", [](const GeometricSystem& s) { return to_numpy_matrix(s.settings().damping); })
      .def_prop_ro("pull_form", [](const GeometricSystem& s) { return s.settings().pull_form; })
      .def_prop_ro("damping_form", [](const GeometricSystem& s) { return s.settings().damping_form; })
      .def_prop_ro("switch", [](const GeometricSystem& s) { return s.settings().combination; })
      .def(
          "acceleration",
          [](const GeometricSystem& system, const ArrayLike& q, const ArrayLike& v, nb::handle goal,
             const Obstacles& obstacles, nb::handle activations) {
            const int nv = system.robot().num_coordinates();
            Step step{StepStatus::ok, GeometricSystem::Workspace(system), {system, {}, obstacles}};
            if (!activations.is_none()) {
              step.result.activations = as_finite_vector(nb::cast<ArrayLike>(activations), "activations",
                                                         system.num_embedding_coordinates());
            }
            step.status = system.acceleration(as_vector(q, "q", nv), as_vector(v, "v", nv), as_goal(goal, nv),
                                              obstacles, step.result);
            step.explanation = Explanation(system, system.diagnose(step.result), obstacles);
            return step;
          },
          nb::arg("q"), nb::arg("v"), nb::arg("goal"), nb::arg("obstacles"), nb::arg("activations") = nb::none(),
          nb::sig("def acceleration(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, goal: "
                  "numpy.typing.ArrayLike | JointGoal | PoseGoal, obstacles: Obstacles, "
                  "activations: numpy.typing.ArrayLike | None = None) -> Step"),
          "One step at q, v (nv,) [rad, rad/s] towards a configuration (nv,), a JointGoal or a PoseGoal. Values that are not finite and goals outside\n"
          "the limits give a status and a damped stop, not an exception; wrong shapes raise ValueError. activations (m,):\n"
          "clearances at which barriers begin, in place of the system's, see Controller.activations.");
  system
      .def(
          "diagnose",
          [](const GeometricSystem& s, const ArrayLike& q, const ArrayLike& v, nb::handle goal,
             const Obstacles& obstacles) {
            const int nv = s.robot().num_coordinates();
            GeometricSystem::Workspace workspace(s);
            return Explanation(s, s.diagnose(as_vector(q, "q", nv), as_vector(v, "v", nv), as_goal(goal, nv), obstacles,
                                             workspace),
                               obstacles);
          },
          nb::arg("q"), nb::arg("v"), nb::arg("goal"), nb::arg("obstacles"),
          nb::sig("def diagnose(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, goal: "
                  "numpy.typing.ArrayLike | JointGoal | PoseGoal, obstacles: Obstacles) -> Diagnosis"),
          "The diagnosis of a step, and whether a stop is because the goal, a configuration, is itself blocked.")
      .def(
          "goal_clearance",
          [](const GeometricSystem& s, nb::handle goal, const Obstacles& obstacles) {
            if (nb::isinstance<PoseGoal>(goal)) {
              throw nb::value_error("goal must be a configuration: a pose may be reached in many");
            }
            const int nv = s.robot().num_coordinates();
            const Goal at = as_goal(goal, nv);
            GeometricSystem::Workspace w(s);
            static_cast<void>(s.acceleration(std::get<JointGoal>(at).position, Eigen::VectorXd::Zero(nv), at, obstacles, w));
            return w.clearances.values.size() == 0 ? std::numeric_limits<double>::infinity()
                                                   : w.clearances.values.minCoeff();
          },
          nb::arg("goal"), nb::arg("obstacles"),
          nb::sig("def goal_clearance(self, goal: numpy.typing.ArrayLike | JointGoal, obstacles: Obstacles) -> float"),
          "The smallest clearance of any barrier at a goal configuration; inf beyond their reach.");
  bind_look_ahead(m);
}

}  // namespace sidestep::python

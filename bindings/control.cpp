#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <optional>

#include "arguments.hpp"
#include "module.hpp"
#include "settings.hpp"
#include "sidestep/constraints/acceleration_bounds.hpp"
#include "sidestep/constraints/acceleration_filter.hpp"
#include "sidestep/math/quadratic_program.hpp"
#include "sidestep/constraints/torque_controller.hpp"

namespace sidestep::python {
namespace {

struct QuadraticSolution {
  QuadraticProgramStatus status;
  Eigen::VectorXd x, multipliers;
  int iterations;
  double residual, seconds;
};

/// The programs that controllers solve are handed out with the rows alone that have a bound.
QuadraticProgramData without_unbounded_rows(const QuadraticProgramData& data) {
  std::vector<Eigen::Index> bounded;
  for (Eigen::Index k = 0; k < data.A.rows(); ++k) {
    if (std::isfinite(data.row_lower[k]) || std::isfinite(data.row_upper[k])) {
      bounded.push_back(k);
    }
  }
  QuadraticProgramData result(static_cast<int>(data.g.size()), static_cast<int>(bounded.size()));
  result.H = data.H;
  result.g = data.g;
  result.lower = data.lower;
  result.upper = data.upper;
  result.A = data.A(bounded, Eigen::all);
  result.row_lower = data.row_lower(bounded);
  result.row_upper = data.row_upper(bounded);
  return result;
}

constexpr const char* program_doc =
    "The first quadratic program of the last call that had usable input, over the acceleration [rad/s^2 | m/s^2];\n"
    "rows without bounds are left out.";

void bind_quadratic_program(nb::module_& m) {
  nb::enum_<QuadraticProgramStatus>(m, "QuadraticProgramStatus", "How a quadratic program ended.")
      .value("solved", QuadraticProgramStatus::solved)
      .value("infeasible", QuadraticProgramStatus::infeasible)
      .value("max_iterations", QuadraticProgramStatus::max_iterations)
      .value("not_positive_definite", QuadraticProgramStatus::not_positive_definite)
      .value("not_finite", QuadraticProgramStatus::not_finite)
      .value("wrong_size", QuadraticProgramStatus::wrong_size)
      .def("__str__", [](QuadraticProgramStatus status) { return name(status); });

  nb::class_<QuadraticSolution>(m, "QuadraticSolution", "What one solve of a QuadraticProgram gives.")
      .def_ro("status", &QuadraticSolution::status, "How the solver ended.")
      .def_prop_ro("x", [](const QuadraticSolution& s) { return to_numpy(s.x); }, "The minimiser (n,).")
      .def_prop_ro("multipliers", [](const QuadraticSolution& s) { return to_numpy(s.multipliers); },
                   "(n + m,): of the bounds, then of the rows; positive at an upper, negative at a lower limit.")
      .def_ro("iterations", &QuadraticSolution::iterations, "Constraints that were added or dropped.")
      .def_ro("residual", &QuadraticSolution::residual,
              "Largest relative violation of the optimality conditions; NaN unless solved.")
      .def_ro("seconds", &QuadraticSolution::seconds, "What the solver took [s], without the copies in and out.");

  nb::class_<QuadraticProgramData>(m, "QuadraticProgramData",
                                   "minimise 1/2 x'Hx + g'x subject to lower <= x <= upper and\n"
                                   "row_lower <= A x <= row_upper, with H (n, n) and A (m, n). Bounds may be infinite.")
      .def_prop_ro("H", [](const QuadraticProgramData& d) { return to_numpy_matrix(d.H); }, "(n, n)")
      .def_prop_ro("g", [](const QuadraticProgramData& d) { return to_numpy(d.g); }, "(n,)")
      .def_prop_ro("lower", [](const QuadraticProgramData& d) { return to_numpy(d.lower); }, "(n,)")
      .def_prop_ro("upper", [](const QuadraticProgramData& d) { return to_numpy(d.upper); }, "(n,)")
      .def_prop_ro("A", [](const QuadraticProgramData& d) { return to_numpy_matrix(d.A); }, "(m, n)")
      .def_prop_ro("row_lower", [](const QuadraticProgramData& d) { return to_numpy(d.row_lower); }, "(m,)")
      .def_prop_ro("row_upper", [](const QuadraticProgramData& d) { return to_numpy(d.row_upper); }, "(m,)");

  nb::class_<QuadraticProgram>(m, "QuadraticProgram",
                               "A dense strictly convex quadratic program of fixed size, solved by the dual active-set\n"
                               "method: minimise 1/2 x'Hx + g'x subject to lower <= x <= upper and\n"
                               "row_lower <= A x <= row_upper. Source: Goldfarb and Idnani (1983).")
      .def(
          "__init__",
          [](QuadraticProgram* self, int num_variables, int num_rows) {
            constexpr int most = 4096;  // the matrices of a solve take 0.8 GB then
            for (const int size : {num_variables, num_rows}) {
              if (size > most) {
                throw nb::value_error(("quadratic program: a size is " + std::to_string(size) + ", must be at most 4096").c_str());
              }
            }
            new (self) QuadraticProgram(num_variables, num_rows);
          },
          nb::arg("num_variables"), nb::arg("num_rows") = 0)
      .def_prop_ro("num_variables", &QuadraticProgram::num_variables, "Number of variables n.")
      .def_prop_ro("num_rows", &QuadraticProgram::num_rows, "Number of rows m beside the bounds.")
      .def(
          "solve",
          [](QuadraticProgram& qp, const ArrayLike& H, const ArrayLike& g, const ArrayLike& lower, const ArrayLike& upper, const ArrayLike& A,
             const ArrayLike& row_lower, const ArrayLike& row_upper) {
            const int n = qp.num_variables(), rows = qp.num_rows();
            QuadraticProgramData data(n, rows);
            data.H = as_matrix(H, "H", n, n);
            data.g = as_vector(g, "g", n);
            if (!lower.is_none()) data.lower = as_filled_vector(lower, "lower", n);
            if (!upper.is_none()) data.upper = as_filled_vector(upper, "upper", n);
            if (!A.is_none()) data.A = as_matrix(A, "A", rows, n);
            if (!row_lower.is_none()) data.row_lower = as_filled_vector(row_lower, "row_lower", rows);
            if (!row_upper.is_none()) data.row_upper = as_filled_vector(row_upper, "row_upper", rows);
            const auto start = std::chrono::steady_clock::now();
            const QuadraticProgramStatus status = qp.solve(data);
            const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
            const bool solved = status == QuadraticProgramStatus::solved;
            return QuadraticSolution{status, qp.solution(), qp.multipliers(), qp.iterations(),
                                     solved ? optimality_residual(data, qp) : std::numeric_limits<double>::quiet_NaN(),
                                     taken.count()};
          },
          nb::arg("H"), nb::arg("g"), nb::kw_only(), nb::arg("lower").none() = nb::none(),
          nb::arg("upper").none() = nb::none(), nb::arg("A").none() = nb::none(),
          nb::arg("row_lower").none() = nb::none(), nb::arg("row_upper").none() = nb::none(),
          "H (n, n) symmetric positive definite; g (n,); bounds scalar or (n,), rows A (m, n), scalar or (m,);\n"
          "None or infinite means no bound, equal bounds an equality. Returns a QuadraticSolution; data that cannot\n"
          "be solved give a status. Raises ValueError on wrong shapes.");
}

void bind_acceleration_bounds(nb::module_& m) {
  nb::enum_<Limit>(m, "Limit", "Limits of one joint; a flag, so a set of them is one value.", nb::is_flag())
      .value("position_lower", Limit::position_lower)
      .value("position_upper", Limit::position_upper)
      .value("velocity_lower", Limit::velocity_lower)
      .value("velocity_upper", Limit::velocity_upper)
      .value("acceleration_lower", Limit::acceleration_lower)
      .value("acceleration_upper", Limit::acceleration_upper)
      .value("torque_lower", Limit::torque_lower)
      .value("torque_upper", Limit::torque_upper)
      .value("jerk_lower", Limit::jerk_lower)
      .value("jerk_upper", Limit::jerk_upper)
      .value("torque_rate_lower", Limit::torque_rate_lower)
      .value("torque_rate_upper", Limit::torque_rate_upper);

  m.def(
      "acceleration_bounds",
      [](nb::handle robot_or_limits, const ArrayLike& q, const ArrayLike& v, double period, double position_margin) {
        if (!nb::isinstance<Robot>(robot_or_limits) && !nb::isinstance<JointLimits>(robot_or_limits)) {
          throw nb::type_error("limits must be a Robot or JointLimits");
        }
        const JointLimits& limits = nb::isinstance<Robot>(robot_or_limits)
                                        ? nb::cast<const Robot&>(robot_or_limits).limits()
                                        : nb::cast<const JointLimits&>(robot_or_limits);
        const int nv = static_cast<int>(limits.velocity.size());
        const Eigen::VectorXd position = as_vector(q, "q", nv), velocity = as_vector(v, "v", nv);
        if (!position.allFinite() || !velocity.allFinite()) {
          throw nb::value_error("q and v must be finite");
        }
        if (!(period > 0.0) || !std::isfinite(period)) {
          throw nb::value_error(("period is " + std::to_string(period) + ", must be finite and positive").c_str());
        }
        if (limits.lower.size() != nv || limits.upper.size() != nv || limits.acceleration.size() != nv) {
          throw nb::value_error("limits must have the same number of entries each");
        }
        AccelerationBounds bounds(nv);
        bounds.update(limits, position, velocity, period, {position_margin});
        return nb::make_tuple(to_numpy(bounds.lower), to_numpy(bounds.upper));
      },
      nb::arg("limits"), nb::arg("q"), nb::arg("v"), nb::arg("period"), nb::kw_only(), nb::arg("position_margin") = 0.0,
      nb::sig("def acceleration_bounds(limits: Robot | JointLimits, q: numpy.typing.ArrayLike, "
              "v: numpy.typing.ArrayLike, period: float, *, position_margin: float = 0.0) "
              "-> tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64]]"),
      "Accelerations (lower, upper), each (nv,) [/s^2], that keep every joint inside its limits for ever.\n\n"
      "limits: a Robot or its JointLimits; q (nv,) [rad | m]; v (nv,) [/s]; period [s]: how long an acceleration is\n"
      "held. Outside the limits they steer back. Never empty. Raises ValueError on wrong shapes or values that are\n"
      "not finite. Source: Del Prete (2018), made exact for held accelerations.");
}

/// Clearances, or those of a Step; null for None. They live as long as the handle.
const Clearances* as_clearances(nb::handle value, nb::object& keep) {
  if (value.is_none()) {
    return nullptr;
  }
  keep = nb::isinstance<Clearances>(value) ? nb::borrow(value) : nb::getattr(value, "clearances", nb::none());
  if (!nb::isinstance<Clearances>(keep)) {
    throw nb::type_error("clearances must be Clearances or a Step");
  }
  return nb::cast<const Clearances*>(keep);
}

void bind_safety(nb::module_& m) {
  nb::class_<Clearances>(m, "Clearances",
                         "Clearances h(q, t) of parts of an arm with what their motion needs; arrays are copies.")
      .def(
          "__init__",
          [](Clearances* self, const ArrayLike& values, const ArrayLike& rates, const ArrayLike& curvatures,
             const ArrayLike& gradients, const std::vector<int>& nearest, const std::optional<ArrayLike>& margins) {
            const auto num = static_cast<Eigen::Index>(nearest.size());
            const Array rows = as_array(gradients, "gradients");
            if (rows.ndim() != 2) {
              throw nb::value_error("gradients must have shape (m, nv)");
            }
            const auto nv = static_cast<Eigen::Index>(rows.shape(1));
            Clearances result(static_cast<int>(nv), static_cast<int>(num));
            result.values = as_vector(values, "values", num);
            result.rates = as_vector(rates, "rates", num);
            result.curvatures = as_vector(curvatures, "curvatures", num);
            result.gradients = as_matrix(gradients, "gradients", num, nv).transpose();
            result.nearest = Eigen::Map<const Eigen::VectorXi>(nearest.data(), num);
            if (margins) {
              result.margins = as_vector(*margins, "margins", num);
            }
            result.mind_nearest();
            new (self) Clearances(std::move(result));
          },
          nb::kw_only(), nb::arg("values"), nb::arg("rates"), nb::arg("curvatures"), nb::arg("gradients"),
          nb::arg("nearest"), nb::arg("margins") = nb::none())
      .def_prop_ro("values", [](const Clearances& c) { return to_numpy(c.values); },
                   "h (m,) [m]; inf beyond the reach, where the rest has no meaning.")
      .def_prop_ro("rates", [](const Clearances& c) { return to_numpy(c.rates); },
                   "dh/dt (m,) [m/s], obstacle velocities included.")
      .def_prop_ro("curvatures", [](const Clearances& c) { return to_numpy(c.curvatures); },
                   "d2h/dt2 (m,) [m/s^2] along the motion with constant joint velocity.")
      .def_prop_ro("approach_values", [](const Clearances& c) { return to_numpy(c.approach.values); },
                   "h (m,) [m] of the critical sample: the one with the smallest predicted clearance after braking.")
      .def_prop_ro("approach_rates", [](const Clearances& c) { return to_numpy(c.approach.rates); },
                   "Its dh/dt (m,) [m/s].")
      .def_prop_ro("gradients", [](const Clearances& c) { return to_numpy_matrix(c.gradients.transpose()); },
                   "dh/dq (m, nv) [m/rad].")
      .def_prop_ro("nearest",
                   [](const Clearances& c) {
                     return std::vector<int>(c.nearest.data(), c.nearest.data() + c.nearest.size());
                   },
                   "Index of the nearest obstacle point (m), -1 beyond the reach.")
      .def_prop_ro("margins", [](const Clearances& c) { return to_numpy(c.margins); },
                   "No larger margins than these (m,) [m] are kept: inf, or half the activation distance of a Barrier of\n"
                   "what is not seen, such as self-collision.");

  bind_settings<SafetySettings>(m, "SafetySettings", "What every command keeps of clearances, of which the margin may be less: `Clearances.margins`.");
}

void bind_torque_controller(nb::module_& m) {
  nb::enum_<TorqueStatus>(m, "TorqueStatus", "How a control step ended, from best to worst.")
      .value("ok", TorqueStatus::ok, "tracked, no limit in the way")
      .value("limited", TorqueStatus::limited, "optimal, with a limit in the way")
      .value("relaxed", TorqueStatus::relaxed, "limits of jerk, joint or Cartesian speed, or acceleration gave way")
      .value("relaxed_safety", TorqueStatus::relaxed_safety, "not all clearances and position limits can be kept")
      .value("clearance_lost", TorqueStatus::clearance_lost, "the least clearance is below zero, whatever the rest")
      .value("fallback_invalid_input", TorqueStatus::fallback_invalid_input, "unusable input, damped stop")
      .value("fallback_solver", TorqueStatus::fallback_solver, "program not solved, damped stop")
      .def("__str__", [](TorqueStatus status) { return name(status); })
      .def_prop_ro("is_fallback", [](TorqueStatus s) { return s >= TorqueStatus::fallback_invalid_input; });
  nb::enum_<TorqueFault>(m, "TorqueFault", "Which input of a control step is unusable.")
      .value("none", TorqueFault::none)
      .value("position", TorqueFault::position)
      .value("velocity", TorqueFault::velocity)
      .value("acceleration", TorqueFault::acceleration)
      .value("mass_matrix", TorqueFault::mass_matrix)
      .value("bias", TorqueFault::bias)
      .value("clearances", TorqueFault::clearances)
      .def("__str__", [](TorqueFault fault) { return name(fault); });

  nb::class_<SafetyRow>(m, "SafetyRow", "What one control step did about one clearance.")
      .def_ro("coordinate", &SafetyRow::coordinate, "Which clearance.")
      .def_ro("nearest", &SafetyRow::nearest, "Its nearest obstacle point.")
      .def_ro("along_path", &SafetyRow::along_path,
              "Whether a stop along the path is asked for: -|grad h| v/|v| stands for grad h.")
      .def_ro("required", &SafetyRow::required, "Smallest grad h . x [m/s^2] that was asked for.")
      .def_ro("slack", &SafetyRow::slack, "By how much the solution falls short of it [m/s^2].")
      .def_ro("multiplier", &SafetyRow::multiplier, "What the row costs the task, >= 0; the largest one dominates.");

  nb::class_<TorqueSolution>(m, "TorqueSolution", "What one control step gives.")
      .def_ro("status", &TorqueSolution::status, "How the control step ended.")
      .def_ro("fault", &TorqueSolution::fault, "Which input is unusable.")
      .def_prop_ro("torque", [](const TorqueSolution& s) { return to_numpy(s.torque); },
                   "(nv,) [Nm | N], within the effort limits, always finite.")
      .def_prop_ro("acceleration", [](const TorqueSolution& s) { return to_numpy(s.acceleration); },
                   "(nv,) [/s^2] that the torque gives; NaN where M or the bias is unusable.")
      .def_prop_ro("slack", [](const TorqueSolution& s) { return to_numpy(s.slack); },
                   "(nv,) [/s^2] signed acceleration beyond its bounds; 0 unless relaxed.")
      .def_prop_ro("lower", [](const TorqueSolution& s) { return to_numpy(s.lower); },
                   "(nv,) [/s^2] lower acceleration bounds.")
      .def_prop_ro("upper", [](const TorqueSolution& s) { return to_numpy(s.upper); },
                   "(nv,) [/s^2] upper acceleration bounds.")
      .def_prop_ro("active", [](const TorqueSolution& s) { return nb::tuple(nb::cast(s.active)); },
                   nb::sig("def active(self) -> tuple[Limit, ...]"), "The limits in the way of each joint.")
      .def_prop_ro("safety",
                   [](const TorqueSolution& s) {
                     const auto first = s.safety.begin();
                     return nb::tuple(nb::cast(std::vector<SafetyRow>(first, first + s.num_safety_rows)));
                   },
                   nb::sig("def safety(self) -> tuple[SafetyRow, ...]"),
                   "The clearances that were considered, most critical first.")
      .def_prop_ro("dominant",
                   [](const TorqueSolution& s) -> nb::object {
                     return s.dominant < 0 ? nb::none() : nb::cast(s.safety[static_cast<std::size_t>(s.dominant)]);
                   },
                   nb::sig("def dominant(self) -> SafetyRow | None"),
                   "The clearance that bends the motion most; None if none does.")
      .def_ro("least_clearance", &TorqueSolution::least_clearance,
              "The least clearance given [m], exact, with a row or without; inf if there is none.")
      .def_ro("least_coordinate", &TorqueSolution::least_coordinate, "Which clearance that is; -1 if there is none.")
      .def_ro("least_nearest", &TorqueSolution::least_nearest, "Its nearest obstacle point; -1 if there is none.");

  nb::class_<TorqueController>(m, "TorqueController",
                               "Torque that tracks a wanted acceleration within every limit of the arm:\n"
                               "minimise 1/2 (x - a)'Q(x - a) + 1/2 t'Rt with t = torque / effort limit, subject to\n"
                               "M x + h = torque, |torque| <= effort limit, lower(q, v) <= x <= upper(q, v).\n"
                               "Source: Bosc, equation T6.3, corrected. One object per thread.")
      .def(
          "__init__",
          [](TorqueController* self, const Robot& robot, double period, const ArrayLike& tracking_weight,
             const ArrayLike& torque_weight, double slack_weight, double velocity_overrun, double acceleration_overrun,
             double position_margin, double stop_time, double stop_damping, const SafetySettings* safety) {
            const int nv = robot.num_coordinates();
            TorqueControllerSettings settings;
            settings.period = period;
            settings.tracking_weight = as_filled_vector(tracking_weight, "tracking_weight", nv);
            settings.torque_weight = as_filled_vector(torque_weight, "torque_weight", nv);
            settings.slack_weight = slack_weight;
            settings.velocity_overrun = velocity_overrun;
            settings.acceleration_overrun = acceleration_overrun;
            settings.safety = safety == nullptr ? SafetySettings() : *safety;
            settings.position_margin = position_margin;
            settings.stop_time = stop_time;
            settings.stop_damping = stop_damping;
            new (self) TorqueController(robot, std::move(settings));
          },
          nb::arg("robot"), nb::kw_only(), nb::arg("period") = TorqueControllerSettings().period,
          nb::arg("tracking_weight") = TorqueControllerSettings().tracking_weight[0],
          nb::arg("torque_weight") = TorqueControllerSettings().torque_weight[0],
          nb::arg("slack_weight") = TorqueControllerSettings().slack_weight,
          nb::arg("velocity_overrun") = TorqueControllerSettings().velocity_overrun,
          nb::arg("acceleration_overrun") = TorqueControllerSettings().acceleration_overrun,
          nb::arg("position_margin") = TorqueControllerSettings().position_margin,
          nb::arg("stop_time") = TorqueControllerSettings().stop_time,
          nb::arg("stop_damping") = TorqueControllerSettings().stop_damping,
          nb::arg("safety") = nb::none(),
          "period [s]: time between two steps; tracking_weight: Q, scalar or (nv,) [per (/s^2)^2];\n"
          "torque_weight: R, scalar or (nv,) [-]; slack_weight [-]: price of leaving the acceleration bounds over the\n"
          "steepest tracking cost; velocity_overrun, acceleration_overrun [-], >= 1: the factor up to which those limits\n"
          "give way to clearances and torque limits;\n"
          "position_margin [rad | m]: position limits are moved inwards by it; stop_time [s]: time constant of the\n"
          "damped stop; stop_damping [-]: its damping without a mass matrix, over effort limit / velocity limit;\n"
          "safety: SafetySettings, by default as they are. Raises ValueError that names the setting.")
      .def(
          "solve",
          [](TorqueController& controller, const ArrayLike& q, const ArrayLike& v, const ArrayLike& acceleration, const ArrayLike& mass_matrix,
             const ArrayLike& bias, nb::handle clearances, const std::optional<ArrayLike>& last_acceleration,
             const std::optional<ArrayLike>& last_torque) {
            const int nv = controller.num_coordinates();
            TorqueSolution solution(nv, controller.settings().safety.max_rows);
            nb::object keep;
            LastCommand last;
            Eigen::VectorXd a, torque;
            if (last_acceleration) {
              a = as_finite_vector(*last_acceleration, "last_acceleration", nv);
              last.acceleration = &a;
            }
            if (last_torque) {
              torque = as_finite_vector(*last_torque, "last_torque", nv);
              last.torque = &torque;
            }
            static_cast<void>(controller.solve(as_vector(q, "q", nv), as_vector(v, "v", nv),
                                               as_vector(acceleration, "acceleration", nv),
                                               as_matrix(mass_matrix, "mass_matrix", nv, nv),
                                               as_vector(bias, "bias", nv), as_clearances(clearances, keep), {}, last,
                                               solution));
            return solution;
          },
          nb::arg("q"), nb::arg("v"), nb::arg("acceleration"), nb::arg("mass_matrix"), nb::arg("bias"), nb::kw_only(),
          nb::arg("clearances").none() = nb::none(), nb::arg("last_acceleration") = nb::none(), nb::arg("last_torque") = nb::none(),
          nb::sig("def solve(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, "
                  "acceleration: numpy.typing.ArrayLike, mass_matrix: numpy.typing.ArrayLike, "
                  "bias: numpy.typing.ArrayLike, *, clearances: Clearances | Step | None = None, "
                  "last_acceleration: numpy.typing.ArrayLike | None = None, "
                  "last_torque: numpy.typing.ArrayLike | None = None) -> TorqueSolution"),
          "One control step: q (nv,) [rad | m], v (nv,) [/s], wanted acceleration (nv,) [/s^2], mass matrix (nv, nv),\n"
          "bias (nv,) [Nm | N] (Coriolis, centrifugal and gravity), clearances at (q, v), which a Step has. With the last\n"
          "period's acceleration (nv,) [/s^2] or torque (nv,) [Nm | N], jerk or torque rate keep their limits. Returns a\n"
          "TorqueSolution; values that are not finite give a fallback status and a damped stop. Raises ValueError on wrong shapes.")
      .def_prop_ro("num_coordinates", &TorqueController::num_coordinates, "Number of joint coordinates nv.")
      .def_prop_ro("program", [](const TorqueController& c) { return without_unbounded_rows(c.program()); }, program_doc)
      .def("count", &TorqueController::count, nb::arg("status"), "Number of solves that ended with this status.");
}

void bind_acceleration_filter(nb::module_& m) {
  const AccelerationFilterSettings defaults;
  nb::class_<AccelerationFilter>(
      m, "AccelerationFilter",
      "The acceleration nearest to a wanted one within the limits of joints and clearances, for motion without torque:\n"
      "TorqueController with unit masses and unlimited effort. Position, velocity and acceleration limits are never\n"
      "left; only clearances can give way (status relaxed_safety). One object per thread.")
      .def(
          "__init__",
          [](AccelerationFilter* self, const Robot& robot, double period, double position_margin, double stop_time,
             const SafetySettings* safety) {
            new (self) AccelerationFilter(
                robot, {period, position_margin, stop_time, safety == nullptr ? SafetySettings() : *safety});
          },
          nb::arg("robot"), nb::kw_only(), nb::arg("period") = defaults.period,
          nb::arg("position_margin") = defaults.position_margin, nb::arg("stop_time") = defaults.stop_time,
          nb::arg("safety") = nb::none(),
          "period [s]: how long an acceleration is held; position_margin [rad | m]; stop_time [s]: of the damped stop\n"
          "for unusable input; safety: SafetySettings, by default as they are. Raises ValueError that names the setting.")
      .def(
          "apply",
          [](AccelerationFilter& filter, const ArrayLike& q, const ArrayLike& v, const ArrayLike& acceleration,
             nb::handle clearances) {
            const int nv = filter.num_coordinates();
            TorqueSolution solution(nv, filter.max_safety_rows());
            nb::object keep;
            static_cast<void>(filter.apply(as_vector(q, "q", nv), as_vector(v, "v", nv),
                                           as_vector(acceleration, "acceleration", nv),
                                           as_clearances(clearances, keep), solution));
            return solution;
          },
          nb::arg("q"), nb::arg("v"), nb::arg("acceleration"), nb::kw_only(), nb::arg("clearances").none() = nb::none(),
          nb::sig("def apply(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, "
                  "acceleration: numpy.typing.ArrayLike, *, clearances: Clearances | Step | None = None) "
                  "-> TorqueSolution"),
          "q (nv,) [rad | m], v (nv,) [/s], wanted acceleration (nv,) [/s^2], clearances at (q, v), which a Step has.\n"
          "Returns a TorqueSolution, of which `acceleration` is the result. Raises ValueError on wrong shapes.")
      .def_prop_ro("period", &AccelerationFilter::period, "[s] between two calls.")
      .def_prop_ro("num_coordinates", &AccelerationFilter::num_coordinates, "Number of joint coordinates nv.")
      .def_prop_ro("program", [](const AccelerationFilter& f) { return without_unbounded_rows(f.program()); }, program_doc)
      .def("count", &AccelerationFilter::count, nb::arg("status"), "Number of calls that ended with this status.");
}

}  // namespace

void bind_control(nb::module_& m) {
  bind_quadratic_program(m);
  bind_acceleration_bounds(m);
  bind_safety(m);
  bind_torque_controller(m);
  bind_acceleration_filter(m);
}

}  // namespace sidestep::python

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
#include "sidestep/math/quadratic_program.hpp"
#include "sidestep/constraints/motion_program.hpp"

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
            constexpr int most = 4096;  // Largest number: the matrices of a solve take 0.8 GB then.
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

void bind_motion_status(nb::module_& m) {
  nb::enum_<ProgramStatus>(m, "ProgramStatus", "How a solve of MotionProgram ended, from best to worst.")
      .value("ok", ProgramStatus::ok, "tracked, no limit in the way")
      .value("limited", ProgramStatus::limited, "optimal, with a limit in the way")
      .value("relaxed", ProgramStatus::relaxed, "limits of jerk, joint or Cartesian speed, or acceleration gave way")
      .value("relaxed_safety", ProgramStatus::relaxed_safety, "not all clearances and position limits can be kept")
      .value("clearance_lost", ProgramStatus::clearance_lost, "the least clearance is below zero, whatever the rest")
      .value("fallback_invalid_input", ProgramStatus::fallback_invalid_input, "unusable input, damped stop")
      .value("fallback_solver", ProgramStatus::fallback_solver, "program not solved, damped stop")
      .def("__str__", [](ProgramStatus status) { return name(status); })
      .def_prop_ro("is_fallback", [](ProgramStatus s) { return s >= ProgramStatus::fallback_invalid_input; });
  nb::enum_<ProgramFault>(m, "ProgramFault", "Which input of a solve is unusable.")
      .value("none", ProgramFault::none)
      .value("position", ProgramFault::position)
      .value("velocity", ProgramFault::velocity)
      .value("acceleration", ProgramFault::acceleration)
      .value("mass_matrix", ProgramFault::mass_matrix)
      .value("bias", ProgramFault::bias)
      .value("clearances", ProgramFault::clearances)
      .def("__str__", [](ProgramFault fault) { return name(fault); });
}

void bind_motion_solution(nb::module_& m) {
  nb::class_<SafetyRow>(m, "SafetyRow", "What one control step did about one clearance.")
      .def_ro("coordinate", &SafetyRow::coordinate, "Which clearance.")
      .def_ro("nearest", &SafetyRow::nearest, "Its nearest obstacle point.")
      .def_ro("along_path", &SafetyRow::along_path,
              "Whether a stop along the path is asked for: -|grad h| v/|v| stands for grad h.")
      .def_ro("required", &SafetyRow::required, "Smallest grad h . x [m/s^2] that was asked for.")
      .def_ro("slack", &SafetyRow::slack, "By how much the solution falls short of it [m/s^2].")
      .def_ro("multiplier", &SafetyRow::multiplier, "What the row costs the task, >= 0; the largest one dominates.");

  nb::class_<MotionSolution>(m, "MotionSolution", "What a solve of MotionProgram gives.")
      .def_ro("status", &MotionSolution::status, "How the solve ended.")
      .def_ro("fault", &MotionSolution::fault, "Which input is unusable.")
      .def_prop_ro("torque", [](const MotionSolution& s) { return to_numpy(s.torque); },
                   "(nv,) [Nm | N], within the effort limits, always finite.")
      .def_prop_ro("acceleration", [](const MotionSolution& s) { return to_numpy(s.acceleration); },
                   "(nv,) [/s^2] that the torque gives; NaN where M or the bias is unusable.")
      .def_prop_ro("slack", [](const MotionSolution& s) { return to_numpy(s.slack); },
                   "(nv,) [/s^2] signed acceleration beyond its bounds; 0 unless relaxed.")
      .def_prop_ro("lower", [](const MotionSolution& s) { return to_numpy(s.lower); },
                   "(nv,) [/s^2] lower acceleration bounds.")
      .def_prop_ro("upper", [](const MotionSolution& s) { return to_numpy(s.upper); },
                   "(nv,) [/s^2] upper acceleration bounds.")
      .def_prop_ro("active", [](const MotionSolution& s) { return nb::tuple(nb::cast(s.active)); },
                   nb::sig("def active(self) -> tuple[Limit, ...]"), "The limits in the way of each joint.")
      .def_prop_ro("safety",
                   [](const MotionSolution& s) {
                     const auto first = s.safety.begin();
                     return nb::tuple(nb::cast(std::vector<SafetyRow>(first, first + s.num_safety_rows)));
                   },
                   nb::sig("def safety(self) -> tuple[SafetyRow, ...]"),
                   "The clearances that were considered, most critical first.")
      .def_prop_ro("dominant",
                   [](const MotionSolution& s) -> nb::object {
                     return s.dominant < 0 ? nb::none() : nb::cast(s.safety[static_cast<std::size_t>(s.dominant)]);
                   },
                   nb::sig("def dominant(self) -> SafetyRow | None"),
                   "The clearance that bends the motion most; None if none does.")
      .def_ro("least_clearance", &MotionSolution::least_clearance,
              "The least clearance given [m], exact, with a row or without; inf if there is none.")
      .def_ro("least_coordinate", &MotionSolution::least_coordinate, "Which clearance that is; -1 if there is none.")
      .def_ro("least_nearest", &MotionSolution::least_nearest, "Its nearest obstacle point; -1 if there is none.");
}

void make_motion_program(MotionProgram* self, const Robot& robot, double period, bool by_torque, const ArrayLike& tracking_weight,
                         const ArrayLike& torque_weight, double slack_weight, double velocity_overrun,
                         double acceleration_overrun, double position_margin, double stop_time, double stop_damping,
                         const SafetySettings* safety) {
  const int nv = robot.num_coordinates();
  MotionProgramSettings settings;
  settings.period = period;
  settings.by_torque = by_torque;
  settings.tracking_weight = as_filled_vector(tracking_weight, "tracking_weight", nv);
  settings.torque_weight = as_filled_vector(torque_weight, "torque_weight", nv);
  settings.slack_weight = slack_weight;
  settings.velocity_overrun = velocity_overrun;
  settings.acceleration_overrun = acceleration_overrun;
  settings.safety = safety == nullptr ? SafetySettings() : *safety;
  settings.position_margin = position_margin;
  settings.stop_time = stop_time;
  settings.stop_damping = stop_damping;
  new (self) MotionProgram(robot, std::move(settings));
}

MotionSolution solve_motion_program(MotionProgram& program, const ArrayLike& q, const ArrayLike& v, const ArrayLike& acceleration,
                                    const std::optional<ArrayLike>& mass_matrix, const std::optional<ArrayLike>& bias,
                                    nb::handle clearances, const std::optional<ArrayLike>& last_acceleration,
                                    const std::optional<ArrayLike>& last_torque) {
  const int nv = program.num_coordinates();
  if (program.settings().by_torque && !(mass_matrix && bias)) {
    throw nb::value_error("mass_matrix and bias must be given to an arm that is moved by torque");
  }
  MotionSolution solution(nv, program.settings().safety.max_rows);
  nb::object keep;
  LastCommand last;
  Eigen::VectorXd a, torque, h;
  Eigen::MatrixXd M;
  if (mass_matrix && bias) {
    M = as_matrix(*mass_matrix, "mass_matrix", nv, nv);
    h = as_vector(*bias, "bias", nv);
  }
  if (last_acceleration) {
    a = as_finite_vector(*last_acceleration, "last_acceleration", nv);
    last.acceleration = &a;
  }
  if (last_torque) {
    torque = as_finite_vector(*last_torque, "last_torque", nv);
    last.torque = &torque;
  }
  const Eigen::VectorXd position = as_vector(q, "q", nv), velocity = as_vector(v, "v", nv),
                        wanted = as_vector(acceleration, "acceleration", nv);
  static_cast<void>(
      program.solve({position, velocity, wanted, M, h, as_clearances(clearances, keep), {}, last}, solution));
  return solution;
}

void bind_motion_program(nb::module_& m) {
  const MotionProgramSettings defaults;
  nb::class_<MotionProgram>(m, "MotionProgram",
                            "The acceleration, and the torque for it, nearest to a wanted one within every limit of the arm and its\n"
                            "clearances: minimise 1/2 (x - a)'Q(x - a) + 1/2 t'Rt with t = torque / effort limit, subject to\n"
                            "M x + h = torque, |torque| <= effort limit, lower(q, v) <= x <= upper(q, v).\n"
                            "Source: Bosc, equation T6.3, corrected. One object per thread.")
      .def(
          "__init__",
          make_motion_program,
          nb::arg("robot"), nb::kw_only(), nb::arg("period") = defaults.period, nb::arg("by_torque") = defaults.by_torque,
          nb::arg("tracking_weight") = defaults.tracking_weight[0], nb::arg("torque_weight") = defaults.torque_weight[0],
          nb::arg("slack_weight") = defaults.slack_weight, nb::arg("velocity_overrun") = defaults.velocity_overrun,
          nb::arg("acceleration_overrun") = defaults.acceleration_overrun,
          nb::arg("position_margin") = defaults.position_margin, nb::arg("stop_time") = defaults.stop_time,
          nb::arg("stop_damping") = defaults.stop_damping, nb::arg("safety") = nb::none(),
          "period [s]: time between two steps; by_torque: whether the arm is moved by torque: otherwise velocity and\n"
          "acceleration limits never give way, and no effort is limited; tracking_weight: Q, scalar or (nv,) [per (/s^2)^2];\n"
          "torque_weight: R, scalar or (nv,) [-]; slack_weight [-]: price of leaving the acceleration bounds over the\n"
          "steepest tracking cost; velocity_overrun, acceleration_overrun [-], >= 1: the factor up to which those limits\n"
          "give way to clearances and torque limits;\n"
          "position_margin [rad | m]: position limits are moved inwards by it; stop_time [s]: time constant of the\n"
          "damped stop; stop_damping [-]: its damping without a mass matrix, over effort limit / velocity limit;\n"
          "safety: SafetySettings, by default as they are. Raises ValueError that names the setting.")
      .def(
          "solve",
          solve_motion_program,
          nb::arg("q"), nb::arg("v"), nb::arg("acceleration"), nb::arg("mass_matrix") = nb::none(),
          nb::arg("bias") = nb::none(), nb::kw_only(), nb::arg("clearances").none() = nb::none(),
          nb::arg("last_acceleration") = nb::none(), nb::arg("last_torque") = nb::none(),
          nb::sig("def solve(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, "
                  "acceleration: numpy.typing.ArrayLike, mass_matrix: numpy.typing.ArrayLike | None = None, "
                  "bias: numpy.typing.ArrayLike | None = None, *, clearances: Clearances | Step | None = None, "
                  "last_acceleration: numpy.typing.ArrayLike | None = None, "
                  "last_torque: numpy.typing.ArrayLike | None = None) -> MotionSolution"),
          "One control step: q (nv,) [rad | m], v (nv,) [/s], wanted acceleration (nv,) [/s^2], mass matrix (nv, nv),\n"
          "bias (nv,) [Nm | N] (Coriolis, centrifugal and gravity; both only if by_torque), clearances at (q, v), which a Step\n"
          "has. With the last period's acceleration (nv,) [/s^2] or torque (nv,) [Nm | N], jerk or torque rate keep their limits.\n"
          "Returns a MotionSolution; values that are not finite give a fallback status and a damped stop. Raises ValueError on\n"
          "wrong shapes.")
      .def_prop_ro("period", [](const MotionProgram& p) { return p.settings().period; }, "[s] between two calls.")
      .def_prop_ro("by_torque", [](const MotionProgram& p) { return p.settings().by_torque; }, "Whether the arm is moved by torque.")
      .def_prop_ro("num_coordinates", &MotionProgram::num_coordinates, "Number of joint coordinates nv.")
      .def_prop_ro("program", [](const MotionProgram& p) { return without_unbounded_rows(p.program()); },
                   "The first quadratic program of the last call that had usable input, over the acceleration\n"
                   "[rad/s^2 | m/s^2]; rows without bounds are left out.")
      .def("count", &MotionProgram::count, nb::arg("status"), "Number of solves that ended with this status.");
}

}  // namespace

void bind_control(nb::module_& m) {
  bind_quadratic_program(m);
  bind_acceleration_bounds(m);
  bind_safety(m);
  bind_motion_status(m);
  bind_motion_solution(m);
  bind_motion_program(m);
}

}  // namespace sidestep::python

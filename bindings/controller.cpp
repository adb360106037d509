#include "sidestep/controller/controller.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <limits>

#include "arguments.hpp"
#include "system.hpp"
#include "interruptible.hpp"
#include "module.hpp"
#include "os_errors.hpp"
#include "recording.hpp"
#include "settings.hpp"
#include "sidestep/controller/motion.hpp"

namespace sidestep::python {
namespace {

/// A part that may be left out, as a property; what is written to a part of it counts.
template <class Class, class Owner, class Value>
void optional_part(Class& c, const char* name, const char* type, std::optional<Value> Owner::*member) {
  const std::string get = std::string("def ") + name + "(self) -> " + type + " | None";
  c.def_prop_rw(
      name, [member](Owner& s) -> Value* { return s.*member ? &*(s.*member) : nullptr; },
      [member](Owner& s, std::optional<Value> value) { s.*member = std::move(value); }, nb::arg("value").none(),
      nb::for_getter(nb::sig(get.c_str())));
}

void bind_settings_tree(nb::module_& m) {
  using S = ControllerSettings;
  bind_settings<BarrierSettings>(m, "BarrierSettings", "The spring to the goal, and the barriers that bend its acceleration.");
  bind_settings<ArrivalSettings>(m, "ArrivalSettings", "When a goal counts as reached.");
  bind_settings<TrackingSettings>(
      m, "TrackingSettings",
      "Feedback that keeps the arm on the controller's reference: a = a_r + w^2 (q_r - q) + 2 z w (v_r - v), plus the torque of the\n"
      "disturbance observer. Not used with output position or velocity, which the arm's own drives track.");
  bind_settings<SpeedLimitSettings>(
      m, "SpeedLimitSettings",
      "Limits of Cartesian speed by the distance d to the nearest obstacle, of every frame of the arm (speed and separation): between\n"
      "near and far V^2 = near_speed^2 + (far_speed^2 - near_speed^2) (d - near_distance)/(far_distance - near_distance), [m/s].");
  bind_settings<ContactSettings>(
      m, "ContactSettings",
      "When a torque that neither model, load nor friction explains stops the arm: it waits for `Controller.restart`. With torque\n"
      "output; not with `tracking.stiffness`: such an arm is made to be pushed.");
  bind_settings<InputSettings>(m, "InputSettings", "How velocities, twists and trajectories are followed, see Controller.");
  bind_settings<SourceSettings>(m, "SourceSettings", "How long obstacles are believed, see Controller.set_obstacles.");
  bind_settings<OnlinePlannerSettings>(
      m, "OnlinePlannerSettings", "The planner that runs beside the loop: how it searches, and how its paths are followed.",
      {part("search", "PlannerSettings", &OnlinePlannerSettings::search), part("route", "TimedPathSettings", &OnlinePlannerSettings::route)})
      .def_rw("search", &OnlinePlannerSettings::search)
      .def_rw("route", &OnlinePlannerSettings::route);
  bind_settings<LookAheadSettings>(m, "LookAheadSettings", "Prediction and avoidance of moving obstacles, see Controller.");
  bind_settings<LocalMinimumSettings>(m, "LocalMinimumSettings", "Sub-goals where the arm is stuck and there is no path.");

  nb::enum_<S::Output>(m, "Output",
                       "What is sent to the arm. Torque and acceleration are tracked by the controller, from the measured state;\n"
                       "position and velocity by the arm's own drives.")
      .value("automatic", S::Output::automatic, "Torque where the arm has inertias and effort limits.")
      .value("torque", S::Output::torque)
      .value("acceleration", S::Output::acceleration)
      .value("velocity", S::Output::velocity)
      .value("position", S::Output::position);

  auto c = bind_settings<S>(
      m, "ControllerSettings",
      "All settings of a Controller. Every part but `speed_limits` is on by default; `planner=None`, `look_ahead=None` and\n"
      "`local_minimum=None` leave a part out, for comparisons.",
      {part("barriers", "BarrierSettings", &S::barriers), part("safety", "SafetySettings", &S::safety),
       part("arrival", "ArrivalSettings", &S::arrival), part("tracking", "TrackingSettings", &S::tracking),
       part("speed_limits", "SpeedLimitSettings | None", &S::speed_limits),
       part("inputs", "InputSettings", &S::inputs), part("sources", "SourceSettings", &S::sources),
       part("contact", "ContactSettings", &S::contact),
       part("planner", "OnlinePlannerSettings | None", &S::planner),
       part("look_ahead", "LookAheadSettings | None", &S::look_ahead),
       part("local_minimum", "LocalMinimumSettings | None", &S::local_minimum),
       {"output", "Output | str", [](S& s, nb::handle value) { s.output = as_enum<S::Output>(value, "output"); },
        [](const S& s) { return nb::object(nb::cast(s.output).attr("name")); }}});
  c.def_rw("barriers", &S::barriers)
      .def_rw("safety", &S::safety)
      .def_rw("arrival", &S::arrival)
      .def_rw("tracking", &S::tracking)
      .def_rw("contact", &S::contact)
      .def_rw("inputs", &S::inputs)
      .def_rw("sources", &S::sources)
      .def_rw("output", &S::output)
      .def("validate", &S::validate, "Raises ValueError that names the setting, its value and what is allowed.");
  optional_part(c, "speed_limits", "SpeedLimitSettings", &ControllerSettings::speed_limits);
  optional_part(c, "planner", "OnlinePlannerSettings", &ControllerSettings::planner);
  optional_part(c, "look_ahead", "LookAheadSettings", &ControllerSettings::look_ahead);
  optional_part(c, "local_minimum", "LocalMinimumSettings", &ControllerSettings::local_minimum);

  m.def(
      "controller_settings_fields",
      [] {
        nb::list rows;
        describe_fields<ControllerSettings>(rows, "");
        describe_fields<BarrierSettings>(rows, "barriers.");
        describe_fields<SafetySettings>(rows, "safety.");
        describe_fields<ArrivalSettings>(rows, "arrival.");
        describe_fields<TrackingSettings>(rows, "tracking.");
        describe_fields<SpeedLimitSettings>(rows, "speed_limits.", true);
        describe_fields<ContactSettings>(rows, "contact.");
        describe_fields<InputSettings>(rows, "inputs.");
        describe_fields<SourceSettings>(rows, "sources.");
        describe_fields<OnlinePlannerSettings>(rows, "planner.", true);
        describe_fields<PlannerSettings>(rows, "planner.search.", true);
        describe_fields<TimedPathSettings>(rows, "planner.route.", true);
        describe_fields<LookAheadSettings>(rows, "look_ahead.", true);
        describe_fields<LocalMinimumSettings>(rows, "local_minimum.", true);
        return rows;
      },
      nb::sig("def controller_settings_fields() -> list[dict[str, float | str]]"),
      "Every setting of the tree: name (dotted), unit, default, least and most allowed, what it is and trades, and whether the part\n"
      "that its name begins with is optional, so that None leaves it out.");
}

void bind_command(nb::module_& m) {
  nb::enum_<TrajectoryBehaviour>(m, "TrajectoryBehaviour", "What a Controller does if an obstacle blocks its trajectory.")
      .value("keep_path", TrajectoryBehaviour::keep_path, "Stay on the path: slow down, wait in front of the obstacle, continue when the path is free.")
      .value("steer", TrajectoryBehaviour::steer, "Leave the path to get around the obstacle, then return to it.");
  nb::enum_<TwistFreedom>(m, "TwistFreedom", "Which part of a twist is left free.")
      .value("none", TwistFreedom::none, "Translation and rotation are both commanded.")
      .value("rotation", TwistFreedom::rotation, "Only the velocity of the frame's origin is commanded; its rotation is free.");
  nb::enum_<SafetyStatus>(m, "SafetyStatus", nb::is_arithmetic(), "How safe a command is, by severity. Every command may be sent.")
      .value("ok", SafetyStatus::ok, "The motion is as requested; a velocity or twist is kept within 5 %.")
      .value("limited", SafetyStatus::limited, "A limit of the arm or a clearance changes it.")
      .value("relaxed", SafetyStatus::relaxed, "Limits of jerk, velocity, acceleration or Cartesian speed gave way to clearances, position or torque limits.")
      .value("margin_lost", SafetyStatus::margin_lost, "Not every safety margin or position limit can be kept; nothing is touched.")
      .value("tracking_lost", SafetyStatus::tracking_lost, "The arm is farther from the command than its velocity limits cover in 0.1 s, or no motion explains its measured position: it comes to rest.")
      .value("stale", SafetyStatus::stale, "A source of obstacles is overdue, or none was ever set: the arm stops.")
      .value("stopping", SafetyStatus::stopping, "The input is unusable, the quadratic program was not solved, or the arm feels a torque that nothing explains: a damped stop.")
      .value("clearance_lost", SafetyStatus::clearance_lost, "A covering ellipsoid of the arm reaches into an obstacle, a plane or another link.");
  nb::enum_<Activity>(m, "Activity", "What a controller is doing.")
      .value("no_goal", Activity::no_goal, "No goal, or the commanded velocity is too old: the arm comes to rest, and avoids moving obstacles.")
      .value("moving", Activity::moving, "On the way to its goal, or following a velocity, twist or trajectory.")
      .value("waiting", Activity::waiting, "Waiting until a posture is found, its trajectory is free, or after a touch for `Controller.restart`, or paused for `Controller.resume`.")
      .value("arrived", Activity::arrived, "The goal is reached.")
      .value("blocked", Activity::blocked, "No path leads to the goal, for at least 0.2 s, see Controller.explain; the arm goes as near as it can.")
      .value("stale", Activity::stale, "As SafetyStatus.stale: the arm stops.");

  nb::class_<Command>(m, "Command", "The result of one step of a Controller; arrays are copies.")
      .def_ro("status", &Command::status, "How safe the command is.")
      .def_ro("activity", &Command::activity, "What the controller does.")
      .def_prop_ro("torque", [](const Command& c) { return to_numpy(c.torque); },
                   "(nv,) torque [Nm | N], gravity included; zero without torque output.")
      .def_prop_ro("torque_without_gravity", [](const Command& c) { return to_numpy(c.torque_without_gravity); },
                   "(nv,) torque without gravity [Nm | N], for arms that compensate gravity themselves; nan if the arm has no inertias.")
      .def_prop_ro("acceleration", [](const Command& c) { return to_numpy(c.acceleration); },
                   "(nv,) acceleration of the arm: that of the reference plus feedback [rad/s^2 | m/s^2].")
      .def_prop_ro("wanted", [](const Command& c) { return to_numpy(c.wanted); },
                   "(nv,) desired acceleration: after barriers, before any limit [rad/s^2 | m/s^2].")
      .def_prop_ro("velocity", [](const Command& c) { return to_numpy(c.velocity); },
                   "(nv,) velocity of the reference after this period [rad/s | m/s].")
      .def_prop_ro("position", [](const Command& c) { return to_numpy(c.position); },
                   "(nv,) position of the reference after this period [rad | m]; nan until a state was known.")
      .def_prop_ro("disturbance", [](const Command& c) { return to_numpy(c.observed.disturbance); },
                   "(nv,) disturbance that the observer compensates, with torque output [Nm | N].")
      .def_prop_ro("rotors", [](const Command& c) { return to_numpy(c.observed.rotors); },
                   "(nv,) estimated rotor inertia that the model lacks [kg m^2 | kg].")
      .def_prop_ro("input_change", [](const Command& c) { return to_numpy(c.input_change); },
                   "(nv,) difference between the velocity of the reference after this period and the requested one [rad/s | m/s]. For a\n"
                   "twist V: J^+ (J v - V), damped near singularities; motion in the null space of J does not count. For a\n"
                   "trajectory the requested velocity is that at its clock, at full speed. Zero without one of these.")
      .def_ro("tracking_error", &Command::tracking_error, "Largest joint error between arm and reference [rad | m].")
      .def_ro("deviation", &Command::deviation, "Largest joint distance of the reference from the straight lines between a trajectory's samples [rad | m]; lines within\n"
              "0.05 s of the trajectory's clock count. Before the first sample: distance from the approach to it. See `delay` for\n"
              "how late it is.")
      .def_ro("delay", &Command::delay, "Time by which the trajectory's clock is late [s].")
      .def_ro("clearance", &Command::clearance, "Least clearance of the covering body [m], exact below the activation distances; inf: far; nan: unknown.")
      .def_ro("coordinate", &Command::coordinate, "Index in Controller.labels of the pair with the least clearance; -1: nothing is near.")
      .def_ro("point", &Command::point, "Index of the obstacle point of that pair; -1: none.")
      .def_ro("bound_by", &Command::bound_by, "Index in Controller.labels of the clearance that changes the motion most; -1: none.")
      .def_ro("distance", &Command::distance,
              "Distance to the nearest obstacle [m], up to speed_limits.far_distance; inf: farther, or without these settings; nan: unknown.")
      .def_ro("speed", &Command::speed, "Speed of the arm's fastest frame [m/s]; nan: unknown.")
      .def_ro("speed_limit", &Command::speed_limit, "Speed limit of every frame [m/s]; inf: none; nan: unknown.")
      .def_ro("limits", &Command::limits, "(nv) limits that restrict each joint.")
      .def_ro("avoiding", &Command::avoiding, "Whether the arm follows an avoidance trajectory, out of the way of a moving obstacle.")
      .def_ro("on_path", &Command::on_path, "Whether the arm follows a path of the planner.")
      .def_prop_ro("look_ahead_age", [](const Command& c) { return c.background.look_ahead_age; },
              "Age of the newest look-ahead: time since the state that it started from [s]. It grows if threads get too little processor\n"
              "time, or if steps come faster than real time. 0: look-ahead is off, or runs inside `step`.")
      .def_prop_ro("planner_age", [](const Command& c) { return c.background.planner_age; }, "Age of the planner's newest check, likewise [s]; 0 also if there is nothing to plan.")
      .def_prop_ro("pace", [](const Command& c) { return c.background.pace; },
              "Share of its speed that the arm may use near moving obstacles, given the age of the look-ahead: 1 up to\n"
              "`look_ahead.slow_after` delays, then linear, 0 from `look_ahead.rest_after` delays on.")
      .def_prop_ro("measured_period", [](const Command& c) { return c.timing.measured_period; },
              "Period for which the step commands [s]: that of the settings, unless the last steps came more or less often.")
      .def_prop_ro("late_steps", [](const Command& c) { return c.timing.late_steps; },
              "Steps so far that came more than 1.5 periods of the settings after the one before.")
      .def_prop_ro("missed_periods", [](const Command& c) { return c.timing.missed_periods; },
              "Periods of the settings so far in which a step was missing.")
      .def("__getstate__",
           [](const Command& c) {
             nb::dict state;
             each_field(c, [&](const char* name, const auto& value) {
               using Value = std::remove_cvref_t<decltype(value)>;
               if constexpr (std::is_same_v<Value, Eigen::VectorXd>) {
                 state[name] = to_numpy(value);
               } else {
                 state[name] = value;
               }
             });
             return state;
           },
           nb::sig("def __getstate__(self) -> dict[str, typing.Any]"))
      .def("__setstate__",
           [](Command& c, const nb::dict& state) {
             new (&c) Command(static_cast<int>(nb::len(nb::object(state["position"]))));
             each_field(c, [&](const char* name, auto& value) {
               using Value = std::remove_cvref_t<decltype(value)>;
               if constexpr (std::is_same_v<Value, Eigen::VectorXd>) {
                 value = as_vector(state[name], name);
               } else {
                 value = nb::cast<Value>(state[name]);
               }
             });
           },
           nb::sig("def __setstate__(self, state: dict[str, typing.Any], /) -> None"))
      .def("__repr__", [](const Command& c) {
        return std::string("Command(") + to_string(c.status) + ", " + to_string(c.activity) + ", clearance=" + in_short(c.clearance) +
               " m, speed=" + in_short(c.speed) + " m/s)";
      });
}

constexpr const char* an_arm = "an Arm, such as Arm.load('fr3')";  // Words of messages for the expected argument.

/// Warns of what is implausibly large or heavy.
void check_held(const Attachment& object) {
  constexpr double largest = 5.0, heaviest = 500.0;  // Largest plausible size [m] and mass [kg].
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (std::size_t k = 0; k < object.cover.centres.size(); ++k) {
    const Eigen::Vector3d reach = object.cover.shapes[k].rowwise().norm();
    low = low.cwiseMin(object.cover.centres[k] - reach);
    high = high.cwiseMax(object.cover.centres[k] + reach);
  }
  const double size = (high - low).maxCoeff();
  if (size > largest) {
    warn("attach '" + object.name + "': it is " + in_short(size) + " m long; is its geometry in metres?");
  }
  if (object.inertial.mass > heaviest) {
    warn("attach '" + object.name + "': its mass is " + in_short(object.inertial.mass) + " kg; is that in kg?");
  }
}

/// Warns of what is hard to believe in the order that was set last, see Plausibility.
void warn_of_order(const Controller& controller) {
  if (const std::string question = controller.questions().order; !question.empty()) {
    warn(question);
  }
}

/// What the thread of `step` alone may read, refused while another one has the controller.
template <class Get>
auto of_last_step(Get get) {
  return [get](Controller& self) {
    const Controller::ClaimedController use(self);
    return get(self);
  };
}

}  // namespace

void bind_controller(nb::module_& m) {
  bind_settings_tree(m);
  bind_command(m);

  nb::class_<Controller>(m, "Controller",
                         "Turns the arm's state into a safe command, once a period: planner, barriers, look-ahead and quadratic program in one.\n"
                         "Goals and obstacles may be set from any thread. Raises ValueError that names the setting at fault.")
      .def(
          "__init__",
          [](Controller* self, nb::handle of, nb::handle with) {
            const Arm& arm = as_instance<Arm>(of, "arm", an_arm);
            new (self) Controller(arm, with.is_none() ? ControllerSettings{}
                                                      : as_instance<ControllerSettings>(with, "settings", "ControllerSettings or None"));
            if (self->has_torque() && !arm.has_dynamics()) {
              warn("arm '" + arm.name() + "' has no inertias, so torque output needs the arm's own mass matrix and "
                                        "bias in every step: step(q, v, mass_matrix, bias)");
            }
          },
          nb::arg("arm").none(), nb::arg("settings") = nb::none(),
          nb::sig("def __init__(self, arm: Arm, settings: ControllerSettings | None = None) -> None"))
      .def(
          "set_goal",
          [](Controller& self, nb::handle goal) {
            self.set_goal(as_goal(goal, self.num_coordinates()));
            warn_of_order(self);
          },
          nb::arg("goal").none(),
          nb::sig("def set_goal(self, goal: numpy.typing.ArrayLike | JointGoal | PoseGoal | Sequence[PoseGoal]) -> None"),
          "Sets the goal, from the next step on: a configuration (nv,) [rad | m] within the limits, a moving goal, a pose, or\n"
          "poses of several frames, as of two arms. Joints that no pose needs stay where they are, and avoid obstacles. Raises\n"
          "ValueError that names the joint, its value and what is allowed; the previous goal then stays.")
      .def(
          "set_velocity",
          [](Controller& self, nb::handle v) {
            self.set_velocity(as_vector(v, "v", self.num_coordinates()));
            warn_of_order(self);
          },
          nb::arg("v").none(), nb::sig("def set_velocity(self, v: numpy.typing.ArrayLike) -> None"),
          "Commands joint velocities (nv,) [rad/s | m/s]; needs no goal. One factor scales them down to the limits. A joint stops at\n"
          "its position limit while the others continue. The arm slides along obstacles or stops at them. After `inputs.timeout`\n"
          "without a new request the arm stops. Raises ValueError that names the joint and what is allowed; the previous request\n"
          "then stays.")
      .def(
          "set_twist",
          [](Controller& self, nb::handle frame, nb::handle twist, bool local, nb::handle free) {
            self.set_twist(as_text(frame, "frame", "the name of a link of the arm"), Vector6d(as_vector(twist, "twist", 6)), local,
                           as_enum<TwistFreedom>(free, "free"));
            warn_of_order(self);
          },
          nb::arg("frame").none(), nb::arg("twist").none(), nb::arg("local") = false, nb::arg("free").none() = "none",
          nb::sig("def set_twist(self, frame: str, twist: numpy.typing.ArrayLike, local: bool = False, "
                  "free: TwistFreedom | str = 'none') -> None"),
          "Commands the twist (6,) of a frame: velocity of its origin [m/s] and angular velocity [rad/s], in axes of the world or,\n"
          "with `local`, its own; rows as in `Robot.jacobian`. The frame moves with s times the whole twist, with the largest s\n"
          "in [0, 1] that joint limits and singular configurations allow. With free=\"rotation\" the last three numbers are\n"
          "ignored and the frame may turn: for arms with fewer than six joints. Along obstacles the arm slides;\n"
          "`command.status`, `command.input_change` and `explain` say so. Raises ValueError that lists the known frames, or the\n"
          "values of `free`.")
      .def(
          "set_trajectory",
          [](Controller& self, nb::handle q, nb::handle times, nb::handle behaviour) {
            const Eigen::VectorXd at = as_vector(times, "times");
            const Eigen::MatrixXd rows = as_matrix(q, "q", at.size(), self.num_coordinates());
            self.set_trajectory(rows.transpose(), at, as_enum<TrajectoryBehaviour>(behaviour, "behaviour"));
            warn_of_order(self);
          },
          nb::arg("q").none(), nb::arg("times").none(), nb::arg("behaviour").none() = "keep_path",
          nb::sig("def set_trajectory(self, q: numpy.typing.ArrayLike, times: numpy.typing.ArrayLike, "
                  "behaviour: TrajectoryBehaviour | str = 'keep_path') -> None"),
          "Follows joint positions q (K, nv) [rad | m] at times (K,) [s] after the next step. Times must increase; a sample may be\n"
          "there twice. Cubics between samples keep monotone samples monotone and dwells still, within 0.01 rad (2 mm) of the\n"
          "straight lines. The arm has until the first time, at most 3600 s, to reach the first sample, which may differ from its\n"
          "present state. If time stamps bunch up so that limits forbid them, they move by up to 0.2 s; if that is not enough, the\n"
          "trajectory's clock slows down. Joints without limits take the short way between samples, at most half a turn.\n"
          "`keep_path` slows down and waits in front of an obstacle, `steer` goes around it and returns. `command.deviation` and\n"
          "`command.delay` say how far off and how late the arm is. Raises ValueError that names sample, joint, value and what is allowed.")
      .def("clear_goal", &Controller::clear_goal, "Removes the goal: the arm comes to rest where it is, and still avoids moving obstacles.")
      .def("restart", &Controller::restart,
           "Restarts the reference at the measured state of the next step: call it after something else has moved the arm, or to go on\n"
           "after the arm touched something. The goal stays. Without this call the reference restarts once five measured positions in a row agree with each other but not\n"
           "with the command, or at the first one after a pause of more than 0.1 s; until then the arm comes to rest.")
      .def(
          "continue_from",
          [](Controller& self, const ArrayLike& position, const ArrayLike& velocity, const ArrayLike& acceleration) {
            const int nv = self.num_coordinates();
            const Controller::ClaimedController use(self);
            self.continue_from(as_vector(position, "position", nv), as_vector(velocity, "velocity", nv),
                               as_vector(acceleration, "acceleration", nv));
          },
          nb::arg("position"), nb::arg("velocity"), nb::arg("acceleration"),
          "What the arm's drives say that they go on from (nv,), for outputs of positions: the reference of the next step begins there.\n"
          "For loops of one's own, before `step`, where a command did not reach the drives. Other outputs ignore it. Raises\n"
          "RuntimeError while a Loop or `integrate` has the controller: a Loop tells it by itself.")
      .def("pause", &Controller::pause,
           "The arm comes to rest within its limits and clearances, and stays there until `resume`; its goal or request is kept. The\n"
           "activity is `waiting` then. From any thread.")
      .def("resume", &Controller::resume, "Goes on to the goal after `pause`.")
      .def_prop_ro("is_paused", &Controller::is_paused, "Whether the arm rests until `resume`.")
      .def(
          "set_arm",
          [](Controller& self, nb::handle other) {
            const Arm& arm = as_instance<Arm>(other, "arm", an_arm);
            const nb::gil_scoped_release others;
            self.set_arm(arm);
          },
          nb::arg("arm").none(), nb::sig("def set_arm(self, arm: Arm) -> None"),
          "Replaces body, inertias and pairs, for example by a finer cover; joints and limits must be the same. Takes some tenths of\n"
          "a second beside the loop; the next step uses the new body. Objects stay attached; the planner plans again.\n"
          "Raises ValueError that says what differs.")
      .def(
          "attach",
          [](Controller& self, nb::handle object, nb::handle geometry, nb::kwargs options) {
            const bool is_made = nb::isinstance<Attachment>(object);
            if (is_made != geometry.is_none()) {
              throw nb::value_error("attach: give a name and a geometry, or an Attachment alone");
            }
            const Attachment made = is_made ? nb::cast<Attachment>(object)
                                            : nb::cast<Attachment>(nb::module_::import_("sidestep.arm.attachment")
                                                                       .attr("attachment")(object, geometry, **options));
            check_held(made);
            std::string doubt;
            {
              const nb::gil_scoped_release others;
              doubt = self.attach(made);
            }
            if (!doubt.empty()) {
              warn(doubt);
            }
          },
          nb::arg("object").none(), nb::arg("geometry") = nb::none(), nb::arg("options"),
          nb::sig("def attach(self, object: str | Attachment, geometry: sidestep.obstacles.Shape | numpy.typing.ArrayLike | None = None, "
                  "**options: typing.Any) -> None"),
          "Attaches an object to a link, from the next step on: attach(\"cup\", Cylinder(0.04, 0.1), link=\"fr3_hand\", pose=X,\n"
          "mass=0.3, may_touch=[\"fr3_leftfinger\", \"fr3_rightfinger\"]), with the options of `sidestep.arm.attachment`; a\n"
          "shape, or points (N, 3) in the object's frame. The object avoids obstacles and the links that other joints move, and its\n"
          "mass counts. Links that overlap with it now may stay as close as they are. With rests_on=[\"table\"] it may also stay as\n"
          "close to the obstacle 'table' as it is now, until it is lifted off. Takes less than a second, while steps continue.\n"
          "Raises ValueError that names what is wrong; nothing changes then. Warns if the object is far from the link.")
      .def(
          "detach",
          [](Controller& self, nb::handle object) {
            const std::string name = as_text(object, "name", "the name of an object that is attached");
            const nb::gil_scoped_release others;
            self.detach(name);
          },
          nb::arg("name").none(), nb::sig("def detach(self, name: str) -> None"), "Releases an object, from the next step on. Raises ValueError that lists the attached objects.")
      .def_prop_ro("attached", &Controller::attached, "Names of the attached objects.")
      .def_prop_ro("arm", &Controller::arm, "The arm (of the core), with what is attached.")
      .def_prop_ro("obstacles", of_last_step([](const Controller& self) { return Obstacles(self.obstacles()); }),
                   "A copy of what the last step saw; `name_of(command.point)` of it is the name of what is nearest.")
      .def(
          "step",
          [](Controller& self, nb::handle q, nb::handle v, nb::handle mass_matrix, nb::handle bias, nb::handle time) {
            const int nv = self.num_coordinates();
            const Eigen::VectorXd position = as_vector(q, "q", nv), velocity = as_vector(v, "v", nv);
            if (mass_matrix.is_none() != bias.is_none()) {
              throw nb::value_error("mass_matrix and bias go together: give both or none");
            }
            const double now = as_seconds(time, "time");
            const Controller::ClaimedController use(self);
            Command command = mass_matrix.is_none() ? self.step(position, velocity, now)
                                                    : self.step(position, velocity, as_matrix(mass_matrix, "mass_matrix", nv, nv),
                                                                as_vector(bias, "bias", nv), now);
            if (self.stepped_in_turn()) {
              warn("several threads step this controller in turn: give each loop a controller of its own, or step from one thread");
            }
            return command;
          },
          nb::arg("q").none(), nb::arg("v").none(), nb::arg("mass_matrix") = nb::none(), nb::arg("bias") = nb::none(),
          nb::kw_only(), nb::arg("time") = nb::none(),
          nb::sig("def step(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, "
                  "mass_matrix: numpy.typing.ArrayLike | None = None, bias: numpy.typing.ArrayLike | None = None, *, "
                  "time: float | None = None) -> Command"),
          "One period at q (nv,) [rad | m] and v (nv,) [/s], perhaps with the arm's own mass matrix (nv, nv) and bias (nv,)\n"
          "[Nm | N] there. `time`: when q and v were measured, on a monotonic clock of yours [s]; without it (None or nan) the machine's\n"
          "clock counts, and in synchronous runs exactly a period. A time that goes back gives a damped stop. Values that are not finite give a damped stop. Raises ValueError on wrong shapes, RuntimeError\n"
          "while a Loop or `integrate` has the controller; so does what tells of the last step. Warns where several threads\n"
          "step it in turn.")
      .def(
          "record",
          [](Controller& self, const std::filesystem::path& path) {
            const Controller::ClaimedController use(self);
            with_os_errors(path, [&] { self.record(path); });
            return RecordingInProgress{&self, path, {}};
          },
          nb::arg("path"), nb::keep_alive<0, 1>(), nb::sig("def record(self, path: str | os.PathLike[str]) -> Recording"),
          "Records every input of every step and its command to a file, from which `replay` gives the same commands bit for bit.\n"
          "Before the first step; `with controller.record(path):` ends it with the block, else it ends with the controller. Steps\n"
          "allocate nothing for it and wait for nobody; where the disk is too slow it ends, and the steps after that are counted. Raises\n"
          "RuntimeError after the first step or where one was recorded already, OSError where the file cannot be written.")
      .def(
          "black_box",
          [](Controller& self, const std::filesystem::path& folder, double seconds, std::uint64_t most_bytes) {
            with_os_errors(folder, [&] {
              const nb::gil_scoped_release others;
              self.black_box(folder, seconds, most_bytes);
            });
            return BlackBoxInProgress{&self, folder, {}};
          },
          nb::arg("folder"), nb::arg("seconds") = 30.0, nb::kw_only(), nb::arg("most_bytes") = black_box_bytes,
          nb::keep_alive<0, 1>(),
          nb::sig("def black_box(self, folder: str | os.PathLike[str], seconds: float = 30.0, *, most_bytes: int = 1073741824) "
                  "-> BlackBox"),
          "Keeps the last `seconds` (up to a third more) on disk from now on, in files of a third of that each; older ones are deleted.\n"
          "The folder is kept near most_bytes: where they are reached, less than `seconds` are there, and the file being written comes\n"
          "on top. For `load_recording` and `sidestep report`: what begins in the middle of a motion cannot be replayed. From any\n"
          "thread, at any time, beside a recording. `with controller.black_box(folder):` ends it with the block. Raises RuntimeError\n"
          "where it is on, ValueError, OSError where nothing can be written.")
      .def_prop_ro("command", of_last_step([](const Controller& self) { return Command(self.command()); }), "Of the last step.")
      .def("explain", of_last_step([](const Controller& self) { return self.explain(); }),
           "One sentence: what the last command does and why, and what to do about it.")
      .def_prop_ro("questions", [](const Controller& self) { return self.questions().all(); },
                   "What is hard to believe in the order and the obstacles that were set last, with value and likely cause, such as\n"
                   "millimetres for metres; setters warn of it, and it is followed all the same. The newest is the last.")
      .def_prop_ro("settings", [](const Controller& self) { return ControllerSettings(self.settings()); }, "A copy.")
      .def_prop_ro("values", of_last_step([](const Controller& self) { return to_numpy(self.workspace().values); }),
                   "(m,) psi of every coordinate at the last step, see labels.")
      .def_prop_ro(
          "geometric_step",
          of_last_step([](const Controller& self) {
            return Step{self.part_results().attraction, self.workspace(),
                        Explanation(self.system(), self.system().diagnose(self.workspace()), self.obstacles())};
          }),
          "The Step of the geometric system in the last step, with its clearances, metric and diagnosis.")
      .def_prop_ro("system", [](const Controller& self) { return GeometricSystem(self.system()); },
                   "The geometric system, a copy. Its barriers begin at full distance, see activations.")
      .def_prop_ro("activations", [](const Controller& self) { return to_numpy(self.workspace().activations); },
                   "(m,) clearance [m | rad] at which each barrier begins now: less than set where the arm has to come near what\n"
                   "rests, at its goal and in narrow places of its path.")
      .def_prop_ro("labels", [](const Controller& self) { return self.labels(); }, "What the clearances are of.")
      .def_prop_ro("target",
                   [](const Controller& self) -> nb::object {
                     const Eigen::VectorXd q = self.target();
                     return q.size() == 0 ? nb::none() : nb::object(nb::cast(to_numpy(q)));
                   },
                   nb::sig("def target(self) -> numpy.typing.NDArray[numpy.float64] | None"),
                   "(nv,) the configuration that the arm is led to: the goal, or a posture of a pose goal; None: none yet.")
      .def_prop_ro("plan", [](const Controller& self) { return self.last_plan(); }, "What the planner found last.")
      .def_prop_ro("goal_obstruction", &Controller::goal_obstruction,
                   nb::sig("def goal_obstruction(self) -> Obstruction | None"),
                   "What the covering body touches at the goal, or at the posture found for a pose, among the obstacles as they "
                   "were set; None: it is free there, or there is no goal.")
      .def_prop_ro("searches", [](const Controller& self) { return self.planner_counts().searches; },
                   "How often a path was looked for.")
      .def_prop_ro("has_torque", &Controller::has_torque, "Whether the commands hold torque.")
      .def("__repr__", [](const Controller& self) {
        return "Controller(arm '" + self.arm().name() + "', " + std::to_string(self.num_coordinates()) + " coordinates)";
      });

  m.def("program_status", of_last_step([](const Controller& self) { return self.part_results().program; }), nb::arg("controller"),
        "How the quadratic program ended in the last step, for tests; `command.status` is what counts.");
  m.def("looks_like_degrees", &looks_like_degrees, nb::arg("angle"),
        "Whether an angle [rad] is implausible in radians and plausible in degrees: more than one and a half turns, at most\n"
        "three in degrees, and not a whole number of quarter turns.");
  m.def("unlimited_joints", &unlimited_joints, nb::arg("robot"),
        "(nv) Which coordinates turn without limits, so that a configuration is the same a turn further.");
  nb::class_<MotionRecord>(m, "MotionRecord", "A motion of a controller without physics: row k is what step k began with and gave.")
      .def_prop_ro("q", [](const MotionRecord& r) { return to_numpy_matrix(r.q); }, "(steps, nv).")
      .def_prop_ro("v", [](const MotionRecord& r) { return to_numpy_matrix(r.v); }, "(steps, nv).")
      .def_prop_ro("acceleration", [](const MotionRecord& r) { return to_numpy_matrix(r.acceleration); }, "(steps, nv).")
      .def_ro("statuses", &MotionRecord::statuses, "(steps,) How safe each command was.")
      .def_ro("activities", &MotionRecord::activities, "(steps,) What the controller did.")
      .def_prop_ro("clearance", [](const MotionRecord& r) { return to_numpy(r.clearance); }, "(steps,) of the covering body [m].")
      .def_prop_ro("step_seconds", [](const MotionRecord& r) { return to_numpy(r.step_seconds); }, "(steps,) [s].")
      .def_prop_ro("last_q", [](const MotionRecord& r) { return to_numpy(r.last_q); }, "(nv,) after the last step.")
      .def_prop_ro("last_v", [](const MotionRecord& r) { return to_numpy(r.last_v); }, "(nv,) after the last step.")
      .def_ro("arrived", &MotionRecord::arrived, "Every joint came within the tolerance of the goal, which ended the motion.")
      .def("__repr__", [](const MotionRecord& r) {
        const std::string least = r.clearance.size() == 0 ? "nan" : in_short(r.clearance.minCoeff());
        return "MotionRecord(" + std::to_string(r.q.rows()) + " steps, " + (r.arrived ? "arrived, " : "") + "least clearance=" + least +
               " m)";
      });
  m.def(
      "integrate",
      [](Controller& controller, nb::handle q, nb::handle v, int steps, nb::handle goal, double tolerance) {
        const int nv = controller.num_coordinates();
        const Eigen::VectorXd position = as_vector(q, "q", nv), velocity = as_vector(v, "v", nv),
                              end = goal.is_none() ? Eigen::VectorXd() : as_vector(goal, "goal", nv);
        const Controller::ClaimedController use(controller);
        return interruptible([&](const Interrupted& interrupted) {
          return integrate(controller, position, velocity, steps, end, tolerance, interrupted);
        });
      },
      nb::arg("controller"), nb::arg("q").none(), nb::arg("v").none(), nb::kw_only(), nb::arg("steps"), nb::arg("goal") = nb::none(),
      nb::arg("tolerance") = 0.0,
      nb::sig("def integrate(controller: Controller, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, *, steps: int, "
              "goal: numpy.typing.ArrayLike | None = None, tolerance: float = 0.0) -> MotionRecord"),
      "Moves an ideal robot, which tracks the command exactly, by semi-implicit Euler: v += a T, q += v T. Ends when every joint\n"
      "is within tolerance [rad], a prismatic one within a tenth of it [m], of goal (nv,), if given. Releases the GIL. Raises\n"
      "ValueError on sizes, states that are not finite, less than one step, and a controller that is not synchronous.");
}

}  // namespace sidestep::python

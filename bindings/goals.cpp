#include <nanobind/stl/string.h>

#include <cmath>
#include <limits>
#include <sstream>

#include "system.hpp"
#include "sidestep/controller/posture_search.hpp"
#include "sidestep/attractor/goal.hpp"

namespace sidestep::python {

Goal as_goal(nb::handle value, Eigen::Index nv) {
  if ((nb::isinstance<nb::list>(value) || nb::isinstance<nb::tuple>(value)) && nb::len(value) > 0 &&
      nb::isinstance<PoseGoal>(value[0])) {
    PoseGoal all = nb::cast<const PoseGoal&>(value[0]);
    for (std::size_t k = 1; k < nb::len(value); ++k) {
      if (!nb::isinstance<PoseGoal>(value[k])) {
        throw nb::type_error("goal: a list holds pose goals alone");
      }
      all.add(nb::cast<const PoseGoal&>(value[k]));
    }
    return all;
  }
  if (nb::isinstance<PoseGoal>(value)) {
    return nb::cast<const PoseGoal&>(value);
  }
  if (nb::isinstance<JointGoal>(value)) {
    const auto& goal = nb::cast<const JointGoal&>(value);
    if (goal.position.size() != nv) {
      throw nb::value_error(("goal has " + std::to_string(goal.position.size()) + " entries, expected " +
                             std::to_string(nv)).c_str());
    }
    return goal;
  }
  if (value.is_none()) {
    raise_type(value, "goal", "a configuration, a JointGoal, a PoseGoal or a list of PoseGoal; clear_goal() of a Controller takes "
                              "its goal away");
  }
  return JointGoal(as_vector(value, "goal", nv));
}

Eigen::Isometry3d as_pose(nb::handle value, bool position_only) {
  const Array array = as_array(value, "pose");
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  if (position_only && array.ndim() == 1) {
    pose.translation() = as_finite_vector(value, "pose", 3);
    return pose;
  }
  const Eigen::MatrixXd matrix = as_matrix(value, "pose", 4, 4);
  for (Eigen::Index row = 0; row < 4; ++row) {
    for (Eigen::Index column = 0; column < 4; ++column) {
      if (!std::isfinite(matrix(row, column))) {
        throw nb::value_error(("pose[" + std::to_string(row) + ", " + std::to_string(column) + "] is " +
                               std::to_string(matrix(row, column)) + ", must be a finite number")
                                  .c_str());
      }
    }
  }
  pose.linear() = matrix.topLeftCorner<3, 3>();
  pose.translation() = matrix.topRightCorner<3, 1>();
  const Eigen::Matrix3d R = pose.linear();
  const double off = rotation_defect(R);
  if (off >= rotation_tolerance && off <= rotation_rounding && R.determinant() > 0.0) {
    std::ostringstream words;
    words.precision(2);
    words << "pose: its rotation R was rounded, an entry of R^T R - 1 is " << off
          << "; the nearest rotation is taken: give more digits, or normalise the quaternion";
    warn(words.str());
    pose.linear() = nearest_rotation(R);
  }
  return pose;
}

namespace {

nb::tuple pose_goal_state(const PoseGoal& g) {
  const PoseGoal::MadeFor& made_for = g.made_for();
  nb::list others;
  for (const PoseGoal& other : g.others) {
    others.append(pose_goal_state(other));
  }
  return nb::make_tuple(made_for.frame.name, made_for.frame.joint, to_numpy_matrix(made_for.frame.X_JF.matrix()), made_for.joints_hash,
                        made_for.reach, to_numpy(made_for.shoulder), to_numpy_matrix(g.pose.matrix()), to_numpy(g.twist),
                        g.settings.position_only, g.settings.position_stiffness, g.settings.orientation_stiffness,
                        to_numpy(g.settings.rest), g.settings.posture_stiffness, others);
}

PoseGoal pose_goal_of(const nb::tuple& state) {
  const auto number = [&](std::size_t k) { return nb::cast<double>(state[k]); };
  Eigen::Isometry3d X_JF, pose;
  X_JF.matrix() = as_matrix(state[2], "frame", 4, 4);
  pose.matrix() = as_matrix(state[6], "pose", 4, 4);
  PoseGoal goal({{nb::cast<std::string>(state[0]), nb::cast<int>(state[1]), X_JF}, nb::cast<std::uint64_t>(state[3]), number(4),
                 as_vector(state[5], "shoulder", 3)},
                pose, {nb::cast<bool>(state[8]), number(9), number(10), as_vector(state[11], "rest"), number(12)},
                Vector6d(as_vector(state[7], "twist", 6)));
  for (nb::handle other : nb::list(state[13])) {
    goal.others.push_back(pose_goal_of(nb::cast<nb::tuple>(other)));
  }
  return goal;
}

}  // namespace

void bind_goals(nb::module_& m) {
  nb::class_<JointGoal>(m, "JointGoal",
                        "A configuration as a goal: U = (q - q*)^T K (q - q*) / 2 with the system's stiffness K.\n"
                        "position q* (nv,) [rad]; velocity dq*/dt (nv,) [rad/s] and acceleration (nv,) [rad/s^2] of a goal that moves,\n"
                        "zero by default. Raises ValueError on sizes, and names the first number that is not finite.")
      .def(
          "__init__",
          [](JointGoal* self, const ArrayLike& position, nb::handle velocity, nb::handle acceleration) {
            Eigen::VectorXd q = as_finite_vector(position, "position");
            const Eigen::Index nv = q.size();
            const auto rate = [nv](nb::handle value, const char* name) {
              return value.is_none() ? Eigen::VectorXd(Eigen::VectorXd::Zero(nv)) : as_finite_vector(value, name, nv);
            };
            new (self) JointGoal(std::move(q), rate(velocity, "velocity"), rate(acceleration, "acceleration"));
          },
          nb::arg("position").none(), nb::arg("velocity") = nb::none(), nb::arg("acceleration") = nb::none(),
          nb::sig("def __init__(self, position: numpy.typing.ArrayLike, velocity: numpy.typing.ArrayLike | None = None, "
                  "acceleration: numpy.typing.ArrayLike | None = None) -> None"))
      .def_prop_ro("position", [](const JointGoal& g) { return to_numpy(g.position); })
      .def_prop_ro("velocity", [](const JointGoal& g) { return to_numpy(g.velocity); })
      .def_prop_ro("acceleration", [](const JointGoal& g) { return to_numpy(g.acceleration); })
      .def("__getstate__",
           [](const JointGoal& g) { return nb::make_tuple(to_numpy(g.position), to_numpy(g.velocity), to_numpy(g.acceleration)); },
           nb::sig("def __getstate__(self) -> tuple[typing.Any, ...]"))
      .def("__setstate__",
           [](JointGoal& g, const nb::tuple& state) {
             new (&g) JointGoal(as_finite_vector(state[0], "position"), as_finite_vector(state[1], "velocity"),
                                as_finite_vector(state[2], "acceleration"));
           },
           nb::sig("def __setstate__(self, state: tuple[typing.Any, ...], /) -> None"))
      .def("__eq__",
           [](const JointGoal& g, nb::handle other) {
             if (!nb::isinstance<JointGoal>(other)) {
               return false;
             }
             const auto& o = nb::cast<const JointGoal&>(other);
             return g.position.size() == o.position.size() && g.position == o.position && g.velocity == o.velocity &&
                    g.acceleration == o.acceleration;
           },
           nb::arg("other").none(), nb::sig("def __eq__(self, other: object, /) -> bool"))
      .def("__hash__", [](const JointGoal& g) { return nb::hash(nb::bytes(g.position.data(), sizeof(double) * g.position.size())); })
      .def("__repr__", [](const JointGoal& g) { return "JointGoal(" + in_short(g.position) + (is_moving(g) ? ", moves)" : ")"); });

  nb::class_<PoseGoal>(
      m, "PoseGoal",
      "A pose of a frame as a goal,\n"
      "    U = k_p |p - p*|^2 / 2 + k_R |log(R*^T R)|^2 / 2.\n"
      "pose (4, 4) in the world, or (3,) where position_only. position_stiffness k_p [1/(m s)^2],\n"
      "orientation_stiffness k_R [1/s^2]. rest (nv,) with posture_stiffness [1/s^2]: a configuration that the joints are\n"
      "drawn to where the pose leaves them free. twist (6,): how the goal moves in the world, velocity of its origin\n"
      "[m/s] and angular velocity [rad/s]. At half a turn both ways back are equally short; one is taken.\n"
      "Where an entry of R^T R - 1 is up to 0.01, as of a quaternion of three digits, the nearest rotation is taken, with a\n"
      "warning that says by how much.\n"
      "Raises ValueError on a frame that is unknown or that no joint moves (listing the allowed ones), a rotation that is\n"
      "none, a number that is not finite, a stiffness out of range. A pose out of reach gives a status in the step.")
      .def(
          "__init__",
          [](PoseGoal* self, nb::handle made_for, nb::handle frame, const ArrayLike& pose, bool position_only,
             double position_stiffness, double orientation_stiffness, nb::handle rest, double posture_stiffness,
             nb::handle twist) {
            const Robot& robot = as_instance<Robot>(made_for, "robot", "a Robot, as Arm.robot is");
            const int nv = robot.num_coordinates();
            new (self) PoseGoal(robot, as_text(frame, "frame", "the name of a link of the robot"), as_pose(pose, position_only),
                                {position_only, position_stiffness, orientation_stiffness,
                                 rest.is_none() ? Eigen::VectorXd() : as_finite_vector(rest, "rest", nv), posture_stiffness},
                                twist.is_none() ? Vector6d(Vector6d::Zero()) : Vector6d(as_finite_vector(twist, "twist", 6)));
          },
          nb::arg("robot").none(), nb::arg("frame").none(), nb::arg("pose").none(), nb::kw_only(), nb::arg("position_only") = false,
          nb::arg("position_stiffness") = PoseGoalSettings().position_stiffness,
          nb::arg("orientation_stiffness") = PoseGoalSettings().orientation_stiffness, nb::arg("rest") = nb::none(),
          nb::arg("posture_stiffness") = 0.0, nb::arg("twist") = nb::none(),
          nb::sig("def __init__(self, robot: Robot, frame: str, pose: numpy.typing.ArrayLike, *, position_only: bool = "
                  "False, position_stiffness: float = 4.0, orientation_stiffness: float = 0.5, rest: "
                  "numpy.typing.ArrayLike | None = None, posture_stiffness: float = 0.0, twist: "
                  "numpy.typing.ArrayLike | None = None) -> None"))
      .def_prop_ro("frame", [](const PoseGoal& g) { return g.frame().name; })
      .def_prop_ro("pose", [](const PoseGoal& g) { return to_numpy_matrix(g.pose.matrix()); }, "(4, 4) in the world.")
      .def_prop_ro("position_only", [](const PoseGoal& g) { return g.settings.position_only; })
      .def("__getstate__", [](const PoseGoal& g) { return pose_goal_state(g); }, nb::sig("def __getstate__(self) -> tuple[typing.Any, ...]"))
      .def("__setstate__", [](PoseGoal& g, const nb::tuple& state) { new (&g) PoseGoal(pose_goal_of(state)); },
           nb::sig("def __setstate__(self, state: tuple[typing.Any, ...], /) -> None"))
      .def("__eq__",
           [](const PoseGoal& g, nb::handle other) {
             return nb::isinstance<PoseGoal>(other) &&
                    nb::bytes(nb::module_::import_("pickle").attr("dumps")(pose_goal_state(g)))
                        .equal(nb::bytes(nb::module_::import_("pickle").attr("dumps")(pose_goal_state(nb::cast<const PoseGoal&>(other)))));
           },
           nb::arg("other").none(), nb::sig("def __eq__(self, other: object, /) -> bool"))
      .def("__hash__", [](const PoseGoal& g) { return nb::hash(nb::module_::import_("pickle").attr("dumps")(pose_goal_state(g))); })
      .def("__repr__", [](const PoseGoal& g) {
        return "PoseGoal('" + g.frame().name + "' at " + in_short(g.pose.translation()) + " m" +
               (g.settings.position_only ? ", position_only" : "") + (is_moving(g) ? ", moves)" : ")");
      });

  m.def(
      "find_posture",
      [](const Robot& robot, const PoseGoal& goal, const ArrayLike& near, int starts, std::uint64_t seed) {
        const Eigen::VectorXd from = as_vector(near, "near", robot.num_coordinates());
        if (!from.allFinite() || !goal.pose.matrix().allFinite()) {
          throw nb::value_error("find_posture: near and the pose must be finite");
        }
        if (!goal.is_for(robot)) {
          throw nb::value_error("find_posture: the pose goal is of another robot");
        }
        if (starts < 1) {
          throw nb::value_error(("find_posture: starts is " + std::to_string(starts) + ", allowed: from 1").c_str());
        }
        PostureSearchSettings settings;
        settings.starts = starts;
        settings.seed = seed;
        const Posture posture = find_posture(robot, goal, from, settings, [](const Eigen::VectorXd&) { return std::numeric_limits<double>::infinity(); });
        return nb::make_tuple(to_numpy(posture.q), posture.position_error, posture.rotation_error);
      },
      nb::arg("robot"), nb::arg("goal"), nb::arg("near"), nb::kw_only(), nb::arg("starts") = 1, nb::arg("seed") = 0,
      nb::sig("def find_posture(robot: Robot, goal: PoseGoal, near: numpy.typing.ArrayLike, *, starts: int = 1, seed: int = 0) "
              "-> tuple[numpy.typing.NDArray[numpy.float64], float, float]"),
      "A configuration within the limits with the frame at the pose, by damped least squares from q = near:\n"
      "    q <- clip(q + J^T (J J^T + lambda^2 I)^-1 e),    e = (p* - p, log(R* R^T)),\n"
      "lambda shrinking with the error (Nakamura and Hanafusa 1986); where that does not get there, from up to `starts`\n"
      "configurations ever farther away, the same ones for one seed. Returns q (nv,), the distance [m] and the angle [rad]\n"
      "that are left: below 1e-7 it is there, else it is the nearest that was found. Knows of no obstacles.\n"
      "Raises ValueError on sizes, what is not finite, and a goal of another robot.");
}

}  // namespace sidestep::python

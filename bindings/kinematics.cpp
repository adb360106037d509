#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "arguments.hpp"
#include "module.hpp"
#include "sidestep/robot/kinematic_state.hpp"

namespace sidestep::python {
namespace {

Eigen::Isometry3d as_pose(nb::handle value, const char* name) {
  Eigen::Isometry3d X;
  X.matrix() = as_matrix(value, name, 4, 4);
  return X;
}

/// The kinematic state at (q, v); v may be None. Raises ValueError on wrong shapes and numbers that are not finite.
KinematicState state_at(const Robot& robot, nb::handle q, nb::handle v = nb::handle()) {
  KinematicState state(robot);
  const Eigen::VectorXd position = as_finite_vector(q, "q", robot.num_coordinates());
  Eigen::VectorXd velocity = Eigen::VectorXd::Zero(robot.num_coordinates());
  if (v.is_valid()) {
    velocity = as_finite_vector(v, "v", robot.num_coordinates());
  }
  state.update(robot, position, velocity);
  return state;
}

}  // namespace

void bind_kinematics(nb::module_& m) {
  nb::enum_<JointType>(m, "JointType", "How a joint moves its child. A continuous joint is revolute without limits.")
      .value("revolute", JointType::revolute)
      .value("prismatic", JointType::prismatic);

  nb::class_<Joint>(m, "Joint", "One moving joint; fixed and locked joints are folded into placements.")
      .def(
          "__init__",
          [](Joint* self, std::string name, JointType type, int parent, const ArrayLike& placement, const ArrayLike& axis,
             int coordinate, double multiplier, double offset) {
            new (self) Joint{std::move(name), type,       parent,     as_pose(placement, "placement"),
                             as_vector(axis, "axis", 3), coordinate, multiplier, offset};
          },
          nb::arg("name"), nb::arg("type"), nb::kw_only(), nb::arg("parent"), nb::arg("placement"), nb::arg("axis"),
          nb::arg("coordinate"), nb::arg("multiplier") = 1.0, nb::arg("offset") = 0.0,
          "placement (4, 4): pose of the joint at zero motion in the parent joint's frame (-1: the world);\n"
          "axis (3,): unit vector in the joint frame; the motion is multiplier * q[coordinate] + offset.")
      .def_ro("name", &Joint::name)
      .def_ro("type", &Joint::type)
      .def_ro("parent", &Joint::parent)
      .def_prop_ro("placement", [](const Joint& j) { return to_numpy_matrix(j.X_PJ.matrix()); })
      .def_prop_ro("axis", [](const Joint& j) { return to_numpy(j.axis); })
      .def_ro("coordinate", &Joint::coordinate)
      .def_ro("multiplier", &Joint::multiplier)
      .def_ro("offset", &Joint::offset);

  nb::class_<Frame>(m, "Frame", "A named link frame, rigidly attached to the child of a joint (-1: to the world).")
      .def(
          "__init__",
          [](Frame* self, std::string name, int joint, const ArrayLike& placement) {
            new (self) Frame{std::move(name), joint, as_pose(placement, "placement")};
          },
          nb::arg("name"), nb::kw_only(), nb::arg("joint"), nb::arg("placement"))
      .def_ro("name", &Frame::name)
      .def_ro("joint", &Frame::joint)
      .def_prop_ro("placement", [](const Frame& f) { return to_numpy_matrix(f.X_JF.matrix()); });

  nb::class_<JointLimits>(m, "JointLimits",
                          "Per-coordinate limits: position [rad | m], velocity [/s], acceleration [/s^2], "
                          "effort [Nm | N], jerk [/s^3], effort rate [Nm/s | N/s]. Each (nv,); position bounds may be "
                          "infinite, the others are positive. Without `jerk` it is 100/s times the acceleration; without "
                          "`effort_rate` there is no limit.")
      .def(
          "__init__",
          [](JointLimits* self, const ArrayLike& lower, const ArrayLike& upper, const ArrayLike& velocity, const ArrayLike& acceleration,
             const ArrayLike& effort, const std::optional<ArrayLike>& jerk, const std::optional<ArrayLike>& effort_rate) {
            new (self) JointLimits{as_vector(lower, "lower"), as_vector(upper, "upper"),
                                   as_vector(velocity, "velocity"), as_vector(acceleration, "acceleration"),
                                   as_vector(effort, "effort"),
                                   jerk ? as_vector(*jerk, "jerk") : Eigen::VectorXd(),
                                   effort_rate ? as_vector(*effort_rate, "effort_rate") : Eigen::VectorXd()};
          },
          nb::kw_only(), nb::arg("lower"), nb::arg("upper"), nb::arg("velocity"), nb::arg("acceleration"),
          nb::arg("effort"), nb::arg("jerk") = nb::none(), nb::arg("effort_rate") = nb::none())
      .def_prop_ro("lower", [](const JointLimits& l) { return to_numpy(l.lower); })
      .def_prop_ro("upper", [](const JointLimits& l) { return to_numpy(l.upper); })
      .def_prop_ro("velocity", [](const JointLimits& l) { return to_numpy(l.velocity); })
      .def_prop_ro("acceleration", [](const JointLimits& l) { return to_numpy(l.acceleration); })
      .def_prop_ro("effort", [](const JointLimits& l) { return to_numpy(l.effort); })
      .def_prop_ro("jerk", [](const JointLimits& l) { return to_numpy(l.jerk); })
      .def_prop_ro("effort_rate", [](const JointLimits& l) { return to_numpy(l.effort_rate); })
      .def_prop_ro_static("rounding", [](nb::handle) { return JointLimits::rounding; },
                          "[rad | m] by which a measured or published configuration may be outside the position limits and is "
                          "taken in as the nearest one within.");

  nb::class_<Robot>(m, "Robot", "The immutable kinematic model of an arm, in the core.")
      .def(nb::init<std::string, std::vector<Joint>, std::vector<Frame>, std::vector<std::string>, JointLimits>(),
           nb::arg("name"), nb::kw_only(), nb::arg("joints"), nb::arg("frames"), nb::arg("coordinate_names"),
           nb::arg("limits"))
      .def("__repr__", [](const Robot& r) { return "Robot('" + r.name() + "', " + std::to_string(r.num_coordinates()) + " coordinates)"; })
      .def_prop_ro("name", &Robot::name, "What messages call the arm.")
      .def_prop_ro("num_coordinates", &Robot::num_coordinates, "Number of joint coordinates nv (= nq).")
      .def_prop_ro("joints", [](const Robot& r) { return r.joints(); }, "Every joint, parents first.")
      .def_prop_ro("frames", [](const Robot& r) { return r.frames(); }, "Every frame, such as links.")
      .def_prop_ro("coordinate_names", [](const Robot& r) { return r.coordinate_names(); }, "(nv,) Names of the joint coordinates.")
      .def_prop_ro(
          "coordinate_units",
          [](const Robot& r) {
            std::vector<std::string> units;
            for (int c = 0; c < r.num_coordinates(); ++c) {
              units.emplace_back(r.is_prismatic(c) ? "m" : "rad");
            }
            return units;
          },
          "The unit of every coordinate: 'rad', or 'm' of a sliding joint.")
      .def_prop_ro("limits", [](const Robot& r) { return r.limits(); }, "Limits of the joint coordinates.")
      .def(
          "pose",
          [](const Robot& robot, const ArrayLike& q, const std::string& link) {
            const int frame = robot.frame_index(link);
            return to_numpy_matrix(frame_pose(robot, state_at(robot, q), frame).matrix());
          },
          nb::arg("q"), nb::arg("link"), "Pose (4, 4) of a link frame in the world at q (nv,).")
      .def(
          "jacobian",
          [](const Robot& robot, const ArrayLike& q, const std::string& link) {
            const int frame = robot.frame_index(link);
            return to_numpy_matrix(frame_jacobian(robot, state_at(robot, q), frame));
          },
          nb::arg("q"), nb::arg("link"),
          "Jacobian (6, nv) of a link frame: rows 0-2 velocity of its origin, rows 3-5 angular velocity, both in\n"
          "the world (Pinocchio's LOCAL_WORLD_ALIGNED).")
      .def(
          "bias_acceleration",
          [](const Robot& robot, const ArrayLike& q, const ArrayLike& v, const std::string& link) {
            const int frame = robot.frame_index(link);
            return to_numpy(frame_bias_acceleration(robot, state_at(robot, q, v), frame));
          },
          nb::arg("q"), nb::arg("v"), nb::arg("link"),
          "Classical acceleration (6,) of a link frame when the joint acceleration is zero, rows as in jacobian.");
}

}  // namespace sidestep::python

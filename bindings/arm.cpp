#include "sidestep/arm/arm.hpp"
#include "sidestep/arm/attachment.hpp"

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cerrno>
#include <chrono>

#include "arguments.hpp"
#include "module.hpp"
#include "os_errors.hpp"

namespace sidestep::python {
namespace {

/// Dynamics with the memory they work in, for one thread (the GIL is held).
struct Dynamics {
  RigidBodyDynamics model;
  RigidBodyDynamics::Workspace workspace;

  Dynamics(Robot robot, std::vector<Inertial> inertials, const Eigen::Vector3d& gravity)
      : model(std::move(robot), std::move(inertials), gravity), workspace(model) {}
};

void bind_dynamics(nb::module_& m) {
  nb::class_<Inertial>(m, "Inertial", "Mass properties of a rigid body, in the frame of that body.")
      .def(
          "__init__",
          [](Inertial* self, double mass, const ArrayLike& com, const ArrayLike& inertia) {
            new (self) Inertial{mass, as_vector(com, "com", 3), as_matrix(inertia, "inertia", 3, 3)};
          },
          nb::arg("mass"), nb::arg("com"), nb::arg("inertia"),
          "mass [kg]; com (3,): centre of mass [m]; inertia (3, 3): rotational inertia about it [kg m^2].")
      .def_ro("mass", &Inertial::mass)
      .def_prop_ro("com", [](const Inertial& i) { return to_numpy(i.com); })
      .def_prop_ro("inertia", [](const Inertial& i) { return to_numpy_matrix(i.inertia); });

  m.def("fold_inertials", &fold_inertials, nb::arg("robot"), nb::arg("links"),
        "Sums the inertias of the links, one per frame in that frame, to one per joint in the frame of its child.\n"
        "Raises ValueError on a wrong number or an invalid inertia.");

  nb::class_<Dynamics>(m, "RigidBodyDynamics",
                       "The equation of motion M(q) a + h(q, v) = torque of a tree, without friction and rotor inertia.\n"
                       "Source: Featherstone, Rigid Body Dynamics Algorithms (2008), chapters 5 and 6.")
      .def(
          "__init__",
          [](Dynamics* self, const Robot& robot, std::vector<Inertial> inertials, const nb::object& gravity) {
            new (self) Dynamics(robot, std::move(inertials),
                                gravity.is_none() ? standard_gravity
                                                  : Eigen::Vector3d(as_vector(gravity, "gravity", 3)));
          },
          nb::arg("robot"), nb::arg("inertials"), nb::kw_only(), nb::arg("gravity").none() = nb::none(),
          nb::sig("def __init__(self, robot: Robot, inertials: Sequence[Inertial], *, "
                  "gravity: numpy.typing.ArrayLike | None = None) -> None"),
          "inertials: one per joint, in the frame of its child; gravity (3,): in the world [m/s^2], 9.81 along -z by default.\n"
          "Raises ValueError on a wrong number, an invalid inertia or a gravity that is not finite.")
      .def_prop_ro("gravity", [](const Dynamics& d) { return to_numpy(d.model.gravity()); })
      .def_prop_ro("inertials", [](const Dynamics& d) { return d.model.inertials(); })
      .def(
          "mass_matrix",
          [](Dynamics& d, const ArrayLike& q) {
            const int nv = d.model.robot().num_coordinates();
            Eigen::MatrixXd mass(nv, nv);
            d.model.mass_matrix(as_finite_vector(q, "q", nv), d.workspace, mass);
            return to_numpy_matrix(mass);
          },
          nb::arg("q"), "M(q) (nv, nv) [kg m^2, kg m, kg] at q (nv,).")
      .def(
          "bias",
          [](Dynamics& d, const ArrayLike& q, const ArrayLike& v) {
            const int nv = d.model.robot().num_coordinates();
            Eigen::VectorXd force(nv);
            d.model.bias(as_finite_vector(q, "q", nv), as_finite_vector(v, "v", nv), d.workspace, force);
            return to_numpy(force);
          },
          nb::arg("q"), nb::arg("v"), "h(q, v) = C(q, v) v + g(q) (nv,) [Nm | N] at q (nv,), v (nv,).")
      .def(
          "call_seconds",
          [](Dynamics& d, const ArrayLike& q, const ArrayLike& v, int calls) {
            using Clock = std::chrono::steady_clock;
            const int nv = d.model.robot().num_coordinates();
            KinematicState state(d.model.robot());
            state.update(d.model.robot(), as_finite_vector(q, "q", nv), as_finite_vector(v, "v", nv));
            Eigen::MatrixXd mass(nv, nv);
            Eigen::VectorXd force(nv), seconds(std::max(0, calls));
            for (double& taken : seconds) {
              const Clock::time_point begin = Clock::now();
              d.model.mass_matrix(state, d.workspace, mass);
              d.model.bias(state, d.workspace, force);
              taken = std::chrono::duration<double>(Clock::now() - begin).count();
            }
            return to_numpy(seconds);
          },
          nb::arg("q"), nb::arg("v"), nb::kw_only(), nb::arg("calls"),
          "(calls,) [s] that mass matrix and bias took together, of links whose poses are known, as in a Controller.");
}

}  // namespace

void bind_arm(nb::module_& m) {
  bind_dynamics(m);

  nb::class_<CoverProof>(m, "CoverProof", "What is proven and measured of the ellipsoids that cover one link.")
      .def(nb::init<std::string, double, double, double, double, std::string, double, double>(), nb::arg("link"),
           nb::kw_only(), nb::arg("coverage"), nb::arg("mean_overshoot"), nb::arg("max_overshoot"),
           nb::arg("volume_ratio"), nb::arg("volume_of"), nb::arg("interior_coverage"), nb::arg("slimness"))
      .def_ro("link", &CoverProof::link)
      .def_ro("coverage", &CoverProof::coverage, "Share of the mesh's area proven to lie inside the ellipsoids.")
      .def_ro("mean_overshoot", &CoverProof::mean_overshoot, "[m]")
      .def_ro("max_overshoot", &CoverProof::max_overshoot, "[m]")
      .def_ro("volume_ratio", &CoverProof::volume_ratio)
      .def_ro("volume_of", &CoverProof::volume_of)
      .def_ro("interior_coverage", &CoverProof::interior_coverage)
      .def_ro("slimness", &CoverProof::slimness);

  nb::class_<Provenance>(m, "Provenance", "Where an arm comes from; does not count for its content hash.")
      .def(nb::init<std::string, std::string, std::string, std::string>(), nb::kw_only(), nb::arg("source"),
           nb::arg("fingerprint"), nb::arg("sidestep_version"), nb::arg("date"))
      .def_ro("source", &Provenance::source)
      .def_ro("fingerprint", &Provenance::fingerprint)
      .def_ro("sidestep_version", &Provenance::sidestep_version)
      .def_ro("date", &Provenance::date);

  nb::class_<Arm>(m, "Arm", nb::is_weak_referenceable(), "Everything that is prepared once for a robot, in the core.")
      .def(
          "__init__",
          [](Arm* self, const Robot& robot, const Body& body, const Pairs& pairs, std::vector<PairDistanceTable> tables,
             std::vector<Inertial> inertials, std::vector<CoverProof> proof,
             std::vector<std::pair<std::string, std::string>> allowed_pairs, const Provenance& provenance) {
            new (self) Arm(robot, body, link_pairs(pairs), std::move(tables), std::move(inertials),
                           {std::move(proof), std::move(allowed_pairs), provenance});
          },
          nb::kw_only(), nb::arg("robot"), nb::arg("body"), nb::arg("pairs"), nb::arg("tables"), nb::arg("inertials"),
          nb::arg("proof"), nb::arg("allowed_pairs"), nb::arg("provenance"),
          "inertials: one per joint, or none for an arm without dynamics. Raises ValueError that names what is wrong.")
      .def(nb::init<const Arm&>(), nb::arg("arm"), "The same arm again; the content is shared.")
      .def_static(
          "read", [](const std::filesystem::path& path) { return with_os_errors(path, [&] { return Arm::load(path); }); },
          nb::arg("path"), nb::sig("def read(path: str | os.PathLike[str]) -> Arm"),
          "Reads an .arm file. Raises OSError if it cannot be read, and ValueError that names the file and what is wrong.")
      .def(
          "save",
          [](const Arm& arm, const std::filesystem::path& path) { with_os_errors(path, [&] { arm.save(path); }); },
          nb::arg("path"), nb::sig("def save(self, path: str | os.PathLike[str]) -> None"),
          "Writes an .arm file in one piece. Raises OSError.")
      .def(
          "__getstate__",
          [](const Arm& arm) {
            const std::vector<std::byte> bytes = arm.bytes();
            return nb::bytes(bytes.data(), bytes.size());
          })
      .def("__setstate__",
           [](Arm& arm, const nb::bytes& bytes) {
             new (&arm) Arm(Arm::from_bytes({static_cast<const std::byte*>(bytes.data()), bytes.size()}));
           })
      .def(
          "__eq__",
          [](const Arm& arm, nb::handle other) {
            return nb::isinstance<Arm>(other) && arm.content_hash() == nb::cast<const Arm&>(other).content_hash();
          },
          nb::arg("other").none(), nb::sig("def __eq__(self, other: object, /) -> bool"), "By the content, see content_hash.")
      .def("__hash__", [](const Arm& arm) { return std::hash<std::string>()(arm.content_hash()); })
      .def_prop_ro("name", &Arm::name, "The name of the robot.")
      .def_prop_ro("num_coordinates", &Arm::num_coordinates, "Number of joint coordinates nv.")
      // Copies: what Python keeps beside an arm must not keep the arm alive, or neither would ever be freed.
      .def_prop_ro("robot", &Arm::robot, nb::rv_policy::copy, "The kinematic tree, without meshes.")
      .def_prop_ro("body", &Arm::body, nb::rv_policy::copy, "The covering body.")
      .def_prop_ro("limits", [](const Arm& arm) { return arm.robot().limits(); }, "JointLimits of the coordinates.")
      .def_prop_ro(
          "pairs",
          [](const Arm& arm) {
            std::vector<std::tuple<std::string, std::string, double>> pairs;
            for (const LinkPair& pair : arm.pairs()) {
              pairs.emplace_back(pair.first, pair.second, pair.contact);
            }
            return pairs;
          },
          "Pairs of links that must not touch, without a table: (first, second, contact [m]).")
      .def_prop_ro("tables", [](const Arm& arm) { return arm.tables(); }, "Clearance tables of the other pairs.")
      .def_prop_ro("inertials", [](const Arm& arm) { return arm.inertials(); },
                   "One per joint in the frame of its child; empty without dynamics.")
      .def_prop_ro("has_dynamics", &Arm::has_dynamics, "Whether mass matrix and bias are known.")
      .def_prop_ro("proof", [](const Arm& arm) { return arm.proof(); }, "CoverProof of every covered link.")
      .def_prop_ro("allowed_pairs", [](const Arm& arm) { return arm.allowed_pairs(); }, "Links that may touch.")
      .def_prop_ro("provenance", [](const Arm& arm) { return arm.provenance(); }, "Where the arm comes from.")
      .def_prop_ro("content_hash", &Arm::content_hash,
                   "SHA-256 (64 hex digits) of everything but the provenance: equal arms have equal hashes.")
      .def("__repr__", [](const Arm& arm) { return "Arm('" + arm.name() + "', " + std::to_string(arm.num_coordinates()) + " coordinates)"; })
      .def_prop_ro("neutral", [](const Arm& arm) { return to_numpy(arm.neutral()); },
                   "A configuration (nv,) inside the limits: the middle of each interval, 0 without limits.");

  nb::class_<Attachment>(m, "Attachment", "An object that a link holds, see `Controller.attach`; `sidestep.arm.attachment` makes one.")
      .def(
          "__init__",
          [](Attachment* self, const std::string& name, const std::string& link, const ArrayLike& pose, const ArrayLike& centres,
             nb::sequence shapes, const Inertial& inertial, const std::vector<std::string>& may_touch,
             const std::vector<std::string>& rests_on) {
            SolidEllipsoids cover;
            const Eigen::MatrixXd middles = as_matrix(centres, "centres", static_cast<Eigen::Index>(nb::len(shapes)), 3);
            for (Eigen::Index k = 0; k < middles.rows(); ++k) {
              cover.centres.push_back(middles.row(k).transpose());
              cover.shapes.push_back(as_matrix(shapes[static_cast<std::size_t>(k)], "shapes", 3, 3));
            }
            const Eigen::MatrixXd X = as_matrix(pose, "pose", 4, 4);
            Eigen::Isometry3d X_LA;
            X_LA.matrix() = X;
            new (self) Attachment{name, link, X_LA, std::move(cover), inertial, may_touch, rests_on};
          },
          nb::arg("name"), nb::kw_only(), nb::arg("link"), nb::arg("pose"), nb::arg("centres"), nb::arg("shapes"), nb::arg("inertial"),
          nb::arg("may_touch") = std::vector<std::string>{}, nb::arg("rests_on") = std::vector<std::string>{},
          nb::sig("def __init__(self, name: str, *, link: str, pose: numpy.typing.ArrayLike, centres: numpy.typing.ArrayLike, "
                  "shapes: Sequence[numpy.typing.ArrayLike], inertial: Inertial, may_touch: Sequence[str] = (), "
                  "rests_on: Sequence[str] = ()) -> None"),
          "pose (4, 4) of the object in the frame of `link`; solid ellipsoids {centre + shape u : |u| <= 1} that hold all of it,\n"
          "centres (K, 3) and shapes (K, 3, 3) [m]; `inertial` in the object's frame; links that it may\n"
          "touch; names of obstacles that it stands on until it is lifted.")
      .def_ro("name", &Attachment::name)
      .def_ro("link", &Attachment::link)
      .def_prop_ro("pose", [](const Attachment& a) { return to_numpy_matrix(a.X_LA.matrix()); }, "(4, 4) in the link's frame.")
      .def_prop_ro("num_ellipsoids", [](const Attachment& a) { return a.cover.size(); })
      .def_ro("inertial", &Attachment::inertial)
      .def_ro("may_touch", &Attachment::may_touch)
      .def_ro("rests_on", &Attachment::rests_on)
      .def("__repr__", [](const Attachment& a) {
        return "Attachment('" + a.name + "' on link '" + a.link + "', " + std::to_string(a.cover.size()) + " ellipsoids)";
      });
}

}  // namespace sidestep::python

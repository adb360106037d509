#include "sidestep/loop/stream_limiter.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>

#include <array>
#include <optional>

#include "arguments.hpp"
#include "module.hpp"

namespace sidestep::python {
namespace {

struct GivenMotion {
  GivenMotion(const ArrayLike& p, const ArrayLike& v, const ArrayLike& a, Eigen::Index nv)
      : position(as_vector(p, "position", nv)), velocity(as_vector(v, "velocity", nv)), acceleration(as_vector(a, "acceleration", nv)) {}
  StreamLimiter::Motion motion() const { return {position, velocity, acceleration}; }

  Eigen::VectorXd position, velocity, acceleration;
};

}  // namespace

void bind_stream_limiter(nb::module_& m) {
  nb::class_<StreamLimiter>(
      m, "StreamLimiter",
      "The command nearest to the wanted one that a robot accepts which judges each command of a stream by the commands before\n"
      "it: p+ = p + T (v + T a+) with a+ within jerk and acceleration of what the robot says it goes on from, and v+ within the\n"
      "velocity limits. limits: JointLimits; end_deceleration, end_offset (nv,): D, o of velocity limits that fall to\n"
      "sqrt(2 D (q_max - q)) - o towards the ends of the joints; margin: share of every limit that stays unused; period [s].\n"
      "Raises ValueError on wrong shapes and limits that are not positive.")
      .def(
          "__init__",
          [](StreamLimiter* self, const JointLimits& limits, double period, const std::optional<ArrayLike>& end_deceleration,
             const std::optional<ArrayLike>& end_offset, double margin) {
            new (self) StreamLimiter({limits, end_deceleration ? as_vector(*end_deceleration, "end_deceleration") : Eigen::VectorXd(),
                                      end_offset ? as_vector(*end_offset, "end_offset") : Eigen::VectorXd(), margin},
                                     period);
          },
          nb::arg("limits"), nb::arg("period"), nb::kw_only(), nb::arg("end_deceleration") = nb::none(),
          nb::arg("end_offset") = nb::none(), nb::arg("margin") = StreamLimits().margin)
      .def(
          "begin",
          [](StreamLimiter& self, const ArrayLike& position, const ArrayLike& torque) {
            self.begin(as_vector(position, "position", self.size()), as_vector(torque, "torque", self.size()));
          },
          nb::arg("position"), nb::arg("torque"), "A stream begins: the robot rests at `position` and holds `torque` (nv,).")
      .def(
          "limit_positions",
          [](StreamLimiter& self, const std::array<ArrayLike, 3>& told, const std::array<ArrayLike, 3>& wanted) {
            const GivenMotion t(told[0], told[1], told[2], self.size()), w(wanted[0], wanted[1], wanted[2], self.size());
            return to_numpy(self.limit_positions(t.motion(), w.motion()));
          },
          nb::arg("told"), nb::arg("wanted"),
          "The positions (nv,) to send. told, wanted: position, velocity, acceleration (nv,) that the robot goes on from (NaN: what was\n"
          "sent), and that are wanted at the end of the period.")
      .def(
          "limit_velocities",
          [](StreamLimiter& self, const std::array<ArrayLike, 3>& told, const std::array<ArrayLike, 3>& wanted) {
            const GivenMotion t(told[0], told[1], told[2], self.size()), w(wanted[0], wanted[1], wanted[2], self.size());
            return to_numpy(self.limit_velocities(t.motion(), w.motion()));
          },
          nb::arg("told"), nb::arg("wanted"), "The same of velocities.")
      .def(
          "limit_torques",
          [](StreamLimiter& self, const ArrayLike& told, const ArrayLike& wanted) {
            return to_numpy(self.limit_torques(as_vector(told, "told", self.size()), as_vector(wanted, "wanted", self.size())));
          },
          nb::arg("told"), nb::arg("wanted"), "The torques (nv,) to send; told: what the robot holds.")
      .def_prop_ro("change", &StreamLimiter::change,
                   "Largest difference of a joint between the last command and the wanted one.");
}

}  // namespace sidestep::python

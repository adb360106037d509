// From depth cameras to obstacles.
#include <nanobind/eigen/dense.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstring>

#include "arguments.hpp"
#include "depth_pixels.hpp"
#include "module.hpp"
#include "settings.hpp"
#include "sidestep/perception/camera_check.hpp"
#include "sidestep/perception/perception.hpp"

namespace sidestep::python {

DepthPixels as_depth_pixels(nb::handle given, nb::handle unit) {
  const nb::object array = nb::module_::import_("numpy").attr("ascontiguousarray")(given);
  const std::string kind = nb::cast<std::string>(array.attr("dtype").attr("name"));
  DepthPixels pixels;
  pixels.owner = array;
  const bool whole = kind == "uint16";
  pixels.raw.unit = unit.is_none() ? (whole ? 0.001 : 1.0) : nb::cast<double>(unit);
  if (!(pixels.raw.unit > 0.0 && pixels.raw.unit <= 1.0)) {
    throw nb::value_error(("unit is " + in_short(pixels.raw.unit) + ", allowed: above 0 to 1 m").c_str());
  }
  if (!whole && kind != "float32" && kind != "float64") {
    throw nb::type_error(("depth is of type " + kind + ", allowed: uint16, float32 or float64").c_str());
  }
  if (kind == "float64") {
    pixels.owner = array.attr("astype")("float32");
  }
  const auto take = [&](const auto& image) {
    if (image.ndim() != 2) {
      throw nb::value_error(("depth has shape " + std::string(nb::repr(pixels.owner.attr("shape")).c_str()) +
                             ", allowed: (height, width)")
                                .c_str());
    }
    pixels.height = static_cast<int>(image.shape(0));
    pixels.width = static_cast<int>(image.shape(1));
    pixels.raw.pixels = std::span(image.data(), image.size());
  };
  if (whole) {
    take(nb::cast<nb::ndarray<const std::uint16_t, nb::c_contig, nb::device::cpu>>(pixels.owner));
  } else {
    take(nb::cast<nb::ndarray<const float, nb::c_contig, nb::device::cpu>>(pixels.owner));
  }
  return pixels;
}

namespace {

DepthPixels as_depth(nb::handle given, const DepthCamera& camera, nb::handle unit) {
  DepthPixels pixels = as_depth_pixels(given, unit);
  if (pixels.height != camera.height || pixels.width != camera.width) {
    throw nb::value_error(("depth has shape " + std::string(nb::repr(pixels.owner.attr("shape")).c_str()) + ", allowed: (" +
                           std::to_string(camera.height) + ", " + std::to_string(camera.width) + ") for camera '" + camera.name + "'")
                              .c_str());
  }
  return pixels;
}

const DepthCamera& camera_of(const Perception& self, const std::string& name) {
  for (const DepthCamera& camera : self.cameras()) {
    if (camera.name == name) {
      return camera;
    }
  }
  self.pose(name);  // throws
  return self.cameras().front();
}

double as_capture_time(nb::handle time) {
  const double seconds = as_seconds(time, "time");
  if (std::isnan(seconds)) {
    throw nb::value_error("time is not told, must be when the image was captured [s], on the clock of step");
  }
  return seconds;
}

Capture as_capture(nb::handle time, nb::handle q, nb::handle pose) {
  Capture capture{as_capture_time(time), q.is_none() ? Eigen::VectorXd() : as_finite_vector(q, "q"), std::nullopt};
  if (!pose.is_none()) {
    capture.pose = python::as_pose(pose);
  }
  return capture;
}

/// A numpy array (height, width) with a copy of the data.
template <class Number>
nb::object image_array(const std::vector<Number>& data, const DepthCamera& camera) {
  const nb::object array = nb::module_::import_("numpy").attr("empty")(nb::make_tuple(camera.height, camera.width), std::is_same_v<Number, float> ? "float32" : "uint8");
  using Raw = std::conditional_t<std::is_same_v<Number, float>, float, std::uint8_t>;
  const auto view = nb::cast<nb::ndarray<Raw, nb::c_contig, nb::device::cpu>>(array);
  std::memcpy(view.data(), data.data(), data.size() * sizeof(Number));
  return array;
}

void bind_report(nb::module_& m) {
  nb::enum_<PixelLabel>(m, "PixelLabel", nb::is_arithmetic(), "What a pixel shows.")
      .value("nothing", PixelLabel::nothing, "No depth, or one that is too near.")
      .value("obstacle", PixelLabel::obstacle, "Something that is not the arm.")
      .value("arm", PixelLabel::arm, "The arm, or an object that it holds.")
      .value("edge", PixelLabel::edge, "A depth between two surfaces, which is on neither: a flying pixel.")
      .value("explained", PixelLabel::explained, "A shape that was told.")
      .value("left_out", PixelLabel::left_out, "In a region that is left out.")
      .value("outside", PixelLabel::outside, "Beyond the range of the camera.");
  nb::class_<ArmResidual>(m, "ArmResidual", "How far what a camera sees is from where the arm should be: of rays through the cores of its cover.")
      .def_ro("rays", &ArmResidual::rays, "Rays with a depth.")
      .def_ro("on_arm", &ArmResidual::on_arm, "Those that end on the arm.")
      .def_ro("through", &ArmResidual::through, "Those that end behind it.")
      .def_ro("depth_error", &ArmResidual::depth_error, "Mean of the measured depth less that of the grown cover, of those on the arm [m].")
      .def_prop_ro("through_share", &ArmResidual::through_share, "Share of rays that see through the arm, of those that nothing hides.");
  using R = PerceptionReport;
  nb::class_<R>(m, "PerceptionReport", "What became of an image, and what it cost.")
      .def_ro("used", &R::used, "False: nobody knows where the arm was at the time of capture, or the image shows nothing; obstacles are as before.")
      .def_ro("obstacle_pixels", &R::obstacle_pixels, "Number of pixels that show something else than the arm.")
      .def_ro("arm_pixels", &R::arm_pixels, "Number of pixels that show the arm.")
      .def_ro("edge_pixels", &R::edge_pixels, "Number of flying pixels.")
      .def_ro("seen", &R::seen, "Number of obstacles that this camera shows now.")
      .def_ro("remembered", &R::remembered, "Number of those that no camera shows now.")
      .def_ro("explained", &R::explained, "Number of cells that told shapes explain, or that are left out.")
      .def_ro("unseen", &R::unseen, "Number of obstacles where nobody has looked.")
      .def_ro("arm", &R::arm, "Where the arm is, of this image.")
      .def_ro("through", &R::through, "Share of rays that see through the arm, smoothed over half a second.")
      .def_ro("question", &R::question, "What is hard to believe, in words; empty: nothing.")
      .def_ro("depth_time", &R::depth_time, "Time for depths and edges [s].")
      .def_ro("mask_time", &R::mask_time, "Time to take the arm out [s].")
      .def_ro("map_time", &R::map_time, "Time for points and map [s].")
      .def_ro("unseen_time", &R::unseen_time, "Time for unseen space [s].")
      .def_ro("obstacles_time", &R::obstacles_time, "Time to hand obstacles to the controller [s].")
      .def_prop_ro("total_time", &R::total_time, "Sum of the times [s].")
      .def("__repr__", [](const R& r) {
        return "PerceptionReport(used=" + std::string(r.used ? "True" : "False") + ", seen=" + std::to_string(r.seen) +
               ", remembered=" + std::to_string(r.remembered) + ", explained=" + std::to_string(r.explained) +
               ", unseen=" + std::to_string(r.unseen) + ", question=" + nb::repr(nb::cast(r.question)).c_str() + ")";
      });
}

void bind_check(nb::module_& m) {
  using C = CameraCorrection;
  nb::class_<C>(m, "CameraCorrection", "Where a camera is and how its clock goes, as the arm in its images says.")
      .def_prop_ro("pose", [](const C& c) { return to_numpy_matrix(c.pose.matrix()); }, "Pose (4, 4) in the world, or on its link, that fits best.")
      .def_ro("translation", &C::translation, "By which it differs from what was told [m].")
      .def_ro("rotation", &C::rotation, "The same [rad].")
      .def_ro("clock_offset", &C::clock_offset, "To add to the times of images [s]; nan: not known, the arm does not move enough.")
      .def_ro("rms_before", &C::rms_before, "Distance of points from the surface of the arm before [m], robust.")
      .def_ro("rms_after", &C::rms_after, "The same afterwards [m].")
      .def_ro("overshoot", &C::overshoot, "By which the cover is larger than the arm, where it was seen [m]: taken off.")
      .def_ro("translation_spread", &C::translation_spread, "Half the difference of what each second image alone says [m].")
      .def_ro("rotation_spread", &C::rotation_spread, "The same [rad].")
      .def_ro("clock_spread", &C::clock_spread, "The same of the clock offset [s].")
      .def_ro("images", &C::images, "Number of images that show the arm.")
      .def_ro("points", &C::points, "Number of points near it.")
      .def_ro("question", &C::question, "What is hard to believe, in words; empty: nothing.");
  nb::class_<CameraCheck>(m, "CameraCheck",
                          "Measures pose and clock offset of a camera from the arm that moves in view.\n\n"
                          "Minimises the robust sum of the distances |d(X_WC p, q(t + tau)) + o| of points p of the images from the surface of the arm\n"
                          "over the pose X_WC and the clock offset tau; d is the distance to the covering ellipsoids, o the overshoot of the link's cover.")
      .def(nb::init<const Arm&, const DepthCamera&>(), nb::arg("arm"), nb::arg("camera"))
      .def("add_state", [](CameraCheck& self, nb::handle q, nb::handle time) { self.add_state(as_capture_time(time), as_finite_vector(q, "q")); },
           nb::arg("q"), nb::kw_only(), nb::arg("time"), nb::sig("def add_state(self, q: numpy.typing.ArrayLike, *, time: float) -> None"),
           "The arm was at q (nv,) at a time [s], later than the last one.")
      .def("add",
           [](CameraCheck& self, nb::handle depth, nb::handle time, nb::handle unit) {
             const DepthPixels pixels = as_depth(depth, self.camera(), unit);
             self.add(pixels.raw, as_capture_time(time));
           },
           nb::arg("depth"), nb::kw_only(), nb::arg("time"), nb::arg("unit") = nb::none(),
           nb::sig("def add(self, depth: numpy.typing.ArrayLike, *, time: float, unit: float | None = None) -> None"),
           "An image (height, width), captured at a time [s]; as for Perception.update.")
      .def("solve", [](const CameraCheck& self) {
             const nb::gil_scoped_release release;
             return self.solve();
           },
           "Raises RuntimeError where fewer than three images show the arm near where it should be.");
}

nb::dict cells_of(const Perception& self) {
  const std::vector<Perception::Cell> cells = self.cells();
  const auto num = static_cast<Eigen::Index>(cells.size());
  Eigen::Matrix3Xd centres(3, num), velocities(3, num);
  Eigen::VectorXd radii(num), ages(num), cameras(num), remembered(num), hidden(num);
  for (Eigen::Index n = 0; n < num; ++n) {
    const Perception::Cell& cell = cells[static_cast<std::size_t>(n)];
    centres.col(n) = cell.centre;
    velocities.col(n) = cell.velocity;
    radii[n] = cell.radius;
    ages[n] = cell.age;
    cameras[n] = cell.camera;
    remembered[n] = cell.is_remembered ? 1.0 : 0.0;
    hidden[n] = cell.is_hidden ? 1.0 : 0.0;
  }
  nb::dict all;
  all["centres"] = to_numpy_points(centres);
  all["velocities"] = to_numpy_points(velocities);
  all["radii"] = to_numpy(radii);
  all["ages"] = to_numpy(ages);
  all["cameras"] = to_numpy(cameras).attr("astype")("int64");
  all["remembered"] = to_numpy(remembered).attr("astype")("bool");
  all["hidden"] = to_numpy(hidden).attr("astype")("bool");
  return all;
}

}  // namespace

void bind_perception(nb::module_& m) {
  bind_report(m);
  bind_check(m);
  bind_settings<PerceptionSettings>(m, "PerceptionSettings", "How what cameras see becomes obstacles.");
  m.def(
      "perception_settings_fields",
      [] {
        nb::list rows;
        describe_fields<PerceptionSettings>(rows, "");
        return rows;
      },
      nb::sig("def perception_settings_fields() -> list[dict[str, float | str]]"), "Every setting of Perception, as controller_settings_fields.");
  nb::class_<Perception>(m, "Perception",
                         "From depth cameras to the obstacles of a controller: takes the arm out of the image, remembers what is hidden, and hands\n"
                         "the rest on.\n\n"
                         "Each camera is a source of the controller, of its name. What no camera shows now is the source 'memory'; where nobody has\n"
                         "looked, if that counts as occupied, 'unseen'. Calls from several threads wait for each other; none waits for `step`.")
      .def(
          "__init__",
          [](Perception* self, Controller& controller, const std::vector<DepthCamera>& cameras, nb::handle settings) {
            new (self) Perception(controller, cameras, settings.is_none() ? PerceptionSettings{} : as_instance<PerceptionSettings>(settings, "settings", "PerceptionSettings"));
          },
          nb::arg("controller"), nb::arg("cameras"), nb::arg("settings") = nb::none(), nb::keep_alive<1, 2>(),
          nb::sig("def __init__(self, controller: Controller, cameras: collections.abc.Sequence[DepthCamera], settings: PerceptionSettings | None = None) -> None"),
          "Raises ValueError that names the camera or the setting, its value and what is allowed.")
      .def(
          "update",
          [](Perception& self, const std::string& camera, nb::handle depth, nb::handle time, nb::handle unit, nb::handle q, nb::handle pose) {
            const DepthPixels pixels = as_depth(depth, camera_of(self, camera), unit);
            const Capture capture = as_capture(time, q, pose);
            const nb::gil_scoped_release release;
            return self.update(camera, pixels.raw, capture);
          },
          nb::arg("camera"), nb::arg("depth"), nb::kw_only(), nb::arg("time"), nb::arg("unit") = nb::none(), nb::arg("q") = nb::none(), nb::arg("pose") = nb::none(),
          nb::sig("def update(self, camera: str, depth: numpy.typing.ArrayLike, *, time: float, unit: float | None = None, "
                  "q: numpy.typing.ArrayLike | None = None, pose: numpy.typing.ArrayLike | None = None) -> PerceptionReport"),
          "Takes an image of a camera, and gives the controller what it shows.\n"
          "\n"
          "Args:\n"
          "    camera: its name.\n"
          "    depth: (height, width) uint16 or float; 0, nan and inf: nothing seen.\n"
          "    time: when it was captured [s], on the clock of `step`.\n"
          "    unit: of a depth [m]; None: 0.001 of uint16, 1 of float.\n"
          "    q: (nv,) of the arm at that time; None: as `step` was told.\n"
          "    pose: (4, 4) of the optical frame in the world at that time; None: as the camera is mounted.\n"
          "\n"
          "Returns what became of it. Raises ValueError or TypeError that names the value and what is allowed.")
      .def(
          "update_points",
          [](Perception& self, const std::string& camera, nb::handle points, nb::handle time, nb::handle q, nb::handle pose) {
            const nb::object array = nb::module_::import_("numpy").attr("asarray")(points, "float64");
            const nb::object shape = array.attr("shape");
            const std::size_t num_axes = nb::len(shape);
            if (num_axes < 2 || num_axes > 3 || nb::cast<int>(shape[num_axes - 1]) != 3) {
              throw nb::value_error(
                  ("points have shape " + std::string(nb::repr(shape).c_str()) + ", allowed: (N, 3) or (height, width, 3)").c_str());
            }
            const nb::object flat = array.attr("reshape")(-1, 3);
            const auto rows = nb::cast<nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>>(flat);
            const Eigen::Matrix3Xd given = Eigen::Map<const Eigen::Matrix3Xd>(rows.data(), 3, static_cast<Eigen::Index>(rows.shape(0)));
            const Capture capture = as_capture(time, q, pose);
            const nb::gil_scoped_release release;
            return self.update(camera, given, capture);
          },
          nb::arg("camera"), nb::arg("points"), nb::kw_only(), nb::arg("time"), nb::arg("q") = nb::none(), nb::arg("pose") = nb::none(),
          nb::sig("def update_points(self, camera: str, points: numpy.typing.ArrayLike, *, time: float, q: numpy.typing.ArrayLike | None = None, "
                  "pose: numpy.typing.ArrayLike | None = None) -> PerceptionReport"),
          "The same of a cloud in the camera's optical frame [m]: (N, 3), or organised (height, width, 3); nan: nothing seen.")
      .def(
          "leave_out",
          [](Perception& self, const std::string& name, nb::handle region, double grow, const std::string& link) {
            self.leave_out(name, as_obstacles(region), grow, link);
          },
          nb::arg("name"), nb::arg("region"), nb::kw_only(), nb::arg("grow") = 0.02, nb::arg("link") = "",
          nb::sig("def leave_out(self, name: str, region: Obstacles | sidestep.obstacles.Shape | collections.abc.Sequence[Obstacles | "
                  "sidestep.obstacles.Shape], *, grow: float = 0.02, link: str = '') -> None"),
          "What is within `grow` [m] of the region is no obstacle: what is to be grasped, or a place where noise is known. In the world, or\n"
          "in the frame of a link. Replaces a region of the same name.")
      .def("take_in", &Perception::take_in, nb::arg("name"), "Undoes `leave_out`. Raises ValueError that lists the regions.")
      .def("forget", &Perception::forget, "Forgets all that was seen.")
      .def_prop_ro("cameras", &Perception::cameras, "The cameras.")
      .def_prop_ro("settings", [](const Perception& self) { return self.settings(); }, "The settings.")
      .def("pose", [](const Perception& self, const std::string& camera) { return to_numpy_matrix(self.pose(camera).matrix()); }, nb::arg("camera"),
           nb::sig("def pose(self, camera: str) -> numpy.typing.NDArray[numpy.float64]"), "Pose (4, 4) of a camera in the world at its last image.")
      .def("time", &Perception::time, nb::arg("camera"), "Time of capture of its last image [s]; nan before the first.")
      .def("depth", [](const Perception& self, const std::string& camera) { return image_array(self.depth(camera), camera_of(self, camera)); },
           nb::arg("camera"), nb::sig("def depth(self, camera: str) -> numpy.typing.NDArray[numpy.float32]"),
           "Depth [m] of the last image (height, width); 0: nothing seen.")
      .def("labels", [](const Perception& self, const std::string& camera) { return image_array(self.labels(camera), camera_of(self, camera)); },
           nb::arg("camera"), nb::sig("def labels(self, camera: str) -> numpy.typing.NDArray[numpy.uint8]"),
           "What each pixel of the last image shows (height, width), a PixelLabel each.")
      .def("cells", &cells_of, nb::sig("def cells(self) -> dict[str, numpy.typing.NDArray[typing.Any]]"),
           "The obstacles that were handed to the controller: centres (N, 3) [m], velocities (N, 3) [m/s], radii (N,) [m], ages (N,) [s], cameras (N,), remembered (N,):\n"
           "no camera shows it now, hidden (N,): something is in front of it. Copies that move as another camera\n"
           "says are not listed.")
      .def("unseen", [](const Perception& self) { return to_numpy_points(self.unseen()); }, nb::sig("def unseen(self) -> numpy.typing.NDArray[numpy.float64]"),
           "Middles (N, 3) of cells where nobody has looked and that border on seen space [m].");
}

}  // namespace sidestep::python

// Depth cameras.
#include <nanobind/eigen/dense.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <array>
#include <utility>

#include "arguments.hpp"
#include "module.hpp"
#include "sidestep/perception/depth_camera.hpp"

namespace sidestep::python {
namespace {

constexpr std::array<std::pair<const char*, DistortionModel>, 4> distortion_models{{
    {"none", DistortionModel::none},
    {"brown_conrady", DistortionModel::brown_conrady},
    {"inverse_brown_conrady", DistortionModel::inverse_brown_conrady},
    {"kannala_brandt", DistortionModel::kannala_brandt},
}};

DistortionModel as_distortion_model(const std::string& name) {
  std::string known;
  for (const auto& [its, model] : distortion_models) {
    if (name == its) {
      return model;
    }
    known += (known.empty() ? "'" : ", '") + std::string(its) + "'";
  }
  throw nb::value_error(("distortion_model is '" + name + "', allowed: " + known).c_str());
}

/// The intrinsics and the place of a camera, as Python gives them.
void init_camera(DepthCamera* self, const std::string& name, int width, int height, double fx, double fy, double cx, double cy,
                 nb::handle pose, const std::string& link, const std::string& model, nb::handle distortion, const DepthNoise& noise,
                 double near, double far, double translation_error, double rotation_error, double clock_error) {
  DepthCamera camera;
  camera.name = name;
  camera.width = width;
  camera.height = height;
  camera.fx = fx;
  camera.fy = fy;
  camera.cx = cx;
  camera.cy = cy;
  camera.distortion_model = as_distortion_model(model);
  if (!distortion.is_none()) {
    const Eigen::VectorXd given = as_finite_vector(distortion, "distortion");
    if (given.size() > 5) {
      throw nb::value_error(("distortion has " + std::to_string(given.size()) + " coefficients, allowed: up to 5 (k1, k2, p1, p2, k3)").c_str());
    }
    std::copy(given.begin(), given.end(), camera.distortion.begin());
  }
  camera.link = link;
  camera.pose = python::as_pose(pose);
  camera.noise = noise;
  camera.near = near;
  camera.far = far;
  camera.translation_error = translation_error;
  camera.rotation_error = rotation_error;
  camera.clock_error = clock_error;
  camera.validate();
  new (self) DepthCamera(camera);
}

}  // namespace

void bind_depth_camera(nb::module_& m) {
  nb::class_<DepthNoise>(m, "DepthNoise",
                         "Noise of a depth camera: standard deviation sigma(z) = constant + quadratic z^2 of a depth z [m].\n\n"
                         "For stereo quadratic = s/(f b), with the error s of a disparity [pixel], focal length f [pixel] and baseline b [m].")
      .def(nb::init<>())
      .def("__init__", [](DepthNoise* self, double constant, double quadratic) { new (self) DepthNoise{constant, quadratic}; },
           nb::arg("constant") = DepthNoise{}.constant, nb::arg("quadratic") = DepthNoise{}.quadratic)
      .def_ro("constant", &DepthNoise::constant, "[m]")
      .def_ro("quadratic", &DepthNoise::quadratic, "[1/m]")
      .def("sigma", &DepthNoise::sigma, nb::arg("z"), "Standard deviation of a depth z [m].")
      .def("__repr__", [](const DepthNoise& n) { return "DepthNoise(constant=" + in_short(n.constant) + ", quadratic=" + in_short(n.quadratic) + ")"; });

  const DepthCamera defaults;
  nb::class_<DepthCamera>(m, "DepthCamera",
                          "A depth camera: its size, intrinsics, place, noise and errors.\n\n"
                          "Pixel (u, v), integer at its centre, u to the right and v down, sees along the ray (x, y, 1) of the optical frame (x right,\n"
                          "y down, z forward), x = (u - cx)/fx and y = (v - cy)/fy where the lens does not distort. A depth is the z of what is seen.")
      .def("__init__", &init_camera, nb::arg("name"), nb::kw_only(), nb::arg("width"), nb::arg("height"), nb::arg("fx"), nb::arg("fy"),
           nb::arg("cx"), nb::arg("cy"), nb::arg("pose"), nb::arg("link") = "", nb::arg("distortion_model") = "none",
           nb::arg("distortion") = nb::none(), nb::arg("noise") = DepthNoise{}, nb::arg("near") = defaults.near,
           nb::arg("far") = defaults.far, nb::arg("translation_error") = defaults.translation_error,
           nb::arg("rotation_error") = defaults.rotation_error, nb::arg("clock_error") = defaults.clock_error,
           nb::sig("def __init__(self, name: str, *, width: int, height: int, fx: float, fy: float, cx: float, cy: float, "
                   "pose: numpy.typing.ArrayLike, link: str = '', distortion_model: str = 'none', distortion: numpy.typing.ArrayLike | None = None, "
                   "noise: DepthNoise = ..., near: float = 0.1, far: float = 4.0, translation_error: float = 0.005, "
                   "rotation_error: float = 0.005, clock_error: float = 0.005) -> None"),
           "Args:\n"
           "    name: by which images come, and name of its source of obstacles.\n"
           "    width, height: of the image [pixel].\n"
           "    fx, fy, cx, cy: focal lengths and principal point [pixel].\n"
           "    pose: (4, 4) of the optical frame in the world; on a link in its frame.\n"
           "    link: frame of the arm on which it is mounted; '': none.\n"
           "    distortion_model: 'none', 'brown_conrady' (k1, k2, p1, p2, k3; ROS: plumb_bob), 'inverse_brown_conrady' (RealSense) or\n"
           "        'kannala_brandt' (k1 to k4; ROS: equidistant).\n"
           "    distortion: up to 5 coefficients.\n"
           "    noise: of depths.\n"
           "    near, far: range in which depths are believed [m].\n"
           "    translation_error, rotation_error: by how much the pose may be wrong [m], [rad].\n"
           "    clock_error: the same of times of capture [s].\n"
           "\n"
           "Raises ValueError that names the camera, the value and what is allowed.")
      .def_ro("name", &DepthCamera::name, "By which images come.")
      .def_ro("width", &DepthCamera::width, "[pixel]")
      .def_ro("height", &DepthCamera::height, "[pixel]")
      .def_ro("fx", &DepthCamera::fx, "Focal length [pixel].")
      .def_ro("fy", &DepthCamera::fy, "Focal length [pixel].")
      .def_ro("cx", &DepthCamera::cx, "Principal point [pixel].")
      .def_ro("cy", &DepthCamera::cy, "Principal point [pixel].")
      .def_prop_ro("distortion_model",
                   [](const DepthCamera& c) { return std::string(distortion_models[static_cast<std::size_t>(c.distortion_model)].first); },
                   "Model of the lens.")
      .def_prop_ro("distortion", [](const DepthCamera& c) { return to_numpy(Eigen::Map<const Eigen::VectorXd>(c.distortion.data(), 5)); },
                   "Coefficients (5,) of the lens.")
      .def_ro("link", &DepthCamera::link, "Frame of the arm on which it is mounted; '': none.")
      .def_prop_ro("pose", [](const DepthCamera& c) { return to_numpy_matrix(c.pose.matrix()); }, "Pose (4, 4) in the world, or on its link.")
      .def_ro("noise", &DepthCamera::noise, "Noise of depths.")
      .def_ro("near", &DepthCamera::near, "Least depth [m].")
      .def_ro("far", &DepthCamera::far, "Largest depth [m].")
      .def_ro("translation_error", &DepthCamera::translation_error, "Error of the pose [m].")
      .def_ro("rotation_error", &DepthCamera::rotation_error, "Error of the pose [rad].")
      .def_ro("clock_error", &DepthCamera::clock_error, "Error of times of capture [s].")
      .def("replace",
           [](nb::handle self, const nb::kwargs& changes) {
             nb::dict all;
             for (const char* const name : {"width", "height", "fx", "fy", "cx", "cy", "pose", "link", "distortion_model", "distortion", "noise",
                                            "near", "far", "translation_error", "rotation_error", "clock_error"}) {
               all[name] = self.attr(name);
             }
             all.update(changes);
             const nb::object name = all.contains("name") ? nb::borrow(all["name"]) : nb::object(self.attr("name"));
             if (all.contains("name")) {
               nb::del(all["name"]);
             }
             return nb::type<DepthCamera>()(name, **nb::borrow<nb::kwargs>(all));
           },
           nb::sig("def replace(self, **changes: typing.Any) -> DepthCamera"),
           "The same camera but for some values, by the names of its arguments. Raises as it does.")
      .def("project",
           [](const DepthCamera& c, nb::handle points) {
             const Eigen::Matrix3Xd p = as_points(points, "points");
             Eigen::MatrixXd pixels(p.cols(), 2);
             for (Eigen::Index n = 0; n < p.cols(); ++n) {
               pixels.row(n) = c.project(p.col(n)).transpose();
             }
             return to_numpy_matrix(pixels);
           },
           nb::arg("points"), nb::sig("def project(self, points: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]"),
           "Pixels (N, 2) that see points (N, 3) of the optical frame, with z > 0; they may lie outside of the image. NaN: so far from the "
           "axis that the distortion's polynomial no longer holds.")
      .def("__repr__", [](const DepthCamera& c) {
        return "DepthCamera('" + c.name + "', " + std::to_string(c.width) + " × " + std::to_string(c.height) +
               (c.link.empty() ? "" : ", on '" + c.link + "'") + ")";
      });
}

}  // namespace sidestep::python

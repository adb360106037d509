#include "sidestep/body/body.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <set>
#include <string>

#include "arguments.hpp"
#include "interruptible.hpp"
#include "module.hpp"
#include "sidestep/body/cover_refinement.hpp"
#include "sidestep/body/triangle_distance.hpp"

namespace sidestep::python {
namespace {

using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

std::vector<Eigen::Matrix3d> as_matrices(nb::handle value, const char* name) {
  const Array array = as_array(value, name);
  if (array.ndim() != 3 || array.shape(1) != 3 || array.shape(2) != 3) {
    throw nb::value_error((std::string(name) + " must have shape (K, 3, 3)").c_str());
  }
  std::vector<Eigen::Matrix3d> matrices;
  for (std::size_t k = 0; k < array.shape(0); ++k) {
    matrices.emplace_back(Eigen::Map<const RowMajor>(array.data() + 9 * k));
  }
  return matrices;
}

NumpyArray to_numpy_matrices(const std::vector<Eigen::Matrix3d>& matrices) {
  Eigen::MatrixXd flat(static_cast<Eigen::Index>(matrices.size()), 9);
  for (std::size_t k = 0; k < matrices.size(); ++k) {
    const RowMajor row_major = matrices[k];
    flat.row(static_cast<Eigen::Index>(k)) = Eigen::Map<const Eigen::RowVectorXd>(row_major.data(), 9);
  }
  return nb::cast<NumpyArray>(to_numpy_matrix(flat).attr("reshape")(nb::make_tuple(matrices.size(), 3, 3)));
}

DistanceGrid as_distance_grid(const ArrayLike& origin, double spacing, const ArrayLike& values) {
  const Array array = as_array(values, "values");
  if (array.ndim() != 3) {
    throw nb::value_error("values must have shape (nx, ny, nz)");
  }
  DistanceGrid grid{as_vector(origin, "origin", 3), spacing, {}, {array.data(), array.data() + array.size()}};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    grid.shape[axis] = static_cast<int>(array.shape(axis));
  }
  return grid;
}

std::vector<Eigen::Matrix3Xd> as_directions(const ArrayLike& directions) {
  const Array array = as_array(directions, "directions");
  if (array.ndim() != 3 || array.shape(2) != 3) {
    throw nb::value_error("directions must have shape (R, J, 3)");
  }
  std::vector<Eigen::Matrix3Xd> sets;
  for (std::size_t r = 0; r < array.shape(0); ++r) {
    const auto num = static_cast<Eigen::Index>(array.shape(1));
    sets.emplace_back(Eigen::Map<const Eigen::Matrix3Xd>(array.data() + 3 * array.shape(1) * r, 3, num));
  }
  return sets;
}

void bind_triangle_distance(nb::module_& m) {
  m.def(
      "distance_to_triangles",
      [](const ArrayLike& points, const ArrayLike& triangles, const ArrayLike& candidates) {
        const Eigen::Matrix3Xd from = as_points(points, "points");
        const Array corners = as_array(triangles, "triangles"), numbers = as_array(candidates, "candidates");
        if (corners.ndim() != 3 || corners.shape(1) != 3 || corners.shape(2) != 3) {
          throw nb::value_error("triangles must have shape (F, 3, 3)");
        }
        if (numbers.ndim() != 2 || numbers.shape(0) != static_cast<std::size_t>(from.cols())) {
          throw nb::value_error("candidates must have shape (N, C)");
        }
        const auto num = static_cast<Eigen::Index>(3 * corners.shape(0));
        const Eigen::Matrix3Xd columns = Eigen::Map<const Eigen::Matrix3Xd>(corners.data(), 3, num);
        const std::vector<int> chosen(numbers.data(), numbers.data() + numbers.size());
        Eigen::VectorXd distances;
        {
          const nb::gil_scoped_release others;
          distances = nearest_triangle_distances(from, columns, chosen);
        }
        return to_numpy(distances);
      },
      nb::arg("points"), nb::arg("triangles"), nb::arg("candidates"),
      nb::sig("def distance_to_triangles(points: numpy.typing.ArrayLike, triangles: numpy.typing.ArrayLike, "
              "candidates: numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]"),
      "Exact distance (N,) [m] of points (N, 3) [m] to the nearest of those triangles (F, 3, 3) [m] that are candidates (N, C)\n"
      "of each.");
}

void bind_cover_refinement(nb::module_& m) {
  m.def(
      "refine_cover",
      [](const ArrayLike& origin, double spacing, const ArrayLike& values, const ArrayLike& points,
         const ArrayLike& multipliers, const ArrayLike& directions, const ArrayLike& centres, const ArrayLike& shapes,
         int steps, double first_rate, double last_rate, double stiffness, int multiplier_steps, double margin,
         double unit, double area, double slimness) {
        const DistanceGrid grid = as_distance_grid(origin, spacing, values);
        const Eigen::Matrix3Xd samples = as_points(points, "points");
        Eigen::VectorXd forces = as_vector(multipliers, "multipliers");
        SolidEllipsoids ellipsoids{{}, as_matrices(shapes, "shapes")};
        const Eigen::Matrix3Xd starts = as_points(centres, "centres");
        for (Eigen::Index k = 0; k < starts.cols(); ++k) {
          ellipsoids.centres.emplace_back(starts.col(k));
        }
        const CoverRefinement settings{steps,  first_rate, last_rate, stiffness, multiplier_steps,
                                       margin, unit,       area,      slimness};
        const std::vector<Eigen::Matrix3Xd> sets = as_directions(directions);
        interruptible([&](const Interrupted& interrupted) {
          refine_cover(grid, samples, sets, settings, ellipsoids, forces, interrupted);
          return true;
        });
        Eigen::Matrix3Xd moved(3, ellipsoids.size());
        for (int k = 0; k < ellipsoids.size(); ++k) {
          moved.col(k) = ellipsoids.centres[static_cast<std::size_t>(k)];
        }
        return nb::make_tuple(to_numpy_points(moved), to_numpy_matrices(ellipsoids.shapes), to_numpy(forces));
      },
      nb::kw_only(), nb::arg("origin"), nb::arg("spacing"), nb::arg("values"), nb::arg("points"),
      nb::arg("multipliers"), nb::arg("directions"), nb::arg("centres"), nb::arg("shapes"), nb::arg("steps"),
      nb::arg("first_rate"), nb::arg("last_rate"), nb::arg("stiffness"), nb::arg("multiplier_steps"),
      nb::arg("margin"), nb::arg("unit"), nb::arg("area"), nb::arg("slimness"),
      nb::sig("def refine_cover(*, origin: numpy.typing.ArrayLike, spacing: float, values: numpy.typing.ArrayLike, "
              "points: numpy.typing.ArrayLike, multipliers: numpy.typing.ArrayLike, "
              "directions: numpy.typing.ArrayLike, centres: numpy.typing.ArrayLike, "
              "shapes: numpy.typing.ArrayLike, steps: int, first_rate: float, last_rate: float, stiffness: float, "
              "multiplier_steps: int, margin: float, unit: float, area: float, slimness: float) -> "
              "tuple[numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], "
              "numpy.typing.NDArray[numpy.float64]]"),
      "Moves ellipsoids until they hold points (N, 3) [m] and overshoot a surface little: centres (K, 3),\n"
      "shapes (K, 3, 3) and multipliers (N,) afterwards. The surface is the zero of signed distances values\n"
      "(nx, ny, nz) [m] on a grid from origin (3,); directions (R, J, 3) are R sets of unit vectors, used in turn.");
}

}  // namespace

void bind_body(nb::module_& m) {
  nb::class_<Body>(m, "Body", "A Gaussian mixture per link, in the core.")
      .def(
          "__init__",
          [](Body* self, std::vector<std::string> links, const ArrayLike& weights, const ArrayLike& means,
             const ArrayLike& covariances, const ArrayLike& levels) {
            new (self) Body(std::move(links), as_vector(weights, "weights"), as_points(means, "means"),
                            as_matrices(covariances, "covariances"),
                            levels.is_none() ? Eigen::VectorXd() : as_vector(levels, "levels"));
          },
          nb::kw_only(), nb::arg("links"), nb::arg("weights"), nb::arg("means"), nb::arg("covariances"),
          nb::arg("levels") = nb::none(),
          "links (K,): frame of each component; weights (K,), sum 1 per link; means (K, 3) [m];\n"
          "covariances (K, 3, 3) [m^2]; levels (K,) of a calibrated body. Raises ValueError that names the component at fault.")
      .def("__repr__", [](const Body& b) {
        const std::set<std::string> links(b.links.begin(), b.links.end());
        return "Body(" + std::to_string(links.size()) + " links, " + std::to_string(b.num_components()) +
               (b.levels.size() ? " ellipsoids)" : " Gaussians)");
      })
      .def_prop_ro("num_components", &Body::num_components, "Number of Gaussians or ellipsoids K.")
      .def_prop_ro("links", [](const Body& b) { return b.links; }, "(K,) The link that carries each.")
      .def_prop_ro("weights", [](const Body& b) { return to_numpy(b.weights); }, "(K,) Weights; of a link they add up to 1.")
      .def_prop_ro("means", [](const Body& b) { return to_numpy_points(b.means); }, "(K, 3) [m] in the frame of the link.")
      .def_prop_ro(
          "levels",
          [](const Body& b) -> std::optional<NumpyArray> {
            return b.levels.size() ? std::optional(to_numpy(b.levels)) : std::nullopt;
          },
          "Levels (K,) of the covering ellipsoids, or None if the body is not calibrated.")
      .def_prop_ro("covariances", [](const Body& b) { return to_numpy_matrices(b.covariances); }, "(K, 3, 3) [m^2] in the frame of the link.");
  bind_triangle_distance(m);
  bind_cover_refinement(m);
}

}  // namespace sidestep::python

#include "sidestep/body/body.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "arguments.hpp"
#include "module.hpp"

namespace sidestep::python {
namespace {

std::vector<Eigen::Matrix3d> as_covariances(nb::handle value) {
  const Array array = as_array(value, "covariances");
  if (array.ndim() != 3 || array.shape(1) != 3 || array.shape(2) != 3) {
    throw nb::value_error("covariances must have shape (K, 3, 3)");
  }
  std::vector<Eigen::Matrix3d> covariances;
  for (std::size_t k = 0; k < array.shape(0); ++k) {
    covariances.emplace_back(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(array.data() + 9 * k));
  }
  return covariances;
}

}  // namespace

void bind_body(nb::module_& m) {
  nb::class_<Body>(m, "Body", "A Gaussian mixture per link, in the core.")
      .def(
          "__init__",
          [](Body* self, std::vector<std::string> links, const ArrayLike& weights, const ArrayLike& means,
             const ArrayLike& covariances, const ArrayLike& levels) {
            new (self) Body(std::move(links), as_vector(weights, "weights"), as_points(means, "means"),
                            as_covariances(covariances),
                            levels.is_none() ? Eigen::VectorXd() : as_vector(levels, "levels"));
          },
          nb::kw_only(), nb::arg("links"), nb::arg("weights"), nb::arg("means"), nb::arg("covariances"),
          nb::arg("levels") = nb::none(),
          "links (K,): frame of each component; weights (K,), sum 1 per link; means (K, 3) [m];\n"
          "covariances (K, 3, 3) [m^2]; levels (K,) of a calibrated body. Raises ValueError that names the component at fault.")
      .def_prop_ro("num_components", &Body::num_components)
      .def_prop_ro("links", [](const Body& b) { return b.links; })
      .def_prop_ro("weights", [](const Body& b) { return to_numpy(b.weights); })
      .def_prop_ro("means", [](const Body& b) { return to_numpy_points(b.means); })
      .def_prop_ro(
          "levels",
          [](const Body& b) -> std::optional<NumpyArray> {
            return b.levels.size() ? std::optional(to_numpy(b.levels)) : std::nullopt;
          },
          "Levels (K,) of the covering ellipsoids, or None if the body is not calibrated.")
      .def_prop_ro("covariances", [](const Body& b) {
        Eigen::MatrixXd flat(b.num_components(), 9);
        for (int k = 0; k < b.num_components(); ++k) {
          const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> row_major = b.covariances[static_cast<std::size_t>(k)];
          flat.row(k) = Eigen::Map<const Eigen::RowVectorXd>(row_major.data(), 9);
        }
        return nb::cast<NumpyArray>(to_numpy_matrix(flat).attr("reshape")(nb::make_tuple(b.num_components(), 3, 3)));
      });
}

}  // namespace sidestep::python

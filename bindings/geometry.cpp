#include "arguments.hpp"
#include "module.hpp"
#include "sidestep/attractor/graph_metric.hpp"

namespace sidestep::python {
namespace {

/// J (m, nv) as a matrix of any shape.
Eigen::MatrixXd as_jacobian(nb::handle value) {
  const Array array = as_array(value, "jacobian");
  if (array.ndim() != 2) {
    throw nb::value_error("jacobian must have shape (m, nv)");
  }
  return as_matrix(value, "jacobian", static_cast<Eigen::Index>(array.shape(0)),
                   static_cast<Eigen::Index>(array.shape(1)));
}

}  // namespace

void bind_geometry(nb::module_& m) {
  m.def(
      "metric_matrix",
      [](const ArrayLike& jacobian) {
        const Eigen::MatrixXd J = as_jacobian(jacobian);
        GraphMetric metric(static_cast<int>(J.cols()), static_cast<int>(J.rows()));
        metric.update(J.transpose());
        return to_numpy_matrix(metric.matrix());
      },
      nb::arg("jacobian"), "Metric G = I + J^T J (nv, nv) of the graph, from J (m, nv) (T2.9).");
  m.def(
      "geodesic_acceleration",
      [](const ArrayLike& jacobian, const ArrayLike& curvatures) {
        const Eigen::MatrixXd J = as_jacobian(jacobian);
        return to_numpy(geodesic_acceleration(J, as_vector(curvatures, "curvatures", J.rows())));
      },
      nb::arg("jacobian"), nb::arg("curvatures"),
      "Geodesic acceleration -G^-1 J^T c (nv,), from J (m, nv) and c = d2psi/dt2 (m,): T5.3 in closed form.");
  m.def(
      "christoffel_symbols",
      [](const ArrayLike& jacobian, const ArrayLike& hessians) {
        const Eigen::MatrixXd J = as_jacobian(jacobian);
        const Eigen::Index nv = J.cols();
        const Array array = as_array(hessians, "hessians");
        if (array.size() != static_cast<std::size_t>(J.rows() * nv * nv) || array.ndim() < 2) {
          throw nb::value_error("hessians must have shape (m, nv, nv), with m and nv of the jacobian");
        }
        std::vector<Eigen::MatrixXd> of_coordinate;
        for (Eigen::Index a = 0; a < J.rows(); ++a) {
          of_coordinate.emplace_back(Eigen::Map<const Eigen::MatrixXd>(array.data() + a * nv * nv, nv, nv));
        }
        nb::list symbols;
        for (const Eigen::MatrixXd& symbol : christoffel_symbols(J, of_coordinate)) {
          symbols.append(to_numpy_matrix(symbol));
        }
        return nb::cast<NumpyArray>(nb::module_::import_("numpy").attr("stack")(symbols));
      },
      nb::arg("jacobian"), nb::arg("hessians"),
      "Christoffel symbols of the second kind (nv, nv, nv), indexed [k, i, j] for Gamma^k_ij, from dense tensors.\n"
      "The slow second implementation of the geodesic term: g^k = -Gamma^k_ij v^i v^j.");
}

}  // namespace sidestep::python

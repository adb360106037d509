#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "sidestep/body/link_pair.hpp"

namespace sidestep {
class Obstacles;
class Robot;
struct Body;
}  // namespace sidestep

namespace sidestep::python {

namespace nb = nanobind;

/// Real numbers, as a numpy array of float64: not copied where it is one. Raises TypeError that names the argument and
/// its type for what numpy would only turn into numbers (complex, bool, dates, text, objects), ValueError for masked
/// entries.
nb::object real_array(nb::handle value, const char* name);

/// The same, contiguous, with one dimension at least.
using Array = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;
Array as_array(nb::handle value, const char* name);

/// Gives a RuntimeWarning; throws where Python makes it an error.
void warn(const std::string& words);

/// Raises TypeError that names the argument, what was given and what is allowed.
[[noreturn]] void raise_type(nb::handle value, const char* name, const char* allowed);

/// The object of the core that an argument is; otherwise raises TypeError as above.
template <class T>
const T& as_instance(nb::handle value, const char* name, const char* allowed) {
  if (!nb::isinstance<T>(value)) {
    raise_type(value, name, allowed);
  }
  return nb::cast<const T&>(value);
}

/// The text that an argument is; otherwise raises TypeError as above.
std::string as_text(nb::handle value, const char* name, const char* allowed);

/// A number for a `__repr__`, such as "0.0312", "inf" or "nan".
std::string in_short(double number);
/// Numbers for a `__repr__`, such as "[0.1, -0.524]".
std::string in_short(const Eigen::VectorXd& numbers);

/// A vector argument of `size` entries (any size if -1); raises ValueError with the shape got and the shape allowed.
Eigen::VectorXd as_vector(nb::handle value, const char* name, Eigen::Index size = -1);

/// The same, of finite numbers; raises ValueError with the first entry that is not. Not for the control loop, where a
/// state that is not finite is a status.
Eigen::VectorXd as_finite_vector(nb::handle value, const char* name, Eigen::Index size = -1);

/// A scalar or a vector of `size` entries, as a vector.
Eigen::VectorXd as_filled_vector(nb::handle value, const char* name, Eigen::Index size);

/// A scalar, a vector (diagonal) or a matrix, as a `size` × `size` matrix.
Eigen::MatrixXd as_square_matrix(nb::handle value, const char* name, Eigen::Index size);

/// An (N, 3) array of points as 3 × N.
Eigen::Matrix3Xd as_points(nb::handle value, const char* name);

/// An array (N, nv); raises ValueError on another shape.
Eigen::MatrixXd as_rows(nb::handle value, const char* name, Eigen::Index nv);

/// A matrix argument of exactly this shape; -1: any number of rows or columns.
Eigen::MatrixXd as_matrix(nb::handle value, const char* name, Eigen::Index rows, Eigen::Index cols);

/// Pairs of links as (first, second) or (first, second, contact).
using Pairs = std::vector<std::variant<std::pair<std::string, std::string>, std::tuple<std::string, std::string, double>>>;
std::vector<LinkPair> link_pairs(const Pairs& pairs);

/// Throws std::invalid_argument if the body was fitted to another robot than this. A body made by hand, and a robot
/// of the core without geometry, have no fingerprint and are taken as they are.
void check_fitted_to(const Robot& robot, const Body& body);

/// Obstacles as they are; a shape, or a list of shapes and obstacles, by `sidestep.obstacles.obstacles_from_shapes`.
Obstacles as_obstacles(nb::handle value);

/// A number of seconds, or None: NaN.
double as_seconds(nb::handle value, const char* name);

/// A pose (4, 4), or a position (3,) where `position_only`; warns of a rotation that was rounded, and takes the nearest.
Eigen::Isometry3d as_pose(nb::handle value, bool position_only = false);

inline bool is_object(nb::handle) { return true; }

/// Anything that numpy makes an array of; the name is what the type stubs say about arguments that accept it.
class ArrayLike : public nb::object {
  NB_OBJECT_DEFAULT(ArrayLike, nb::object, "numpy.typing.ArrayLike", is_object)
};

/// A numpy array of float64; the name is what the type stubs say about functions that return one.
class NumpyArray : public nb::object {
  NB_OBJECT_DEFAULT(NumpyArray, nb::object, "numpy.typing.NDArray[numpy.float64]", is_object)
};

/// A numpy array that owns a copy of the data.
NumpyArray to_numpy(const Eigen::Ref<const Eigen::VectorXd>& vector);
NumpyArray to_numpy_matrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix);
/// 3 × N points as an (N, 3) array.
NumpyArray to_numpy_points(const Eigen::Ref<const Eigen::Matrix3Xd>& points);

}  // namespace sidestep::python

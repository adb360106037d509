#include "arguments.hpp"

#include <limits>
#include <nanobind/stl/string.h>

#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>

namespace sidestep::python {
namespace {

std::string shape_text(const Array& array) {
  std::string text = "(";
  for (std::size_t i = 0; i < array.ndim(); ++i) {
    text += std::to_string(array.shape(i)) + (i + 1 < array.ndim() ? ", " : "");
  }
  return text + (array.ndim() == 1 ? ",)" : ")");
}

[[noreturn]] void raise_shape(const char* name, const Array& array, const std::string& expected) {
  throw nb::value_error((std::string(name) + " has shape " + shape_text(array) + ", expected " + expected).c_str());
}

NumpyArray make_numpy(std::unique_ptr<double[]> data, std::initializer_list<std::size_t> shape) {
  double* raw = data.release();
  nb::capsule owner(raw, [](void* p) noexcept { delete[] static_cast<double*>(p); });
  return nb::steal<NumpyArray>(nb::cast(nb::ndarray<nb::numpy, double>(raw, shape, owner)).release());
}

/// Whether an array, or one in lists of them, has masked entries, which numpy's conversion would let out.
bool is_masked(nb::handle value, const nb::module_& numpy) {
  const nb::object ma = numpy.attr("ma");
  if (nb::isinstance(value, ma.attr("MaskedArray"))) {
    return nb::cast<bool>(ma.attr("is_masked")(value));
  }
  if (!nb::isinstance<nb::list>(value) && !nb::isinstance<nb::tuple>(value)) {
    return false;
  }
  for (const nb::handle item : value) {
    if (!PyFloat_Check(item.ptr()) && !PyLong_Check(item.ptr()) && is_masked(item, numpy)) {
      return true;
    }
  }
  return false;
}

bool is_plain_array(nb::handle value) {
  static PyObject* const type = nb::object(nb::module_::import_("numpy").attr("ndarray")).release().ptr();
  return value.type().ptr() == type;
}

/// A number, not an array of one.
std::optional<double> as_scalar(nb::handle value, const char* name) {
  if (PyFloat_Check(value.ptr())) {
    return nb::cast<double>(value);
  }
  const nb::object array = real_array(value, name);
  if (nb::cast<int>(array.attr("ndim")) == 0) {
    return nb::cast<double>(array.attr("item")());
  }
  return std::nullopt;
}

}  // namespace

std::string in_short(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", number);
  return text;
}

std::string in_short(const Eigen::VectorXd& numbers) {
  std::string text;
  for (const double number : numbers) {
    text += (text.empty() ? "" : ", ") + in_short(number);
  }
  return "[" + text + "]";
}

void warn(const std::string& words) {
  if (PyErr_WarnEx(PyExc_RuntimeWarning, words.c_str(), 1) != 0) {
    throw nb::python_error();
  }
}

void raise_type(nb::handle value, const char* name, const char* allowed) {
  constexpr std::size_t longest = 60;  // Longest text that a message shows in full.
  std::string given = nb::repr(value).c_str();
  if (given.size() > longest || given.find('\n') != std::string::npos) {
    given.clear();
  }
  std::string words = std::string(name) + " is ";
  if (value.is_none()) {
    words += "None";
  } else {
    words += given.empty() ? "of type " : given + ", of type ";
    words += nb::cast<std::string>(value.type().attr("__name__"));
  }
  throw nb::type_error((words + ", must be " + allowed).c_str());
}

std::string as_text(nb::handle value, const char* name, const char* allowed) {
  if (!nb::isinstance<nb::str>(value)) {
    raise_type(value, name, allowed);
  }
  return nb::cast<std::string>(value);
}

nb::object real_array(nb::handle value, const char* name) {
  if (value.is_none()) {
    raise_type(value, name, "an array of real numbers");
  }
  const nb::module_ numpy = nb::module_::import_("numpy");
  try {
    if (!is_plain_array(value) && is_masked(value, numpy)) {
      throw nb::value_error((std::string(name) + " has masked entries; fill them, or leave them out").c_str());
    }
    const nb::object array = numpy.attr("asarray")(value), type = array.attr("dtype");
    const std::string kind = nb::cast<std::string>(type.attr("kind"));
    if (kind != "f" && kind != "i" && kind != "u") {
      throw nb::type_error((std::string(name) + " must be an array of real numbers (float or int), has dtype " +
                            nb::str(type).c_str())
                               .c_str());
    }
    return numpy.attr("asarray")(array, numpy.attr("float64"));
  } catch (const nb::python_error& error) {
    if (!error.matches(PyExc_ValueError) && !error.matches(PyExc_TypeError)) {
      throw;
    }
    throw nb::type_error((std::string(name) + " must be an array of real numbers").c_str());
  }
}

Array as_array(nb::handle value, const char* name) {
  Array array;
  if (is_plain_array(value) && nb::try_cast<Array>(value, array, false)) {
    return array;
  }
  const nb::object numbers = real_array(value, name);
  return nb::cast<Array>(nb::module_::import_("numpy").attr("ascontiguousarray")(numbers));
}

Eigen::VectorXd as_vector(nb::handle value, const char* name, Eigen::Index size) {
  const Array array = as_array(value, name);
  if (array.ndim() != 1 || (size >= 0 && static_cast<Eigen::Index>(array.shape(0)) != size)) {
    raise_shape(name, array, size >= 0 ? "(" + std::to_string(size) + ",)" : "(N,)");
  }
  return Eigen::Map<const Eigen::VectorXd>(array.data(), static_cast<Eigen::Index>(array.shape(0)));
}

Eigen::VectorXd as_finite_vector(nb::handle value, const char* name, Eigen::Index size) {
  Eigen::VectorXd vector = as_vector(value, name, size);
  for (Eigen::Index i = 0; i < vector.size(); ++i) {
    if (!std::isfinite(vector[i])) {
      throw nb::value_error((std::string(name) + "[" + std::to_string(i) + "] is " + std::to_string(vector[i]) +
                             ", must be a finite number")
                                .c_str());
    }
  }
  return vector;
}

Eigen::VectorXd as_filled_vector(nb::handle value, const char* name, Eigen::Index size) {
  if (const std::optional<double> scalar = as_scalar(value, name)) {
    return Eigen::VectorXd::Constant(size, *scalar);
  }
  return as_vector(value, name, size);
}

Eigen::MatrixXd as_square_matrix(nb::handle value, const char* name, Eigen::Index size) {
  if (const std::optional<double> scalar = as_scalar(value, name)) {
    return *scalar * Eigen::MatrixXd::Identity(size, size);
  }
  const Array array = as_array(value, name);
  if (array.ndim() == 1) {
    return as_vector(value, name, size).asDiagonal();
  }
  return as_matrix(value, name, size, size);
}

Eigen::MatrixXd as_matrix(nb::handle value, const char* name, Eigen::Index rows, Eigen::Index cols) {
  const Array array = as_array(value, name);
  const auto fits = [&array](std::size_t axis, Eigen::Index size) {
    return size < 0 || static_cast<Eigen::Index>(array.shape(axis)) == size;
  };
  if (array.ndim() != 2 || !fits(0, rows) || !fits(1, cols)) {
    const auto expected = [](Eigen::Index size, const char* any) { return size < 0 ? any : std::to_string(size); };
    raise_shape(name, array, "(" + expected(rows, "N") + ", " + expected(cols, "M") + ")");
  }
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor>(array.data(), static_cast<Eigen::Index>(array.shape(0)),
                                    static_cast<Eigen::Index>(array.shape(1)));
}

Eigen::Matrix3Xd as_points(nb::handle value, const char* name) {
  const Array array = as_array(value, name);
  if (array.ndim() != 2 || array.shape(1) != 3) {
    raise_shape(name, array, "(N, 3)");
  }
  return Eigen::Map<const Eigen::Matrix3Xd>(array.data(), 3, static_cast<Eigen::Index>(array.shape(0)));
}

NumpyArray to_numpy(const Eigen::Ref<const Eigen::VectorXd>& vector) {
  auto data = std::make_unique<double[]>(static_cast<std::size_t>(vector.size()));
  Eigen::Map<Eigen::VectorXd>(data.get(), vector.size()) = vector;
  return make_numpy(std::move(data), {static_cast<std::size_t>(vector.size())});
}

NumpyArray to_numpy_matrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  auto data = std::make_unique<double[]>(static_cast<std::size_t>(matrix.size()));
  Eigen::Map<RowMajor>(data.get(), matrix.rows(), matrix.cols()) = matrix;
  return make_numpy(std::move(data), {static_cast<std::size_t>(matrix.rows()), static_cast<std::size_t>(matrix.cols())});
}

NumpyArray to_numpy_points(const Eigen::Ref<const Eigen::Matrix3Xd>& points) {
  return to_numpy_matrix(points.transpose());
}

std::vector<LinkPair> link_pairs(const Pairs& pairs) {
  std::vector<LinkPair> result;
  for (const auto& pair : pairs) {
    std::visit([&result](const auto& names) { result.push_back(std::make_from_tuple<LinkPair>(names)); }, pair);
  }
  return result;
}

Eigen::MatrixXd as_rows(nb::handle value, const char* name, Eigen::Index nv) {
  const Array array = as_array(value, name);
  if (array.ndim() != 2 || static_cast<Eigen::Index>(array.shape(1)) != nv) {
    throw nb::value_error((std::string(name) + " must have shape (N, " + std::to_string(nv) + ")").c_str());
  }
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      array.data(), static_cast<Eigen::Index>(array.shape(0)), nv);
}

double as_seconds(nb::handle value, const char* name) {
  double number = std::numeric_limits<double>::quiet_NaN();
  if (!value.is_none() && !nb::try_cast<double>(value, number)) {
    raise_type(value, name, "a number of seconds, or None");
  }
  return number;
}

}  // namespace sidestep::python

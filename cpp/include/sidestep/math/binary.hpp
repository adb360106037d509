#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

// Values as bytes, little-endian, for recordings and messages. A `describe(archive, value)` beside a struct serves both directions.
namespace sidestep::binary {

/// A number as the bytes have it, and back.
template <class Number>
Number little_endian(Number value) noexcept {
  if constexpr (std::endian::native == std::endian::big) {
    auto bytes = std::bit_cast<std::array<std::byte, sizeof(Number)>>(value);
    std::reverse(bytes.begin(), bytes.end());
    return std::bit_cast<Number>(bytes);
  }
  return value;
}

template <class T>
concept Number = std::is_arithmetic_v<T> || std::is_enum_v<T>;

/// Writes values one after the other to a sink with write(const void*, std::size_t) noexcept. No allocation of its own.
template <class Sink>
class Encoder {
 public:
  explicit Encoder(Sink& sink) : sink_(sink) {}

  template <class... Values>
  void operator()(const Values&... values) {
    (put(values), ...);
  }

 private:
  template <Number T>
  void put(T value) {
    const T stored = little_endian(value);
    sink_.write(&stored, sizeof stored);
  }
  void put(const std::string& text) {
    put(static_cast<std::uint32_t>(text.size()));
    sink_.write(text.data(), text.size());
  }
  template <class Derived>
  void put(const Eigen::DenseBase<Derived>& matrix) {
    if constexpr (Derived::ColsAtCompileTime != 1) {
      put(static_cast<std::uint32_t>(matrix.rows()));
    }
    put(static_cast<std::uint32_t>(matrix.cols() * (Derived::ColsAtCompileTime == 1 ? matrix.rows() : 1)));
    const auto& m = matrix.derived();
    if constexpr (std::endian::native == std::endian::little) {
      for (Eigen::Index j = 0; j < m.cols(); ++j) {
        sink_.write(m.data() + j * m.outerStride(), static_cast<std::size_t>(m.rows()) * sizeof(double));
      }
    } else {
      for (Eigen::Index j = 0; j < m.cols(); ++j) {
        for (Eigen::Index i = 0; i < m.rows(); ++i) {
          put(m(i, j));
        }
      }
    }
  }
  template <class T>
  void put(const std::vector<T>& values) {
    put(static_cast<std::uint32_t>(values.size()));
    for (const T& value : values) {
      if constexpr (Number<T> || std::is_same_v<T, std::string>) {
        put(value);
      } else {
        describe(*this, value);
      }
    }
  }

  Sink& sink_;
};

/// A sink that grows.
struct Bytes {
  std::vector<std::byte> bytes;

  void write(const void* data, std::size_t size) {
    const auto* const from = static_cast<const std::byte*>(data);
    bytes.insert(bytes.end(), from, from + size);
  }
};

/// Reads what an Encoder wrote. Throws std::invalid_argument where it ends too soon.
class Decoder {
 public:
  explicit Decoder(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <class... Values>
  void operator()(Values&... values) {
    (get(values), ...);
  }
  template <class T>
  T take() {
    T value{};
    get(value);
    return value;
  }
  std::span<const std::byte> raw(std::size_t size) {
    if (size > bytes_.size()) {
      throw std::invalid_argument("a part of it ends where more must follow");
    }
    const auto taken = bytes_.first(size);
    bytes_ = bytes_.subspan(size);
    return taken;
  }
  std::span<const std::byte> rest() const noexcept { return bytes_; }

 private:
  template <Number T>
  void get(T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      value = take<std::uint8_t>() != 0;
      return;
    }
    T stored;
    std::memcpy(&stored, raw(sizeof stored).data(), sizeof stored);
    value = little_endian(stored);
  }
  void get(std::string& text) {
    const auto bytes = raw(take<std::uint32_t>());
    text.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  template <class Scalar, int Rows, int Cols, int Options, int MaxRows, int MaxCols>
  void get(Eigen::Matrix<Scalar, Rows, Cols, Options, MaxRows, MaxCols>& matrix) {
    Eigen::Index rows = Rows, cols = Cols;
    if constexpr (Cols == 1) {
      rows = take<std::uint32_t>();
    } else {
      rows = take<std::uint32_t>();
      cols = take<std::uint32_t>();
    }
    if ((Rows != Eigen::Dynamic && rows != Rows) || (Cols != Eigen::Dynamic && cols != Cols)) {
      throw std::invalid_argument("a matrix in it has another size than it must have");
    }
    const auto count = static_cast<std::size_t>(rows) * static_cast<std::size_t>(cols);
    if (count > bytes_.size() / sizeof(Scalar)) {
      throw std::invalid_argument("a part of it ends where more must follow");
    }
    matrix.resize(rows, cols);
    for (Scalar& value : matrix.reshaped()) {
      get(value);
    }
  }
  template <class T>
  void get(std::vector<T>& values) {
    const std::size_t size = take<std::uint32_t>();
    if (size > bytes_.size()) {  // every entry has a byte at least
      throw std::invalid_argument("a part of it ends where more must follow");
    }
    values.clear();
    for (std::size_t k = 0; k < size; ++k) {
      T value{};
      if constexpr (Number<T> || std::is_same_v<T, std::string>) {
        get(value);
      } else {
        describe(*this, value);
      }
      values.push_back(std::move(value));
    }
  }

  std::span<const std::byte> bytes_;
};

}  // namespace sidestep::binary

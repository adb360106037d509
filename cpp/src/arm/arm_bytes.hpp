#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace sidestep {

/// What to do about a file that cannot be read.
inline constexpr const char* arm_file_advice = "; prepare the arm again: sidestep prepare NAME -o FILE";

/// Numbers, texts and sections of an arm file, see arm_file.cpp, appended to bytes.
class ArmWriter {
 public:
  template <class Integer>
  void integer(Integer value) {
    const auto bits = static_cast<std::make_unsigned_t<Integer>>(value);
    for (std::size_t k = 0; k < sizeof(bits); ++k) {
      bytes_.push_back(static_cast<std::byte>(bits >> (8 * k)));
    }
  }
  void number(double value) { integer(std::bit_cast<std::uint64_t>(value)); }
  template <class Matrix>
  void numbers(const Matrix& matrix) {
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
      for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
        number(matrix(i, j));
      }
    }
  }
  void count(std::size_t size) {
    if (size > std::numeric_limits<std::uint32_t>::max()) {
      throw std::length_error("an arm file holds lists of at most 4294967295 entries");
    }
    integer(static_cast<std::uint32_t>(size));
  }
  void raw(std::string_view text) {
    for (const char c : text) {
      bytes_.push_back(static_cast<std::byte>(c));
    }
  }
  void raw(std::span<const std::byte> bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
  void text(std::string_view text) {
    count(text.size());
    raw(text);
  }
  void pose(const Eigen::Isometry3d& X) { numbers(X.matrix().topRows<3>().eval()); }
  /// A section whose content `write` writes.
  template <class Write>
  void section(std::string_view tag, Write&& write) {
    ArmWriter content;
    write(content);
    raw(tag);
    integer(static_cast<std::uint64_t>(content.bytes_.size()));
    raw(content.bytes_);
  }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

/// The same, taken off bytes. Throws std::invalid_argument where they are not what must follow.
class ArmReader {
 public:
  explicit ArmReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  std::span<const std::byte> raw(std::size_t size) {
    if (size > bytes_.size()) {
      throw std::invalid_argument(std::string("it ends where more must follow") + arm_file_advice);
    }
    const auto taken = bytes_.first(size);
    bytes_ = bytes_.subspan(size);
    return taken;
  }
  template <class Integer>
  Integer integer() {
    std::make_unsigned_t<Integer> bits = 0;
    std::size_t k = 0;
    for (const std::byte byte : raw(sizeof(bits))) {
      bits = static_cast<decltype(bits)>(bits | (static_cast<decltype(bits)>(byte) << (8 * k++)));
    }
    return static_cast<Integer>(bits);
  }
  double number() { return std::bit_cast<double>(integer<std::uint64_t>()); }
  /// A matrix of as many numbers as there are, checked before anything is allocated.
  Eigen::MatrixXd numbers(std::size_t rows, std::size_t cols) {
    if (cols != 0 && rows > bytes_.size() / 8 / cols) {
      throw std::invalid_argument(std::string("a list is longer than the file") + arm_file_advice);
    }
    Eigen::MatrixXd matrix(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(cols));
    for (double& value : matrix.reshaped()) {
      value = number();
    }
    return matrix;
  }
  /// The length of a list whose entries have at least so many bytes.
  std::size_t count(std::size_t smallest_entry) {
    const std::size_t size = integer<std::uint32_t>();
    if (size > bytes_.size() / smallest_entry) {
      throw std::invalid_argument(std::string("a list is longer than the file") + arm_file_advice);
    }
    return size;
  }
  std::string text() {
    const auto bytes = raw(count(1));
    std::string text(bytes.size(), '\0');
    std::transform(bytes.begin(), bytes.end(), text.begin(), [](std::byte b) { return static_cast<char>(b); });
    return text;
  }
  Eigen::Isometry3d pose() {
    Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
    X.matrix().topRows<3>() = numbers(3, 4);
    return X;
  }
  bool flag() { return choice(2, "a flag") == 1; }
  /// One of the numbers below `end`.
  int choice(int end, const char* what) {
    const int value = integer<std::uint8_t>();
    if (value >= end) {
      throw std::invalid_argument(std::string(what) + " is " + std::to_string(value) + ", must be below " +
                                  std::to_string(end) + arm_file_advice);
    }
    return value;
  }
  /// What `read` makes of the section that must follow.
  template <class Read>
  auto section(std::string_view tag, Read&& read) {
    const auto found = raw(tag.size());
    if (!std::equal(tag.begin(), tag.end(), found.begin(),
                    [](char c, std::byte b) { return static_cast<std::byte>(c) == b; })) {
      throw std::invalid_argument("section " + std::string(tag) + " is missing" + arm_file_advice);
    }
    const auto size = integer<std::uint64_t>();
    if (size > bytes_.size()) {
      throw std::invalid_argument("section " + std::string(tag) + " is longer than the file" + arm_file_advice);
    }
    ArmReader content(raw(static_cast<std::size_t>(size)));
    auto result = read(content);
    content.expect_end("section " + std::string(tag));
    return result;
  }
  void expect_end(const std::string& what) const {
    if (!bytes_.empty()) {
      throw std::invalid_argument(what + " has " + std::to_string(bytes_.size()) + " bytes too many" + arm_file_advice);
    }
  }

 private:
  std::span<const std::byte> bytes_;
};

}  // namespace sidestep

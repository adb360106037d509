#include "compact_columns.hpp"

#include <algorithm>
#include <bit>
#include <optional>
#include <stdexcept>

namespace sidestep::recording {
namespace {

/// The same number bit for bit, so that NaN and -0 come back as they were.
bool same_bits(double a, double b) noexcept { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }

/// Whether a number is one of 32 bits, which come back as they were. (By its bits: GCC 12 drops casts to float and back in vectors.)
bool is_single(double value) noexcept {
  const auto bits = std::bit_cast<std::uint64_t>(value);
  const std::uint64_t exponent = bits >> 52u & 0x7ffu;
  return (bits & 0x1fffffffu) == 0 && ((exponent >= 1023 - 126 && exponent <= 1023 + 127) || bits << 1u == 0);
}

bool same_column(const Eigen::MatrixXd& a, Eigen::Index j, const Eigen::MatrixXd& b, Eigen::Index k) noexcept {
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    if (!same_bits(a(i, j), b(i, k))) {
      return false;
    }
  }
  return true;
}

/// Where columns are in a matrix: the first of those that are the same.
class ColumnTable {
 public:
  explicit ColumnTable(const Eigen::MatrixXd& matrix)
      : matrix_(matrix), places_(std::bit_ceil(2 * static_cast<std::size_t>(matrix.cols()) + 1), nowhere) {
    for (Eigen::Index k = 0; k < matrix.cols(); ++k) {
      std::int32_t& place = places_[slot_of(matrix, k)];
      place = place == nowhere ? static_cast<std::int32_t>(k) : place;
    }
  }
  /// Of column j of another matrix with as many rows; `nowhere`: there is none.
  std::int32_t find(const Eigen::MatrixXd& columns, Eigen::Index j) const noexcept { return places_[slot_of(columns, j)]; }

  static constexpr std::int32_t nowhere = -1;

 private:
  /// The slot with the same column, or the empty one where it would be.
  std::size_t slot_of(const Eigen::MatrixXd& columns, Eigen::Index j) const noexcept {
    std::uint64_t hash = 0;
    for (Eigen::Index i = 0; i < columns.rows(); ++i) {
      hash = (hash ^ std::bit_cast<std::uint64_t>(columns(i, j))) * 0x9e3779b97f4a7c15u;
      hash ^= hash >> 32u;
    }
    const std::size_t mask = places_.size() - 1;
    std::size_t slot = static_cast<std::size_t>(hash) & mask;
    while (places_[slot] != nowhere && !same_column(columns, j, matrix_, places_[slot])) {
      slot = (slot + 1) & mask;
    }
    return slot;
  }

  const Eigen::MatrixXd& matrix_;
  std::vector<std::int32_t> places_;  // a power of two of them, half of them empty
};

struct Run {
  std::int32_t first;  // -1: new columns
  std::uint32_t length;
};

/// Columns in order, as runs of the base and new ones.
std::vector<Run> runs_of(const Eigen::MatrixXd& columns, const Eigen::MatrixXd& base) {
  std::vector<Run> runs;
  std::optional<ColumnTable> table;  // not needed where all is the same
  std::int32_t at = 0;               // in the base, behind the last column that was found
  for (Eigen::Index j = 0; j < columns.cols(); ++j) {
    std::int32_t found = at;
    if (at >= base.cols() || !same_column(columns, j, base, at)) {
      if (!table) {
        table.emplace(base);
      }
      found = table->find(columns, j);
    }
    const bool is_new = found == ColumnTable::nowhere;
    const bool continues = !runs.empty() && (is_new ? runs.back().first < 0 : runs.back().first >= 0 && found == at);
    if (continues) {
      ++runs.back().length;
    } else {
      runs.push_back({found, 1});
    }
    at = is_new ? at : found + 1;
  }
  return runs;
}

/// Few bytes of a small number.
void put_short(std::uint64_t value, Encoder<Bytes>& to) {
  for (; value >= 0x80u; value >>= 7u) {
    to(static_cast<std::uint8_t>(value | 0x80u));
  }
  to(static_cast<std::uint8_t>(value));
}

std::int64_t take_short(Decoder& in) {
  constexpr unsigned most_bits = 35;
  std::int64_t value = 0;
  for (unsigned shift = 0; shift < most_bits; shift += 7) {
    const auto byte = in.take<std::uint8_t>();
    value |= static_cast<std::int64_t>(byte & 0x7fu) << shift;
    if (byte < 0x80u) {
      return value;
    }
  }
  throw std::invalid_argument("a number in a set of its obstacles is too large");
}

void put_runs(const std::vector<Run>& runs, Encoder<Bytes>& to) {
  to(static_cast<std::uint32_t>(runs.size()));
  std::int64_t at = 0;  // in the base, behind the last run
  for (const Run& run : runs) {
    const bool is_new = run.first < 0;
    put_short(2 * std::uint64_t{run.length} + (is_new ? 1 : 0), to);
    if (!is_new) {
      const std::int64_t away = run.first - at;
      put_short(static_cast<std::uint64_t>(away < 0 ? -1 - 2 * away : 2 * away), to);
      at = std::int64_t{run.first} + run.length;
    }
  }
}

/// Of so many columns in all.
std::vector<Run> take_runs(Decoder& in, std::uint32_t num, Eigen::Index base_columns) {
  std::vector<Run> runs;
  std::int64_t columns = 0, at = 0;
  for (std::uint32_t left = in.take<std::uint32_t>(); left > 0; --left) {
    const std::int64_t length_and_kind = take_short(in), length = length_and_kind / 2;
    std::int64_t first = -1;
    if (length_and_kind % 2 == 0) {
      const std::int64_t away = take_short(in);
      first = at + (away % 2 == 0 ? away / 2 : -(away + 1) / 2);
      at = first + length;
      if (first < 0 || at > base_columns) {
        throw std::invalid_argument("a run of its obstacles is not in the set that it refers to");
      }
    }
    columns += length;
    if (columns > num) {
      break;
    }
    runs.push_back({static_cast<std::int32_t>(first), static_cast<std::uint32_t>(length)});
  }
  if (columns != num) {
    throw std::invalid_argument("a set of its obstacles has another number of points than it says");
  }
  return runs;
}

std::uint8_t constant_rows(const Eigen::MatrixXd& columns) noexcept {
  std::uint8_t constant = 0;
  for (Eigen::Index i = 0; columns.cols() > 0 && i < columns.rows(); ++i) {
    bool same = true;
    for (Eigen::Index j = 1; same && j < columns.cols(); ++j) {
      same = same_bits(columns(i, j), columns(i, 0));
    }
    constant |= static_cast<std::uint8_t>(same ? 1u << i : 0u);
  }
  return constant;
}

/// Calls visit(i, j) for each number of the new columns that is in no constant row.
template <class Visit>
void each_new(const std::vector<Run>& runs, Eigen::Index rows, std::uint8_t constant, Visit&& visit) {
  Eigen::Index j = 0;
  for (const Run& run : runs) {
    for (std::uint32_t k = 0; k < run.length; ++k, ++j) {
      for (Eigen::Index i = 0; run.first < 0 && i < rows; ++i) {
        if ((constant >> i & 1u) == 0) {
          visit(i, j);
        }
      }
    }
  }
}

}  // namespace

void CompactColumns::write(const Eigen::MatrixXd& columns, const Eigen::MatrixXd& base, Bytes& out) {
  if (columns.rows() > most_rows) {
    throw std::invalid_argument("recording: columns have " + std::to_string(columns.rows()) + " rows, at most " +
                                std::to_string(most_rows) + " are allowed");
  }
  const std::uint8_t constant = constant_rows(columns);
  const std::vector<Run> runs = runs_of(columns, base);
  Encoder<Bytes> to(out);
  to(static_cast<std::uint32_t>(columns.cols()), constant);
  for (Eigen::Index i = 0; i < columns.rows(); ++i) {
    if ((constant >> i & 1u) != 0) {
      to(columns(i, 0));
    }
  }
  put_runs(runs, to);
  bool narrow = true;
  std::size_t numbers = 0;
  each_new(runs, columns.rows(), constant, [&](Eigen::Index i, Eigen::Index j) {
    narrow = narrow && is_single(columns(i, j));
    ++numbers;
  });
  out.bytes.reserve(out.bytes.size() + 1 + numbers * (narrow ? sizeof(float) : sizeof(double)));
  to(static_cast<std::uint8_t>(narrow));
  each_new(runs, columns.rows(), constant, [&](Eigen::Index i, Eigen::Index j) {
    if (narrow) {
      to(static_cast<float>(columns(i, j)));
    } else {
      to(columns(i, j));
    }
  });
}

Eigen::MatrixXd CompactColumns::read(Decoder& in, Eigen::Index rows, const Eigen::MatrixXd& base) {
  const auto num = in.take<std::uint32_t>();
  const auto constant = in.take<std::uint8_t>();
  Eigen::VectorXd values = Eigen::VectorXd::Zero(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    if ((constant >> i & 1u) != 0) {
      values[i] = in.take<double>();
    }
  }
  const std::vector<Run> runs = take_runs(in, num, base.rows() == rows ? base.cols() : 0);
  const bool narrow = in.take<std::uint8_t>() != 0;
  std::uint64_t numbers = 0;
  for (const Run& run : runs) {
    numbers += run.first < 0 ? run.length * static_cast<std::uint64_t>(rows - std::popcount(constant)) : 0;
  }
  if (numbers * (narrow ? sizeof(float) : sizeof(double)) > in.rest().size()) {
    throw std::invalid_argument("a set of its obstacles ends where more must follow");
  }
  Eigen::MatrixXd all = values.replicate(1, static_cast<Eigen::Index>(num));
  Eigen::Index j = 0;
  for (const Run& run : runs) {
    if (run.first >= 0) {
      all.middleCols(j, run.length) = base.middleCols(run.first, run.length);
    }
    j += run.length;
  }
  each_new(runs, rows, constant, [&](Eigen::Index i, Eigen::Index k) {
    all(i, k) = narrow ? static_cast<double>(in.take<float>()) : in.take<double>();
  });
  return all;
}

}  // namespace sidestep::recording

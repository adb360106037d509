#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "recording_bytes.hpp"

namespace sidestep::recording {

/// Columns of numbers in few bytes, and without loss: rows that are constant are written once; runs of columns that another matrix has
/// are written as where they are in it; and numbers that fit into 32 bits as such.
///
///   columns (u32), constant rows (u8, a bit each), their values (f64), runs (u32) with each: twice its length, plus 1 of new columns;
///   else its distance from the end of the run before in the other matrix: twice, or -1 minus twice where it is negative; whether new
///   columns have 32 bits (u8), new columns without the constant rows
///
/// Lengths and distances are written seven bits a byte, the lowest first, all but the last with the eighth bit.
/// Sets of obstacles of a camera come 30 times a second, and differ little.
class CompactColumns {
 public:
  static constexpr Eigen::Index most_rows = 8;

  /// `base`: another matrix with as many rows (8 at most), or one without columns.
  static void write(const Eigen::MatrixXd& columns, const Eigen::MatrixXd& base, Bytes& out);
  /// Reads what `write` wrote with the same base. Throws std::invalid_argument where it cannot be that.
  static Eigen::MatrixXd read(Decoder& in, Eigen::Index rows, const Eigen::MatrixXd& base);
};

}  // namespace sidestep::recording

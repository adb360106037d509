#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>

#include "recording_content.hpp"
#include "sidestep/scene/obstacles.hpp"

namespace sidestep {

/// The points of one set of a source, on their way into a file or out of it.
struct RecordedSet {
  std::uint64_t number = 0, source = 0;  // source: its id, see SourceSet
  std::shared_ptr<const Obstacles> points;
};

/// The last set of each source in one file, by which the next one of that source is written and read.
///
///   number, source, base (u64 each), points with radii, velocities with uncertainty (CompactColumns of 4 rows each), order (i32 each),
///   names, counts
///
/// The base is the number of the set before it of the same source in the file, whose columns are not written again; 0: none. The
/// order is that of Obstacles::in_order, and empty where it is the usual one of these points.
class SetHistory {
 public:
  void write(const RecordedSet& set, recording::Bytes& out);
  /// Sets must be read in the order in which they were written, from the first on. Throws std::invalid_argument.
  RecordedSet read(std::span<const std::byte> content);

 private:
  struct Columns {
    std::uint64_t number = 0;
    Eigen::MatrixXd places{4, 0}, motions{4, 0};
  };

  /// The last set of a source; one without columns where there is none.
  Columns take(std::uint64_t source);
  void keep(std::uint64_t source, Columns columns);

  std::map<std::uint64_t, Columns> last_;  // by source
};

/// A set of a file of 0.2.
RecordedSet to_set(const recording::ObstaclesRecord& record);

}  // namespace sidestep

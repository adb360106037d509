#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "sidestep/scene/obstacles.hpp"

namespace sidestep {

/// Most sources of a controller.
inline constexpr std::size_t most_sources = 32;

/// The newest set of a source, as it was given.
struct SourceSet {
  static constexpr double not_come = -std::numeric_limits<double>::infinity();  // `time` of a source that is expected

  std::string name;
  std::uint64_t id = 0, number = 0;  // id: of the source until it is removed; number: of the set that the points are of
  double time = 0.0;                 // when it was captured, on the caller's clock [s]; NaN: when a step takes it
  double heard = 0.0;                // the same of the newest set, which may be empty and not believed
  std::uint64_t heard_number = 0;
  double valid_for = 0.0;  // [s]; inf: for ever
  double moves_for = 0.0;  // Time for which its points move on along their velocities, at most [s].
  bool emptied = false;    // newer sets are empty
  bool repeated = false;   // newer sets are the same, although their points move
  std::shared_ptr<const Obstacles> points;
};

/// All obstacles, as they were given: source k is part k of the obstacles.
struct World {
  std::uint64_t number = 0;  // 0: none were ever set
  Obstacles obstacles = Obstacles::none();
  std::vector<SourceSet> sources;
};

/// How the obstacles of a world have moved since they were given, part by part.
struct WorldMotion {
  struct Part {
    double moved = 0.0;  // time for which it moved along its velocities [s]
    bool frozen = false, hidden = false;
    bool operator==(const Part&) const = default;
  };
  std::array<Part, most_sources> parts{};
  bool operator==(const WorldMotion&) const = default;

  /// Moves obstacles as they were given to where they are. No allocation.
  void apply(Obstacles& obstacles) const noexcept;
};

/// The points of all sources, part by part.
Obstacles join(const std::vector<SourceSet>& sources);

}  // namespace sidestep

#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sidestep/controller/settings.hpp"
#include "sidestep/controller/source.hpp"
#include "sidestep/scene/velocity_estimate.hpp"
#include "world.hpp"

namespace sidestep {

/// The obstacles that were set, source by source. For the threads that set them, one at a time; `now` is the time of a call on the
/// controller's clock [s].
class SourceRegistry {
 public:
  explicit SourceRegistry(const ControllerSettings& settings);

  // Each of these throws std::invalid_argument that names the value and what is allowed; then nothing changes.

  /// Replaces what a source said. An empty set after one with points is not believed at once, see SourceSettings::empty_after.
  void set(Obstacles obstacles, const SourceOptions& options, double now);
  /// Tells that sources will come: each is overdue until it is set. One that is there stays as it is.
  void expect(const std::vector<std::string>& sources);
  /// Forgets a source.
  void remove(const std::string& source);
  /// Adds named groups that a source does not have, or that are its first.
  void add(const Obstacles& obstacles, const std::string& source);
  /// Moves a named group to another pose in the world, see Obstacles::named: a set like those of `set`.
  void move(const std::string& name, const Eigen::Isometry3d& pose, const SourceOptions& options, double now);
  /// Removes a named group. Where it was the last one the source is empty, which is believed.
  void remove(const std::string& name, const std::string& source);

  /// What all sources said last.
  std::vector<SourceContent> said() const;
  /// All sources, as a step takes them.
  World world() const;

 private:
  struct Entry {
    SourceSet set;
    Obstacles given = Obstacles::none();          // as they were given
    double last = -1e300, last_but_one = -1e300;  // Times of the last two sets [s].
    double emptied_at = 0.0;                      // [s]
    bool comes = false;                           // Three sets came within the time for which they are valid.
    int in_a_row = 0;                             // Number of sets, each soon after the one before.
    std::optional<VelocityEstimate> motion;       // Velocities that nobody told, from the second set on.
  };

  Entry* find(const std::string& source) noexcept;
  Entry& at(const std::string& source);
  Entry& at_or_new(const std::string& source);
  /// Throws where a source that is not there would be beyond the most that there can be.
  static void require_room(const std::string& source, std::size_t number);
  /// Notes that a source was set at a time [s].
  void note(Entry& entry, double time) const noexcept;
  /// Finds velocities that nobody told from the points before, which were set at `last` [s]. `has_time`: they were given their time.
  void find_velocities(Entry& entry, const Obstacles& before, double last, double time, bool has_time) const;
  /// Puts other points, which are believed at once; NaN as their time: not one of the sets that come again and again.
  void replace(Entry& entry, Obstacles obstacles, const SourceOptions& options, double time);
  double validity(const Entry& entry, const SourceOptions& options) const noexcept;

  const ControllerSettings& settings_;
  std::vector<Entry> entries_;
  std::uint64_t number_ = 0, last_id_ = 0;
};

}  // namespace sidestep

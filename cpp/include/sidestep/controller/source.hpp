#pragma once

#include <limits>
#include <memory>
#include <string>

#include "sidestep/scene/obstacles.hpp"

namespace sidestep {

/// Where a set of obstacles comes from, and how long it may be believed.
struct SourceOptions {
  static constexpr double untold = std::numeric_limits<double>::quiet_NaN();
  static constexpr const char* scene = "scene";

  std::string source = scene;  ///< name; a set replaces only what the same source said before
  double time = untold;        ///< when it was captured [s], on the clock of Controller::step; NaN: when the next step takes it
  /// Age up to which it is believed [s]; inf: for ever; NaN: SourceSettings::valid_for where it was given a time or has velocities, or
  /// where such sets came three times within that; else ControllerSettings::obstacle_timeout.
  double valid_for = untold;
  /// The set is taken as it is: an empty one is believed at once, and velocities that are not told are not sought. For a source that has
  /// judged both itself.
  bool as_given = false;
};

/// What a source said last, as it was given.
struct SourceContent {
  std::string name;
  double time = SourceOptions::untold;  ///< when it was captured [s], on the clock of Controller::step; NaN: not told
  std::shared_ptr<const Obstacles> obstacles;
};

/// What a controller believes of a source.
struct SourceState {
  std::string name;
  int size = 0;             ///< number of points
  double age = 0.0;         ///< time since what is believed was captured [s]; inf: it was expected, and has not come yet
  double valid_for = 0.0;   ///< age up to which it is believed [s]
  bool is_overdue = false;  ///< older than that: the arm stops until it comes again
  bool is_emptied = false;  ///< newer sets are empty, and not believed yet
};

}  // namespace sidestep

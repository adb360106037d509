#pragma once

#include <string>

#include "sidestep/math/fields.hpp"

namespace sidestep {

/// How what cameras see becomes obstacles.
struct PerceptionSettings {
  double voxel = 0.02;
  double reach_margin = 0.25;
  double view_margin = 2.0;
  double memory = 30.0;
  int clear_after = 2;
  int least_pixels = 3;
  int steady_images = 8;
  bool unseen_is_free = true;
  double valid_for = 0.25;

  /// Throws std::invalid_argument that names the setting, its value and what is allowed.
  void validate() const;
};

template <> const std::vector<Field<PerceptionSettings>>& fields();

}  // namespace sidestep

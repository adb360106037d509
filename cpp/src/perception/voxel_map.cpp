#include "sidestep/perception/voxel_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sidestep {
namespace {

constexpr double kept_per_seen = 10.0;    // Time for which a voxel is kept, in times for which it was seen.
constexpr double kept_at_least = 0.3;     // The same, at least [s].
constexpr float shrinks_by = 0.2f;        // Share of its excess by which a box shrinks from one image to the next.
constexpr double second_within = 0.5;     // Time within which a second image must show a voxel with few pixels [s].
constexpr double noise_beyond = 3.0;      // Noise of a depth that is behind a cell, in standard deviations.
constexpr double half_diagonal = 0.8661;  // of a cell, in edges
constexpr int samples_of_cell = 5;        // Pixels of a cell that are looked at: its middle, and four around it.
constexpr int samples_free = 3;           // of which so many must be free, and none hidden

}  // namespace

VoxelMap::VoxelMap(const Eigen::Vector3d& centre, double reach, const PerceptionSettings& settings)
    : settings_(settings),
      grid_(centre, reach + settings.reach_margin, reach + std::max(settings.reach_margin, settings.view_margin),
            settings.voxel),
      index_(static_cast<std::size_t>(grid_.num_cells()), -1) {}

void VoxelMap::clear() noexcept {
  for (Voxel& voxel : voxels_) {
    if (voxel.cell >= 0) {
      remove(voxel);
    }
  }
}

void VoxelMap::add(const SeenImage& seen) {
  ++frame_;
  touched_.clear();
  const auto width = static_cast<std::size_t>(seen.image.width());
  for (std::vector<float>* const coordinate : {&row_x_, &row_y_, &row_z_}) {
    coordinate->resize(width);
  }
  row_cells_.resize(width);
  add_points(seen);
  for (const int index : touched_) {
    end_frame(voxels_[static_cast<std::size_t>(index)], seen);
  }
  const Eigen::Isometry3d X_CW = seen.X_WC.inverse();
  for (Voxel& voxel : voxels_) {
    if (voxel.cell >= 0 && voxel.frame != frame_) {
      look_for(voxel, seen, X_CW);
    }
  }
}

Voxel& VoxelMap::voxel_at(int cell, double time) {
  int& index = index_[static_cast<std::size_t>(cell)];
  if (index < 0) {
    if (unused_.empty()) {
      unused_.push_back(static_cast<int>(voxels_.size()));
      voxels_.emplace_back();
    }
    index = unused_.back();
    unused_.pop_back();
    Voxel& fresh = voxels_[static_cast<std::size_t>(index)];
    fresh = {};
    fresh.cell = cell;
    fresh.first = fresh.last = time;
    fresh.frame = frame_ - 1;
  }
  return voxels_[static_cast<std::size_t>(index)];
}

void VoxelMap::begin_frame(Voxel& voxel, const SeenImage& seen) noexcept {
  constexpr float inf = std::numeric_limits<float>::infinity();
  voxel.frame = frame_;
  voxel.pixels = 0;
  voxel.camera = seen.number;
  std::fill(voxel.frame_low, voxel.frame_low + 3, inf);
  std::fill(voxel.frame_high, voxel.frame_high + 3, -inf);
  touched_.push_back(static_cast<int>(&voxel - voxels_.data()));
}

void VoxelMap::add_points(const SeenImage& seen) {
  const Eigen::Matrix3f R = seen.X_WC.linear().cast<float>();
  const Eigen::Vector3f t = seen.X_WC.translation().cast<float>();
  const int width = seen.image.width();
  num_outside_ = 0;
  for (int v = 0; v < seen.image.height(); ++v) {
    const auto row = static_cast<std::ptrdiff_t>(v) * width;
    const float* __restrict__ const ray_x = seen.rays.x() + row;
    const float* __restrict__ const ray_y = seen.rays.y() + row;
    const float* __restrict__ const depth = seen.image.depth() + row;
    float* __restrict__ const x = row_x_.data();
    float* __restrict__ const y = row_y_.data();
    float* __restrict__ const z = row_z_.data();
    for (int u = 0; u < width; ++u) {
      const float a = ray_x[u] * depth[u], b = ray_y[u] * depth[u], c = depth[u];
      x[u] = R(0, 0) * a + R(0, 1) * b + R(0, 2) * c + t[0];
      y[u] = R(1, 0) * a + R(1, 1) * b + R(1, 2) * c + t[1];
      z[u] = R(2, 0) * a + R(2, 1) * b + R(2, 2) * c + t[2];
    }
    grid_.cells(x, y, z, width, row_cells_.data());
    add_row(seen, seen.image.labels() + row);
  }
}

void VoxelMap::add_row(const SeenImage& seen, const PixelLabel* labels) {
  int last_cell = -1;
  Voxel* voxel = nullptr;
  for (std::size_t u = 0; u < row_cells_.size(); ++u) {
    const int cell = row_cells_[u];
    if (labels[u] != PixelLabel::obstacle) {
      continue;
    }
    if (cell < 0) {
      ++num_outside_;
      continue;
    }
    if (cell != last_cell) {
      last_cell = cell;
      voxel = &voxel_at(cell, seen.time);
      if (voxel->frame != frame_) {
        begin_frame(*voxel, seen);
      }
    }
    ++voxel->pixels;
    const float p[3] = {row_x_[u], row_y_[u], row_z_[u]};
    for (int axis = 0; axis < 3; ++axis) {
      voxel->frame_low[axis] = std::min(voxel->frame_low[axis], p[axis]);
      voxel->frame_high[axis] = std::max(voxel->frame_high[axis], p[axis]);
    }
  }
}

void VoxelMap::end_frame(Voxel& voxel, const SeenImage& seen) noexcept {
  const bool is_new = voxel.pixels > 0 && !(voxel.high[0] > voxel.low[0]) && !voxel.counts;
  const bool shown_again = voxel.first < seen.time && seen.time - voxel.last <= second_within;
  for (int axis = 0; axis < 3; ++axis) {
    if (is_new || !(seen.time > voxel.last)) {
      voxel.low[axis] = voxel.frame_low[axis];
      voxel.high[axis] = voxel.frame_high[axis];
    } else {
      voxel.low[axis] =
          std::min(voxel.frame_low[axis], voxel.low[axis] + shrinks_by * (voxel.frame_low[axis] - voxel.low[axis]));
      voxel.high[axis] =
          std::max(voxel.frame_high[axis], voxel.high[axis] + shrinks_by * (voxel.frame_high[axis] - voxel.high[axis]));
    }
  }
  voxel.counts = voxel.counts || voxel.pixels >= settings_.least_pixels || shown_again;
  const Eigen::Vector3d middle(voxel.low[0], voxel.low[1], voxel.low[2]);
  voxel.error = static_cast<float>(seen.camera.translation_error +
                                   seen.camera.rotation_error * (middle - seen.X_WC.translation()).norm());
  voxel.last = std::max(voxel.last, seen.time);
  voxel.free_images = 0;
  voxel.is_hidden = false;
}

VoxelMap::Sight VoxelMap::sight(const Voxel& voxel, const SeenImage& seen, const Eigen::Isometry3d& X_CW) const noexcept {
  const Eigen::Vector3d middle = X_CW * (0.5 * (Eigen::Vector3d(voxel.low[0], voxel.low[1], voxel.low[2]) +
                                                Eigen::Vector3d(voxel.high[0], voxel.high[1], voxel.high[2])));
  const double edge = this->edge(voxel), half = half_diagonal * edge;
  if (middle.z() <= seen.camera.near + half) {
    return Sight::elsewhere;
  }
  const Eigen::Vector2d pixel = seen.camera.project(middle);
  const double offset_u = 0.35 * edge * seen.camera.fx / middle.z(), offset_v = 0.35 * edge * seen.camera.fy / middle.z();
  const double behind = middle.z() + half + noise_beyond * seen.camera.noise.sigma(middle.z());
  int num_free = 0, num_inside = 0;
  for (int sample = 0; sample < samples_of_cell; ++sample) {
    const double side_u = sample == 0 ? 0.0 : (sample % 2 == 0 ? 1.0 : -1.0),
                 side_v = sample == 0 ? 0.0 : (sample < 3 ? 1.0 : -1.0);
    const double u = std::round(pixel.x() + side_u * offset_u), v = std::round(pixel.y() + side_v * offset_v);
    if (!(u >= 0.0 && v >= 0.0 && u < seen.camera.width && v < seen.camera.height)) {
      continue;
    }
    ++num_inside;
    const std::size_t i =
        static_cast<std::size_t>(v) * static_cast<std::size_t>(seen.camera.width) + static_cast<std::size_t>(u);
    const PixelLabel label = seen.image.labels()[i];
    if (label == PixelLabel::nothing || label == PixelLabel::edge) {
      continue;
    }
    const double sees_to = seen.sees_to(i);
    if (sees_to > behind) {
      ++num_free;
    } else if (sees_to < middle.z() - half) {
      return Sight::hidden;
    }
  }
  return num_inside == 0 ? Sight::elsewhere : num_free >= samples_free ? Sight::free : Sight::hidden;
}

void VoxelMap::look_for(Voxel& voxel, const SeenImage& seen, const Eigen::Isometry3d& X_CW) noexcept {
  const Sight what = sight(voxel, seen, X_CW);
  if (what == Sight::free) {
    voxel.is_hidden = false;
    if (++voxel.free_images >= settings_.clear_after || !voxel.counts) {
      remove(voxel);
    }
    return;
  }
  if (what == Sight::hidden) {
    voxel.is_hidden = true;
  }
  const double kept = std::min(settings_.memory, kept_at_least + kept_per_seen * (voxel.last - voxel.first));
  if (seen.time - voxel.last > (voxel.counts ? kept : second_within)) {
    remove(voxel);
  }
}

void VoxelMap::remove(Voxel& voxel) noexcept {
  index_[static_cast<std::size_t>(voxel.cell)] = -1;
  voxel.cell = -1;
  unused_.push_back(static_cast<int>(&voxel - voxels_.data()));
}

}  // namespace sidestep

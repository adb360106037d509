#include "sidestep/perception/voxel_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "../math/kernels/in_use.hpp"
#include "kernels/image_kernel.hpp"

namespace sidestep {
namespace {

constexpr double rests_after = 0.1;  // Time for which something must be seen before it is known to rest [s],
constexpr int rests_images = 3;      // and number of images that must show it.
constexpr double kept_per_seen =
    10.0;  // Time for which something is kept that moved when it was seen, in times for which it was seen.
constexpr double kept_at_least = 0.3;       // The same, at least [s].
constexpr float shrinks_by = 0.2f;          // Share of its excess by which a box shrinks from one image to the next.
constexpr float settled_shrinks_by = 0.5f;  // The same of one that has been seen for long.
constexpr double second_within = 0.5;       // Time within which a second image must show a voxel with few pixels [s],
constexpr int longest_gap = 1;              // with at most so many images of the camera in between.
constexpr double noise_beyond = 3.0;        // Noise of a depth that is behind a cell, in standard deviations.
constexpr int missed_at_most = 5;           // Images full of a surface nearby, and not in the cell, after which it was noise.
constexpr double least_share = 0.1;         // Share of a cell's pixels that must show it before it counts at once.
constexpr double settled_noise = 2.0;       // Noise of depths that explains a cell by one nearby, in standard deviations.
constexpr double half_diagonal = 0.8661;    // of a cell, in edges
constexpr int samples_of_cell = 5;          // Pixels of a cell that are looked at: its middle, and four around it,
constexpr double around = 0.35;             // so far from it, in sizes of the box, or edges.
constexpr int samples_free = 3;             // of which so many must be free, and none hidden

constexpr double spread = 2.0;          // Noise of depths over which a surface is spread along the ray, in standard deviations,
constexpr double neighbourhood = 3.0;   // and width of what is looked at around a cell that it reaches [edges],
constexpr double samples_across = 6.0;  // by so many pixels across, or somewhat more.
constexpr double tail = 1.25;  // Mean distance of what is looked at from the cell, at most: 2 sigma off a surface [sigma].

/// Indices of the pixels that show the samples of a cell: its middle, and four places so far from it [m]; -1: not in the image.
std::array<std::ptrdiff_t, samples_of_cell> sample_pixels(const DepthCamera& camera, const Eigen::Vector3d& middle,
                                                          double offset) noexcept {
  const Eigen::Vector2d pixel = camera.project(middle);
  const double offset_u = offset * camera.fx / middle.z(), offset_v = offset * camera.fy / middle.z();
  std::array<std::ptrdiff_t, samples_of_cell> pixels;
  for (int sample = 0; sample < samples_of_cell; ++sample) {
    const double side_u = sample == 0 ? 0.0 : (sample % 2 == 0 ? 1.0 : -1.0),
                 side_v = sample == 0 ? 0.0 : (sample < 3 ? 1.0 : -1.0);
    const double u = std::round(pixel.x() + side_u * offset_u), v = std::round(pixel.y() + side_v * offset_v);
    const bool is_inside = u >= 0.0 && v >= 0.0 && u < camera.width && v < camera.height;
    pixels[static_cast<std::size_t>(sample)] =
        is_inside ? static_cast<std::ptrdiff_t>(v) * camera.width + static_cast<std::ptrdiff_t>(u) : -1;
  }
  return pixels;
}

constexpr std::uint16_t bit(std::uint8_t camera) noexcept { return static_cast<std::uint16_t>(1u << camera); }

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
  beside_arm_.take(seen.image);
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
  if (voxel.cut_by == 0) {
    std::copy(voxel.low, voxel.low + 3, voxel.kept_low);
    std::copy(voxel.high, voxel.high + 3, voxel.kept_high);
  }
  voxel.cut_by &= static_cast<std::uint16_t>(~bit(seen.number));
  voxel.camera = seen.number;
  std::fill(voxel.frame_low, voxel.frame_low + 3, inf);
  std::fill(voxel.frame_high, voxel.frame_high + 3, -inf);
  touched_.push_back(static_cast<int>(&voxel - voxels_.data()));
}

void VoxelMap::add_points(const SeenImage& seen) {
  const kernels::ImageKernel kernel = SIDESTEP_KERNEL_IN_USE(kernels::image_kernel)();
  kernels::Placement X_WC;
  Eigen::Map<Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(X_WC.R) = seen.X_WC.linear().cast<float>();
  Eigen::Map<Eigen::Vector3f>(X_WC.t) = seen.X_WC.translation().cast<float>();
  const int width = seen.image.width();
  for (int v = 0; v < seen.image.height(); ++v) {
    const auto row = static_cast<std::ptrdiff_t>(v) * width;
    kernel.place(X_WC, seen.rays.x() + row, seen.rays.y() + row, seen.depth + row, width, row_x_.data(), row_y_.data(),
                 row_z_.data());
    grid_.cells(row_x_.data(), row_y_.data(), row_z_.data(), width, row_cells_.data());
    add_row(seen, v);
  }
}

void VoxelMap::add_row(const SeenImage& seen, int v) {
  const PixelLabel* const labels = seen.image.labels() + static_cast<std::ptrdiff_t>(v) * seen.image.width();
  const float *const x = row_x_.data(), *const y = row_y_.data(), *const z = row_z_.data();
  const int* const cells = row_cells_.data();
  const std::size_t width = row_cells_.size();
  for (std::size_t u = 0; u < width;) {
    const int cell = cells[u];
    if (labels[u] != PixelLabel::obstacle || cell < 0) {
      ++u;
      continue;
    }
    // Pixels side by side that are in one cell are taken together.
    const std::size_t first = u;
    float low_x = x[u], high_x = x[u], low_y = y[u], high_y = y[u], low_z = z[u], high_z = z[u];
    for (++u; u < width && cells[u] == cell && labels[u] == PixelLabel::obstacle; ++u) {
      low_x = std::min(low_x, x[u]);
      high_x = std::max(high_x, x[u]);
      low_y = std::min(low_y, y[u]);
      high_y = std::max(high_y, y[u]);
      low_z = std::min(low_z, z[u]);
      high_z = std::max(high_z, z[u]);
    }
    Voxel& voxel = voxel_at(cell, seen.time);
    if (voxel.frame != frame_) {
      begin_frame(voxel, seen);
    }
    voxel.pixels += static_cast<int>(u - first);
    if ((voxel.cut_by & bit(seen.number)) == 0 &&
        beside_arm_.is_beside(seen.image, v, static_cast<int>(first), static_cast<int>(u) - 1)) {
      voxel.cut_by |= bit(seen.number);
    }
    voxel.frame_low[0] = std::min(voxel.frame_low[0], low_x);
    voxel.frame_low[1] = std::min(voxel.frame_low[1], low_y);
    voxel.frame_low[2] = std::min(voxel.frame_low[2], low_z);
    voxel.frame_high[0] = std::max(voxel.frame_high[0], high_x);
    voxel.frame_high[1] = std::max(voxel.frame_high[1], high_y);
    voxel.frame_high[2] = std::max(voxel.frame_high[2], high_z);
  }
}

void VoxelMap::end_frame(Voxel& voxel, const SeenImage& seen) noexcept {
  const bool in_a_row =
      voxel.gap <= longest_gap && voxel.missed_samples <= samples_of_cell && seen.time - voxel.last <= second_within;
  if (!voxel.counts && !in_a_row) {  // depths that fly beside an edge come back to a cell now and then
    voxel.first = seen.time;
    voxel.shown_images = 0;
  }
  const bool shown_again = voxel.first < seen.time;
  take_box(voxel, seen.time);
  const double distance = (voxel.low_corner() - seen.X_WC.translation()).norm();
  const double pixel = distance / std::min(seen.camera.fx, seen.camera.fy);
  const double all_pixels = std::pow(edge(voxel) / pixel, 2);  // that a surface across the cell takes, at most
  voxel.counts = voxel.counts || voxel.pixels >= std::max<double>(settings_.least_pixels, least_share * all_pixels) ||
                 shown_again || is_seen_around(voxel, seen);
  voxel.shown_by |= bit(seen.number);
  voxel.error = static_cast<float>(seen.camera.translation_error + seen.camera.rotation_error * distance);
  voxel.last = std::max(voxel.last, seen.time);
  voxel.free_images = voxel.missed_samples = voxel.gap = 0;
  voxel.shown_images = static_cast<std::uint8_t>(std::min(voxel.shown_images + 1, 255));
  voxel.is_hidden = false;
}

bool VoxelMap::is_seen_around(const Voxel& voxel, const SeenImage& seen) const noexcept {
  const DepthCamera& camera = seen.camera;
  const Eigen::Vector3d middle = seen.X_WC.inverse() * voxel.frame_middle();
  const double edge = this->edge(voxel), noise = camera.noise.sigma(middle.z());
  if (!(middle.z() >= camera.near) || noise < edge) {
    return false;
  }
  const Eigen::Vector2d pixel = camera.project(middle);
  if (!(pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() <= camera.width - 1.0 && pixel.y() <= camera.height - 1.0)) {
    return false;  // also where a lens folds
  }
  const double half_u = 0.5 * neighbourhood * edge * camera.fx / middle.z(), half_v = half_u * camera.fy / camera.fx;
  const int u0 = static_cast<int>(std::max(0.0, std::ceil(pixel.x() - half_u))),
            v0 = static_cast<int>(std::max(0.0, std::ceil(pixel.y() - half_v))),
            u1 = static_cast<int>(std::min(camera.width - 1.0, pixel.x() + half_u)),
            v1 = static_cast<int>(std::min(camera.height - 1.0, pixel.y() + half_v));
  const int step = std::max(1, static_cast<int>(2.0 * half_u / samples_across));
  const double all_pixels = (u1 - u0 + 1.0) * (v1 - v0 + 1.0);
  const double least = std::max(neighbourhood * settings_.least_pixels, least_share * all_pixels) / (step * step);
  int num = 0;
  double sum = 0.0;  // of the distances behind the cell [m]
  for (int v = v0; v <= v1; v += step) {
    const std::size_t row = static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width);
    for (int u = u0; u <= u1; u += step) {
      const std::size_t i = row + static_cast<std::size_t>(u);
      const double behind = seen.depth[i] - middle.z();
      if (seen.image.labels()[i] == PixelLabel::obstacle && std::abs(behind) <= spread * noise) {
        sum += behind;
        ++num;
      }
    }
  }
  return num >= least && std::abs(sum) <= tail * num * noise;  // else it is in the tail of the noise of another surface
}

void VoxelMap::take_box(Voxel& voxel, double time) const noexcept {
  if (voxel.shown_images == 0) {  // it begins
    std::copy(voxel.frame_low, voxel.frame_low + 3, voxel.low);
    std::copy(voxel.frame_high, voxel.frame_high + 3, voxel.high);
    voxel.cut_by = 0;
    return;
  }
  const bool is_later = time > voxel.last;  // else another camera's of the same time
  const float shrinks = !is_later ? 0.0f : voxel.last - voxel.first > background_after ? settled_shrinks_by : shrinks_by;
  for (int axis = 0; axis < 3; ++axis) {
    float &low = voxel.low[axis], &high = voxel.high[axis];
    low = std::min(voxel.frame_low[axis], low + shrinks * (voxel.frame_low[axis] - low));
    high = std::max(voxel.frame_high[axis], high + shrinks * (voxel.frame_high[axis] - high));
    if (voxel.cut_by != 0) {
      low = std::min(low, voxel.kept_low[axis]);
      high = std::max(high, voxel.kept_high[axis]);
    }
  }
}

VoxelMap::Sight VoxelMap::sight(const Voxel& voxel, const SeenImage& seen, const Eigen::Isometry3d& X_CW) const noexcept {
  const Eigen::Vector3d middle = X_CW * voxel.middle();
  const double edge = this->edge(voxel), half = half_diagonal * edge;
  if (middle.z() <= seen.camera.near + half) {
    return Sight::elsewhere;
  }
  // The samples are within the box: a cell beside the edge of something nearer is not hidden where what was in it is not.
  const double offset = around * (voxel.high_corner() - voxel.low_corner()).maxCoeff();
  const double noise = noise_beyond * seen.camera.noise.sigma(middle.z());
  int num_free = 0, num_inside = 0, num_surface = 0;
  for (const std::ptrdiff_t pixel : sample_pixels(seen.camera, middle, offset)) {
    if (pixel < 0) {
      continue;
    }
    ++num_inside;
    const auto i = static_cast<std::size_t>(pixel);
    const PixelLabel label = seen.image.labels()[i];
    if (!has_surface(label)) {
      continue;
    }
    const double sees_to = seen.sees_to(i);
    if (sees_to > middle.z() + half + noise) {
      ++num_free;
    } else if (label == PixelLabel::arm || sees_to < middle.z() - half - noise) {
      return Sight::hidden;  // also where the arm is as near: it takes what touches it with it
    } else {
      ++num_surface;
    }
  }
  return num_inside == 0              ? Sight::elsewhere
         : num_free >= samples_free   ? Sight::free
         : num_free + num_surface > 0 ? Sight::surface
                                      : Sight::hidden;
}

int VoxelMap::num_surface(const Voxel& voxel, const SeenImage& seen, const Eigen::Isometry3d& X_CW) const noexcept {
  const Eigen::Vector3d middle = X_CW * voxel.middle();
  const double edge = this->edge(voxel), most = half_diagonal * edge + noise_beyond * seen.camera.noise.sigma(middle.z());
  // The samples are as far apart as the cell is wide: few pixels make a small box, in which one pixel would count five times.
  const auto pixels = sample_pixels(seen.camera, middle, around * edge);
  return static_cast<int>(std::count_if(pixels.begin(), pixels.end(), [&](std::ptrdiff_t pixel) {
    if (pixel < 0) {
      return false;
    }
    const auto i = static_cast<std::size_t>(pixel);
    const PixelLabel label = seen.image.labels()[i];
    return has_surface(label) && label != PixelLabel::arm && std::abs(seen.sees_to(i) - middle.z()) <= most;
  }));
}

void VoxelMap::look_for(Voxel& voxel, const SeenImage& seen, const Eigen::Isometry3d& X_CW) noexcept {
  voxel.shown_by &= static_cast<std::uint16_t>(~bit(seen.number));
  voxel.gap = static_cast<std::uint8_t>(std::min(voxel.gap + (seen.number == voxel.camera ? 1 : 0), 255));
  const Sight what = sight(voxel, seen, X_CW);
  if (what == Sight::free) {
    voxel.is_hidden = false;
    if (++voxel.free_images >= settings_.clear_after || !voxel.counts) {
      remove(voxel);
    }
    return;
  }
  if (what == Sight::surface) {
    const int num = voxel.counts ? std::max(1, num_surface(voxel, seen, X_CW)) : samples_of_cell;
    voxel.missed_samples = static_cast<std::uint8_t>(voxel.missed_samples + num);
    if (voxel.missed_samples >= samples_of_cell * (voxel.counts ? missed_at_most : 2)) {
      remove(voxel);
      return;
    }
  }
  voxel.is_hidden = voxel.is_hidden || what == Sight::hidden;
  const double kept = may_move(voxel) ? std::min(settings_.memory, kept_at_least + kept_per_seen * (voxel.last - voxel.first))
                                      : settings_.memory;
  if (seen.time - voxel.last > (voxel.counts ? kept : second_within)) {
    remove(voxel);
  }
}

bool VoxelMap::may_move(const Voxel& voxel) noexcept {
  return voxel.moves || voxel.last - voxel.first < rests_after || voxel.shown_images < rests_images;
}

bool VoxelMap::is_settled(const Voxel& voxel, const Eigen::Vector3d& eye, const DepthNoise& noise) const noexcept {
  if (voxel.last - voxel.first > background_after) {
    return true;
  }
  const Eigen::Vector3d middle = voxel.middle();
  const double depth = (middle - eye).norm(), edge = this->edge(voxel), reach = edge + settled_noise * noise.sigma(depth);
  const Eigen::Vector3d along = (middle - eye) / std::max(depth, 1e-6);
  for (double step = edge; step <= reach; step += edge) {
    if (rests_at(middle + step * along) || rests_at(middle - step * along)) {
      return true;
    }
  }
  return false;
}

bool VoxelMap::rests_at(const Eigen::Vector3d& point) const noexcept {
  const Eigen::Vector3f p = point.cast<float>();
  const int index = voxel_of(p.data());
  if (index < 0) {
    return false;
  }
  const Voxel& voxel = voxels_[static_cast<std::size_t>(index)];
  return voxel.counts && voxel.last - voxel.first > background_after;
}

bool VoxelMap::is_beside_rest(const Voxel& voxel) const noexcept {
  const double edge = this->edge(voxel);
  for (const double x : {-edge, 0.0, edge}) {
    for (const double y : {-edge, 0.0, edge}) {
      for (const double z : {-edge, 0.0, edge}) {
        if (rests_at(voxel.middle() + Eigen::Vector3d(x, y, z))) {
          return true;
        }
      }
    }
  }
  return false;
}

void VoxelMap::remove(Voxel& voxel) noexcept {
  index_[static_cast<std::size_t>(voxel.cell)] = -1;
  voxel.cell = -1;
  unused_.push_back(static_cast<int>(&voxel - voxels_.data()));
}

}  // namespace sidestep

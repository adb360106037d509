#include "sidestep/perception/perception_settings.hpp"

#include <limits>

namespace sidestep {

template <>
const std::vector<Field<PerceptionSettings>>& fields() {
  using S = PerceptionSettings;
  constexpr double inf = std::numeric_limits<double>::infinity();
  static const std::vector<Field<S>> all{
      {"voxel", &S::voxel, "m", 0.005, 0.1,
       "edge of the cells in which points are merged, within reach of the arm: smaller cells stand out of surfaces less (by 0.4 of the edge, more at edges), and cost more"},
      {"reach_margin", &S::reach_margin, "m", 0.0, 2.0,
       "distance beyond the reach of the arm up to which cells are as fine as voxel; beyond, their edge is twice and four times as long: larger is finer farther out, and costs more"},
      {"view_margin", &S::view_margin, "m", 0.0, 5.0,
       "distance beyond the reach of the arm up to which things are seen: smaller is faster, and sees later what comes"},
      {"memory", &S::memory, "s", 0.0, inf,
       "time for which something is kept that is hidden or out of view now; what moved, or was seen for less than 0.1 s, is kept for 0.3 s and ten times as long as it was seen: longer keeps more that is gone"},
      {"clear_after", &S::clear_after, "-", 1, 10,
       "number of images in a row that must see through a cell before what was there is gone: more is safer against flicker, and clears later"},
      {"least_pixels", &S::least_pixels, "-", 1, 100,
       "number of pixels that must show a cell before it counts at once, or three times as many around it where noise is larger than a cell; with fewer it counts when a second image shows it, the next or the one after it: more makes fewer ghosts, and shows thin things later"},
      {"steady_images", &S::steady_images, "-", 1, 100,
       "number of images over which a camera that stands still averages the depth of what rests (1: none): more is smoother, and up to 2 sigma behind what moves slowly (by less than 1 sigma from image to image), 0.9 sigma where it is 15 pixels wide and high"},
      {"unseen_is_free", &S::unseen_is_free, "-", 0, 1,
       "space that no camera has seen yet counts as free; without it the arm keeps clear of what nobody has looked at, and reaches less"},
      {"valid_for", &S::valid_for, "s", 0.001, inf,
       "age up to which the image of a camera is believed; then the arm stops until the next one comes: longer bridges more lost images"},
  };
  return all;
}

void PerceptionSettings::validate() const { check_fields("perception: ", *this); }

}  // namespace sidestep

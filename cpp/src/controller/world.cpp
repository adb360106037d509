#include "world.hpp"

namespace sidestep {

void WorldMotion::apply(Obstacles& obstacles) const noexcept {
  for (std::size_t k = 0; k < obstacles.num_parts() && k < most_sources; ++k) {
    obstacles.advance(k, parts[k].moved);
    if (parts[k].hidden) {
      obstacles.hide(k);
    } else if (parts[k].frozen) {
      obstacles.freeze(k);
    }
  }
}

Obstacles join(const std::vector<SourceSet>& sources) {
  if (sources.empty()) {
    return Obstacles::none();
  }
  if (sources.size() == 1) {
    return *sources.front().points;
  }
  std::vector<const Obstacles*> sets;
  for (const SourceSet& source : sources) {
    sets.push_back(source.points.get());
  }
  return Obstacles::join(sets);
}

}  // namespace sidestep

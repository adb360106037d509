#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include "model.hpp"
#include "sources.hpp"
#include "tick.hpp"

namespace sidestep {

/// An arm of a recording among obstacles that move as in its controller: for clearances.
class RecordedArm {
 public:
  /// `links`: gets those of this arm that it has not yet.
  RecordedArm(Arm arm, const ControllerSettings& settings, std::vector<std::string>& links);

  void put(World world) { worlds_.put(std::move(world)); }
  /// The obstacles that it uses, as they are now.
  const World& world() const noexcept { return worlds_.current(); }
  void go_on_from(RecordedArm& before) { sources_.go_on_from(before.sources_); }
  /// The obstacles move on to the moment of a step of the arm at q.
  void update(const Eigen::VectorXd& q, const Tick& tick) noexcept { sources_.update(q, tick); }
  /// Clearances of the links at q, in the order of `links` (NaN: of another arm), and of the arm to itself.
  void write_clearances(const Eigen::VectorXd& q, double cap, std::vector<double>& of_links, double& of_itself);

  /// What a coordinate is of; null: this arm has none of that number.
  const CoordinateLabel* label(int coordinate) const noexcept {
    const auto& labels = model_.system->labels();
    return coordinate >= 0 && static_cast<std::size_t>(coordinate) < labels.size()
               ? &labels[static_cast<std::size_t>(coordinate)]
               : nullptr;
  }
  const Obstacles& obstacles() const noexcept { return sources_.obstacles(); }
  /// An obstacle point in words: its name, or that of its source.
  std::string words_for(int point) const;

 private:
  const ControllerModel model_;
  TripleBuffer<World> worlds_{World{}};
  Sources sources_;
  ClearanceQuery::Workspace workspace_;
  Eigen::VectorXd clearances_;
  std::vector<int> columns_;  // Index in `links` of each item; -1: it is of the arm alone, -2: a load.
};

}  // namespace sidestep

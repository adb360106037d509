#include "recorded_arm.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "../math/settings.hpp"

namespace sidestep {
namespace {

constexpr int of_arm_itself = -1, of_a_load = -2;

}  // namespace

RecordedArm::RecordedArm(Arm arm, const ControllerSettings& settings, std::vector<std::string>& links)
    : model_(std::move(arm), settings),
      sources_(worlds_, model_.body, model_.arm.robot(), model_.arm.body(), model_.settings),
      workspace_(model_.body),
      clearances_(model_.body.num_items()) {
  for (int i = 0; i < model_.body.num_items(); ++i) {
    const CoordinateLabel& label = model_.body.label(i);
    if (label.kind != CoordinateLabel::Kind::obstacle && label.kind != CoordinateLabel::Kind::plane) {
      columns_.push_back(label.kind == CoordinateLabel::Kind::effort ? of_a_load : of_arm_itself);
      continue;
    }
    auto link = std::find(links.begin(), links.end(), label.name);
    if (link == links.end()) {
      link = links.insert(links.end(), label.name);
    }
    columns_.push_back(static_cast<int>(link - links.begin()));
  }
}

void RecordedArm::write_clearances(const Eigen::VectorXd& q, double cap, std::vector<double>& of_links, double& of_itself) {
  model_.body.clearances(q, sources_.obstacles(), cap, workspace_, clearances_);
  of_links.clear();
  of_itself = infinity;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    const double found = clearances_[static_cast<Eigen::Index>(i)];
    const double clearance = found < cap ? found : infinity;
    if (columns_[i] >= 0) {
      const auto column = static_cast<std::size_t>(columns_[i]);
      if (of_links.size() <= column) {
        of_links.resize(column + 1, std::numeric_limits<double>::quiet_NaN());
      }
      of_links[column] = std::fmin(of_links[column], clearance);  // not NaN where one is not
    } else if (columns_[i] == of_arm_itself) {
      of_itself = std::min(of_itself, clearance);
    }
  }
}

std::string RecordedArm::words_for(int point) const {
  const Obstacles& obstacles = sources_.obstacles();
  if (point < 0 || point >= obstacles.size()) {
    return "an obstacle";
  }
  if (!obstacles.name_of(point).empty()) {
    return obstacles.words_for(point);
  }
  const std::vector<SourceSet>& sources = sources_.sources();
  const std::size_t part = obstacles.part_of(point);
  return part < sources.size() ? "a point of '" + sources[part].name + "'" : "an obstacle";
}

}  // namespace sidestep

#include "sidestep/scene/obstacles.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "../math/finite.hpp"
#include "sidestep/math/rotation.hpp"

namespace sidestep {
Obstacles::Obstacles(Eigen::Matrix3Xd points, Eigen::VectorXd radii, Eigen::Matrix3Xd velocities)
    : points_(std::move(points)),
      radii_(std::move(radii)),
      velocities_(std::move(velocities)),
      uncertainty_(Eigen::VectorXd::Zero(points_.cols())),
      begins_{0, points_.cols()} {
  const Eigen::Index num = points_.cols();
  if (num == 0) {
    throw std::invalid_argument(
        "obstacles: the cloud is empty; a sensor that sees nothing is not a free workspace. "
        "Use Obstacles.none() if the workspace is known to be free");
  }
  if (radii_.size() != num || velocities_.cols() != num) {
    throw std::invalid_argument("obstacles: " + std::to_string(num) + " points, " + std::to_string(radii_.size()) +
                                " radii and " + std::to_string(velocities_.cols()) + " velocities; the numbers must be equal");
  }
  for (Eigen::Index i = 0; i < num; ++i) {
    const auto owner = [i] { return "obstacles: point " + std::to_string(i); };
    if (!points_.col(i).allFinite()) {
      Eigen::Index bad = 0;
      for (Eigen::Index k = i; k < num; ++k) {
        bad += points_.col(k).allFinite() ? 0 : 1;
      }
      throw std::invalid_argument(owner() + " is not finite" +
                                  (bad > 1 ? ", as are " + std::to_string(bad) + " of all " + std::to_string(num) : "") +
                                  "; leave out what a camera did not see: points[np.isfinite(points).all(axis=1)]");
    }
    if (!(radii_[i] >= 0.0) || !(radii_[i] <= largest_radius)) {
      throw std::invalid_argument(owner() + " has radius " + std::to_string(radii_[i]) +
                                  ", must be finite, >= 0 and at most 1e9 m");
    }
    if (!velocities_.col(i).allFinite()) {
      throw std::invalid_argument(owner() + " has a velocity that is not finite");
    }
  }
  tree_ = PointTree(points_, radii_, velocities_);
  find_movers();
}

Obstacles Obstacles::in_order(Eigen::Matrix3Xd points, Eigen::VectorXd radii, Eigen::Matrix3Xd velocities,
                              Eigen::VectorXd uncertainty, std::vector<int> order) {
  Obstacles made(std::move(points), std::move(radii), std::move(velocities));
  made = made.moving(made.velocities_, std::move(uncertainty));
  std::erase(order, -1);
  std::vector<int> sorted = order;
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t n = 0; n < sorted.size(); ++n) {
    if (sorted.size() != static_cast<std::size_t>(made.size()) || sorted[n] != static_cast<int>(n)) {
      throw std::invalid_argument("obstacles: the order has another number than each point once");
    }
  }
  std::vector<int> usual = made.tree_.order();
  std::erase(usual, -1);
  if (order != usual) {
    made.tree_ = PointTree(made.points_, made.radii_, made.velocities_, std::move(order));
  }
  return made;
}

Obstacles Obstacles::join(const std::vector<const Obstacles*>& sets) {
  Obstacles joined;
  joined.begins_ = {0};
  std::vector<const PointTree*> trees;
  auto names = std::make_shared<Names>();
  for (const Obstacles* const set : sets) {
    const Eigen::Index before = joined.begins_.back();
    for (std::size_t k = 1; k < set->begins_.size(); ++k) {
      joined.begins_.push_back(before + set->begins_[k]);
    }
    trees.push_back(&set->tree_);
    for (std::size_t k = 0; const auto& [name, count] : set->groups()) {
      names->poses.push_back(set->pose_of(k++));
      names->names.push_back(name);
      names->ends.push_back((names->ends.empty() ? 0 : names->ends.back()) + count);
    }
  }
  const Eigen::Index num = joined.begins_.back();
  joined.points_.resize(3, num);
  joined.velocities_.resize(3, num);
  joined.radii_.resize(num);
  joined.uncertainty_.resize(num);
  Eigen::Index at = 0;
  for (const Obstacles* const set : sets) {
    const Eigen::Index count = set->size();
    joined.points_.middleCols(at, count) = set->points_;
    joined.velocities_.middleCols(at, count) = set->velocities_;
    joined.radii_.segment(at, count) = set->radii_;
    joined.uncertainty_.segment(at, count) = set->uncertainty_;
    at += count;
  }
  joined.tree_ = PointTree::join(trees);
  joined.find_movers();
  joined.names_ = std::move(names);
  return joined;
}

Obstacles Obstacles::moving(Eigen::Matrix3Xd velocities, Eigen::VectorXd uncertainty) const {
  if (velocities.cols() != size() || uncertainty.size() != size() || !velocities.allFinite() || !uncertainty.allFinite() ||
      (uncertainty.array() < 0.0).any()) {
    throw std::invalid_argument("obstacles: " + std::to_string(velocities.cols()) + " velocities and " +
                                std::to_string(uncertainty.size()) + " uncertainties of " + std::to_string(size()) +
                                " points; there must be one of each, finite, no uncertainty below 0");
  }
  Obstacles copy = *this;
  if (velocities != velocities_) {
    copy.velocities_ = std::move(velocities);
    copy.tree_ = tree_.moving(copy.points_, copy.radii_, copy.velocities_);
    copy.find_movers();
    copy.version_ = next_version();
  }
  if (uncertainty != uncertainty_) {
    copy.uncertainty_ = std::move(uncertainty);
    copy.version_ = next_version();
  }
  return copy;
}

void Obstacles::find_movers() {
  movers_.clear();
  mover_begins_ = {0};
  for (std::size_t part = 0; part < num_parts(); ++part) {
    for (Eigen::Index n = begins_[part]; moves(part) && n < begins_[part + 1]; ++n) {
      if (!velocities_.col(n).isZero(0.0)) {
        movers_.push_back(n);
      }
    }
    mover_begins_.push_back(static_cast<Eigen::Index>(movers_.size()));
  }
}

Obstacles Obstacles::frozen() const {
  Obstacles copy = *this;
  for (std::size_t part = 0; part < num_parts(); ++part) {
    copy.freeze(part);
  }
  return copy;
}

std::size_t Obstacles::part_of(Eigen::Index point) const noexcept {
  const auto end = std::upper_bound(begins_.begin() + 1, begins_.end() - 1, point);
  return static_cast<std::size_t>(end - begins_.begin()) - 1;
}

Eigen::Isometry3d Obstacles::pose_of(std::size_t k) const {
  return names_ && k < names_->poses.size() ? names_->poses[k] : Eigen::Isometry3d::Identity();
}

Obstacles Obstacles::named(std::vector<std::string> names, const std::vector<Eigen::Index>& counts,
                           std::vector<Eigen::Isometry3d> poses) const {
  poses.resize(poses.empty() ? names.size() : poses.size(), Eigen::Isometry3d::Identity());
  if (names.size() != counts.size() || poses.size() != names.size()) {
    throw std::invalid_argument("obstacles: " + std::to_string(names.size()) + " names and " + std::to_string(counts.size()) +
                                " counts; the numbers must be equal");
  }
  std::vector<Eigen::Index> ends;
  Eigen::Index total = 0;
  for (std::size_t k = 0; k < counts.size(); ++k) {
    if (counts[k] < 0 || counts[k] > size() - total) {
      throw std::invalid_argument("obstacles: '" + names[k] + "' has count " + std::to_string(counts[k]) +
                                  ", must be between 0 and " + std::to_string(size() - total) +
                                  ", the number of points that are left");
    }
    total += counts[k];
    ends.push_back(total);
  }
  if (total != size()) {
    throw std::invalid_argument("obstacles: counts are of " + std::to_string(total) + " points, there are " +
                                std::to_string(size()));
  }
  for (std::size_t k = 0; k < poses.size(); ++k) {
    check_rotation(poses[k].linear(), "obstacles: '" + names[k] + "'");
  }
  Obstacles copy = *this;
  copy.names_ = std::make_shared<const Names>(Names{std::move(names), std::move(ends), std::move(poses)});
  return copy;
}

std::vector<std::pair<std::string, Eigen::Index>> Obstacles::groups() const {
  std::vector<std::pair<std::string, Eigen::Index>> result;
  if (!names_) {
    if (size() > 0) {
      result.emplace_back("", size());
    }
    return result;
  }
  Eigen::Index begin = 0;
  for (std::size_t k = 0; k < names_->ends.size(); begin = names_->ends[k++]) {
    result.emplace_back(names_->names[k], names_->ends[k] - begin);
  }
  return result;
}

std::string_view Obstacles::name_of(Eigen::Index point) const noexcept {
  if (!names_ || point < 0 || point >= size()) {
    return {};
  }
  // The first end beyond the point: points are counted from 0, and things without points end where the next begins.
  const auto end = std::upper_bound(names_->ends.begin(), names_->ends.end(), point);
  return names_->names[static_cast<std::size_t>(end - names_->ends.begin())];
}

bool Obstacles::advance(double duration) noexcept {
  bool all = true;
  for (std::size_t part = 0; part < num_parts(); ++part) {
    all = advance(part, duration) && all;
  }
  return all;
}

bool Obstacles::advance(std::size_t part, double duration) noexcept {
  if (!std::isfinite(duration)) {
    return false;
  }
  if (!moves(part)) {
    return true;
  }
  const auto first = static_cast<std::size_t>(mover_begins_[part]), end = static_cast<std::size_t>(mover_begins_[part + 1]);
  for (std::size_t k = first; k < end; ++k) {
    if (!all_finite(points_.col(movers_[k]) + duration * velocities_.col(movers_[k]))) {
      return false;
    }
  }
  for (std::size_t k = first; k < end; ++k) {
    points_.col(movers_[k]) += duration * velocities_.col(movers_[k]);
  }
  tree_.advance(part, duration);
  version_ = next_version();
  return true;
}

void Obstacles::freeze(std::size_t part) noexcept {
  const Eigen::Index begin = begins_[part], count = begins_[part + 1] - begin;
  if (count > 0) {
    velocities_.middleCols(begin, count).setZero();
    uncertainty_.segment(begin, count).setZero();
    tree_.freeze(part);
  }
}

void Obstacles::hide(std::size_t part) noexcept {
  freeze(part);
  const Eigen::Index begin = begins_[part], count = begins_[part + 1] - begin;
  if (count > 0) {
    points_.middleCols(begin, count).setConstant(PointTree::padding);
    tree_.hide(part);
    version_ = next_version();
  }
}

std::string Obstacles::words_for(Eigen::Index point) const {
  const std::string_view name = name_of(point);
  if (name.empty() && point < 0) {
    return "an obstacle";
  }
  if (name.empty()) {
    return "obstacle point " + std::to_string(point);
  }
  std::string quoted(1, '\'');
  return quoted.append(name).append(1, '\'');
}

std::uint64_t Obstacles::next_version() noexcept {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

}  // namespace sidestep

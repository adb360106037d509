#include "sidestep/scene/velocity_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "../math/settings.hpp"
#include "cloud_motion.hpp"
#include "shape_motion.hpp"

namespace sidestep {
namespace {

/// Name of a group, and which one of those of that name it is.
using GroupKey = std::pair<std::string, int>;

}  // namespace

void VelocityEstimate::Settings::validate() const { require_positive(largest_speed, "largest_speed"); }

struct VelocityEstimate::Impl {
  explicit Impl(const Settings& s) : settings(s), clouds(s.largest_speed) {}

  Settings settings;
  std::map<GroupKey, ShapeMotion> shapes;
  CloudMotion clouds;
  double last = -infinity;  // time of the last set [s]

  /// Points of a group as a shape; false where it is a cloud as far as is known.
  bool take_shape(const GroupKey& key, const Eigen::Matrix3Xd& points, Eigen::Index begin, double time,
                  std::map<GroupKey, ShapeMotion>& seen, Result& result) {
    const auto known = shapes.find(key);
    if (known == shapes.end()) {
      seen.emplace(key, ShapeMotion(points, time));
      return false;
    }
    ShapeMotion& shape = seen.emplace(key, std::move(known->second)).first->second;
    const ShapeMotion::Kind kind = shape.update(points, time, settings.largest_speed);
    if (kind == ShapeMotion::Kind::other) {
      return false;
    }
    result.sets.segment(begin, points.cols()).setConstant(shape.sets());
    if (kind == ShapeMotion::Kind::same) {
      result.velocities.middleCols(begin, points.cols()) = shape.velocities();
      result.uncertainty.segment(begin, points.cols()) = shape.uncertainty().cwiseMin(settings.largest_speed);
    }
    return true;
  }

  Result update(const Obstacles& now, double time, Sight sight, const Eigen::VectorXd& noise) {
    const Eigen::Index num = now.size();
    Result result{Eigen::Matrix3Xd::Zero(3, num), Eigen::VectorXd::Constant(num, settings.largest_speed),
                  Eigen::VectorXi::Ones(num)};
    std::map<GroupKey, ShapeMotion> seen;
    std::map<std::string, int> of_name;
    std::vector<Eigen::Index> cloud;
    Eigen::Index begin = 0;
    for (const auto& [name, count] : now.groups()) {
      if (count > 0 && !name.empty() && now.velocities().middleCols(begin, count).isZero(0.0)) {
        const GroupKey key(name, of_name[name]++);
        if (!take_shape(key, now.points().middleCols(begin, count), begin, time, seen, result)) {
          for (Eigen::Index n = begin; n < begin + count; ++n) {
            cloud.push_back(n);
          }
        }
      } else {
        take_told(now, begin, count, cloud, result);
      }
      begin += count;
    }
    shapes = std::move(seen);
    take_cloud(now, cloud, time, std::move(sight), noise, result);
    return result;
  }

  /// A group of a name keeps what it was told; points without names those that have a velocity, and are a cloud otherwise.
  static void take_told(const Obstacles& now, Eigen::Index begin, Eigen::Index count, std::vector<Eigen::Index>& cloud,
                        Result& result) {
    const bool is_named = !now.name_of(begin).empty();
    for (Eigen::Index n = begin; n < begin + count; ++n) {
      if (is_named || !now.velocities().col(n).isZero(0.0)) {
        result.velocities.col(n) = now.velocities().col(n);
        result.uncertainty[n] = 0.0;
        result.sets[n] = 0;
      } else {
        cloud.push_back(n);
      }
    }
  }

  void take_cloud(const Obstacles& now, const std::vector<Eigen::Index>& cloud, double time, Sight sight,
                  const Eigen::VectorXd& noise, Result& result) {
    const std::vector<PointMotion> motions =
        clouds.update(now.points()(Eigen::all, cloud), time, std::move(sight), noise(cloud));
    for (std::size_t n = 0; n < cloud.size(); ++n) {
      result.velocities.col(cloud[n]) = motions[n].velocity;
      result.uncertainty[cloud[n]] = motions[n].uncertainty;
      result.sets[cloud[n]] = motions[n].sets;
    }
  }
};

VelocityEstimate::VelocityEstimate(const Settings& settings) {
  settings.validate();
  impl_ = std::make_unique<Impl>(settings);
}
VelocityEstimate::~VelocityEstimate() = default;
VelocityEstimate::VelocityEstimate(VelocityEstimate&&) noexcept = default;
VelocityEstimate& VelocityEstimate::operator=(VelocityEstimate&&) noexcept = default;

VelocityEstimate::Result VelocityEstimate::update(const Obstacles& now, double time, Sight sight,
                                                  const Eigen::VectorXd& noise) {
  require(std::isfinite(time), "time", time, "finite");
  if (noise.size() != 0 && noise.size() != now.size()) {
    throw std::invalid_argument("noise has " + std::to_string(noise.size()) + " values, must have one for each of " +
                                std::to_string(now.size()) + " points, or none");
  }
  for (const double sigma : noise) {
    require(sigma >= 0.0 && std::isfinite(sigma), "noise", sigma, "finite and not negative");
  }
  if (!(time > impl_->last)) {
    forget();
  }
  impl_->last = time;
  return impl_->update(now, time, std::move(sight), noise.size() == 0 ? Eigen::VectorXd::Zero(now.size()) : noise);
}

void VelocityEstimate::begin(const Obstacles& first, double time, Sight sight) {
  require(std::isfinite(time), "time", time, "finite");
  forget();
  impl_->last = time;
  impl_->clouds.begin(first.points(), time, std::move(sight));
}

void VelocityEstimate::forget() { *impl_ = Impl(impl_->settings); }

}  // namespace sidestep

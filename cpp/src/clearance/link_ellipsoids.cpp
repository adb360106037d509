#include "sidestep/clearance/link_ellipsoids.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <stdexcept>

namespace sidestep {
namespace {

constexpr double cover_overshoot = 0.04;  // Largest overshoot of the balls that cover an ellipsoid [m].

LinkEllipsoid in_principal_axes(const BodyEllipsoid& e) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(e.shape);
  const Eigen::Matrix3d axes_T = eigen.eigenvectors().transpose();
  return {e, axes_T, eigen.eigenvalues(), cover_by_balls(e.mean, axes_T, eigen.eigenvalues(), cover_overshoot)};
}

/// Fills in what follows from the ellipsoids.
void surround(LinkEllipsoids& link) {
  for (const LinkEllipsoid& e : link.ellipsoids) {
    if (link.rows.empty() || link.rows.back().full()) {
      link.rows.emplace_back();
    }
    link.rows.back().add(e.mean, e.shape);
    link.centre += e.mean;
  }
  link.centre /= static_cast<double>(link.ellipsoids.size());
  for (const LinkEllipsoid& e : link.ellipsoids) {
    link.radius = std::max(link.radius, (e.mean - link.centre).norm() + e.extent);
  }
}

}  // namespace

BodyLinks::BodyLinks(const Robot& robot, const Body& body, const char* owner) {
  const std::vector<BodyEllipsoid> all = body_ellipsoids(robot, body, owner);
  const auto name_of = [&](const BodyEllipsoid& e) -> const std::string& {
    return body.links[static_cast<std::size_t>(e.component)];
  };
  for (auto e = all.rbegin(); e != all.rend(); ++e) {
    const std::string& name = name_of(*e);
    if (std::any_of(links_.begin(), links_.end(), [&](const LinkEllipsoids& link) { return link.name == name; })) {
      continue;
    }
    LinkEllipsoids link{name, e->joint, {}, {}, Eigen::Vector3d::Zero(), 0.0};
    for (const BodyEllipsoid& one : all) {
      if (name_of(one) == name) {
        link.ellipsoids.push_back(in_principal_axes(one));
      }
    }
    surround(link);
    links_.push_back(std::move(link));
  }
}

int BodyLinks::index(const Robot& robot, const std::string& name, const char* owner) const {
  robot.frame_index(name);
  const auto found = std::find_if(links_.begin(), links_.end(), [&](const LinkEllipsoids& link) { return link.name == name; });
  if (found == links_.end()) {
    throw std::invalid_argument(std::string(owner) + ": the body has no ellipsoid on link '" + name + "'");
  }
  return static_cast<int>(found - links_.begin());
}

}  // namespace sidestep

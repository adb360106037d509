#include "sidestep/clearance/clearance_field.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <stdexcept>
#include <string>

#include "clearance_search.hpp"

namespace sidestep {
namespace {

constexpr const char* field_owner = "clearance field";  // Name in error messages.

}  // namespace

ClearanceField::ClearanceField(const Robot& robot, const Body& body, double temperature, double window)
    : temperature_(checked_temperature(temperature, field_owner)), window_(window), links_(body.links) {
  constexpr double most_window = 600.0;  // Largest window, in temperatures: beyond e^−700 the exponential of the sums ends.
  if (!(window >= 1.0 && window <= most_window)) {
    throw std::invalid_argument(std::string(field_owner) + ": window is " + std::to_string(window) +
                                " temperatures, must be from 1 to 600");
  }
  for (const BodyEllipsoid& ellipsoid : body_ellipsoids(robot, body, field_owner)) {
    if (ellipsoid.joint >= 0) {
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(ellipsoid.shape);
      Eigen::Matrix3d axes = eigen.eigenvectors();
      axes.col(0) *= axes.determinant();  // right-handed, as cross products are taken in these axes
      ellipsoids_.push_back({ellipsoid, axes.transpose(), eigen.eigenvalues().cwiseSqrt()});
    }
  }
  if (ellipsoids_.empty()) {
    throw std::invalid_argument(std::string(field_owner) + ": no ellipsoid of the body lies on a link that a joint of robot '" +
                                robot.name() + "' moves");
  }
  for (int first = 0; first < size();) {
    const auto at = [this](int k) -> const Ellipsoid& { return ellipsoids_[static_cast<std::size_t>(k)]; };
    const auto link = [&](int k) -> const std::string& { return body.links[static_cast<std::size_t>(component(k))]; };
    static_assert(Cluster::most == kernels::most_queries);
    static_assert(decltype(Cluster::principal)::ColsAtCompileTime == kernels::principal_numbers);
    Cluster cluster{first, 0, Eigen::Vector3d::Zero(), 0.0, 0.0, decltype(Cluster::principal)::Ones()};
    while (first + cluster.size < size() && cluster.size < Cluster::most && link(first + cluster.size) == link(first)) {
      cluster.centre += at(first + cluster.size++).body.mean;
    }
    cluster.centre /= cluster.size;
    for (int k = first; k < first + cluster.size; ++k) {
      const double distance = (at(k).body.mean - cluster.centre).norm();
      cluster.radius = std::max(cluster.radius, distance + at(k).body.extent);
      cluster.inner_radius = std::max(cluster.inner_radius, distance + at(k).semi_axes.minCoeff());
      const Eigen::Array3d a = at(k).semi_axes;
      float row_of_axes[9];
      auto row = cluster.principal.row(k - first);
      Eigen::Matrix<float, 3, 3, Eigen::RowMajor>::Map(row_of_axes) = at(k).axes_T.cast<float>();
      row << Eigen::Map<const Eigen::Matrix<float, 1, 9>>(row_of_axes), a.square().matrix().transpose().cast<float>(),
          a.matrix().transpose().cast<float>(), static_cast<float>(a.minCoeff() * a.minCoeff() / a.maxCoeff());
    }
    clusters_.push_back(cluster);
    first += cluster.size;
  }
}

void ClearanceField::evaluate(const KinematicState& state, const Obstacles& obstacles, double reach, const Horizon& horizon,
                              ClearanceView out) const noexcept {
  Search search(*this, obstacles.tree(), reach, horizon);
  for (const Cluster& cluster : clusters_) {
    if (search.find(cluster, state.link(ellipsoids_[static_cast<std::size_t>(cluster.first)].body.joint))) {
      for (int k = 0; k < cluster.size; ++k) {
        search.write(k, state, out);
      }
    }
  }
}

CoordinateLabel ClearanceField::label(int k) const {
  return {CoordinateLabel::Kind::obstacle, links_[static_cast<std::size_t>(component(k))]};
}

bool ClearanceField::touches(const KinematicState& state, const Obstacles& obstacles, double depth) const noexcept {
  const PointTree& tree = obstacles.tree();
  for (const Cluster& cluster : clusters_) {
    const KinematicState::Link& link = state.link(ellipsoids_[static_cast<std::size_t>(cluster.first)].body.joint);
    const Eigen::Vector3d centre = link.p_WL + link.R_WL * cluster.centre;
    bool found = false;
    const auto distance = [&](double x, double y, double z, double radius) {
      return (Eigen::Vector3d(x, y, z) - centre).norm() - (cluster.inner_radius + radius - depth);
    };
    const auto measure = [&](const Balls& balls, const Boxes&, int first, int count, PointTree::Bounds& bounds) {
      unsigned near = 0;
      for (int i = 0; i < count && !found; ++i) {
        const int n = first + i;
        const double bound = distance(balls.x[n], balls.y[n], balls.z[n], balls.radius[n]);
        bounds[static_cast<std::size_t>(i)] = static_cast<float>(bound);
        near |= (bound < 0.0 ? 1u : 0u) << i;
      }
      return near;
    };
    const auto look_at = [&](int n) {
      const Eigen::Vector3d x(tree.coordinate(0)[n], tree.coordinate(1)[n], tree.coordinate(2)[n]);
      if (!(distance(x.x(), x.y(), x.z(), tree.radii()[n]) < 0.0)) {
        return;
      }
      const Eigen::Vector3d in_link = link.R_WL.transpose() * (x - link.p_WL);
      for (int k = cluster.first; k < cluster.first + cluster.size; ++k) {
        const Ellipsoid& ellipsoid = ellipsoids_[static_cast<std::size_t>(k)];
        const double within = ellipsoid.semi_axes.minCoeff() + tree.radii()[n] - depth;
        found = found || (within > 0.0 && (in_link - ellipsoid.body.mean).squaredNorm() < within * within);
      }
    };
    tree.visit(measure, [&](int first, unsigned leaves) {
      for (; leaves != 0; leaves &= leaves - 1) {
        const int leaf = first + std::countr_zero(leaves), begin = leaf * PointTree::leaf_size;
        for (int n = begin; n < begin + tree.count(leaf) && !found; ++n) {
          look_at(n);
        }
      }
    });
    if (found) {
      return true;
    }
  }
  return false;
}

}  // namespace sidestep

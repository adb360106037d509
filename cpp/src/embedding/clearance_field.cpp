#include "sidestep/embedding/clearance_field.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "../settings.hpp"
#include "kernels/clearance_kernel.hpp"
#include "sidestep/embedding/boltzmann_mean.hpp"
#include "sidestep/kinematics/instruction_set.hpp"

namespace sidestep {
namespace {

kernels::ClearanceKernel clearance_kernel() noexcept {
#if defined(SIDESTEP_X86_KERNELS)
  switch (instruction_set()) {
    case InstructionSet::avx512: return kernels::clearance_kernel_avx512();
    case InstructionSet::avx2: return kernels::clearance_kernel_avx2();
    case InstructionSet::baseline: break;
  }
#endif
  return kernels::clearance_kernel_baseline();
}

void copy(const Eigen::Vector3d& from, double* to) noexcept { Eigen::Vector3d::Map(to) = from; }

kernels::LinkMotion motion_of(const KinematicState::Link& link) noexcept {
  kernels::LinkMotion motion;
  Eigen::Matrix3d::Map(motion.rotation) = link.R_WL;
  copy(link.velocity.angular, motion.angular);
  copy(link.velocity.linear, motion.linear);
  copy(link.bias.angular, motion.bias_angular);
  copy(link.bias.linear, motion.bias_linear);
  motion.turning = link.velocity.angular.norm();
  Eigen::Matrix3f::Map(motion.to_link) = link.R_WL.cast<float>();  // the columns of a rotation are the rows of its inverse
  return motion;
}

kernels::Points points_of(const PointTree& tree) noexcept {
  kernels::Points points{{tree.coordinate(0), tree.coordinate(1), tree.coordinate(2)}, tree.radii(), {}, {}, {}};
  if (tree.size() > 0) {
    points.leaf_balls = tree.leaf_balls();
    points.leaf_boxes = tree.leaf_boxes();
  }
  for (int axis = 0; axis < 3 && tree.moves(); ++axis) {
    points.velocity[axis] = tree.velocity(axis);
  }
  return points;
}

static_assert(PointTree::leaf_size == kernels::most_points);

void forget(kernels::Query& query) noexcept {
  query.reference = query.ahead = infinity;
  query.nearest = query.minded = 0;
  query.ready = query.begun = false;
}

/// The means of a query's points, with wrenches about the world origin.
class Means {
 public:
  Means(const kernels::Query& query, const Eigen::Vector3d& centre) noexcept : query_(query), centre_(centre) {
    for (int i = 0; i < kernels::sums; ++i) {
      sums_[i] = Eigen::Map<const Eigen::Matrix<double, kernels::most_lanes, 1>>(query.lane_sums[i]).sum();
    }
  }

  ClearanceSample nearest() const noexcept {
    const double* s = sums_;
    ClearanceSample mean = BoltzmannMean::Sums{s[0], s[1], s[2], s[3], s[4], s[5]}.mean();
    mean.gradient = wrench((gradient(12) - mean.value * gradient(6)) / s[0]);
    mean.value += query_.reference;
    return mean;
  }

  ClearanceSample approach() const noexcept {
    const double* s = sums_ + kernels::approach;
    return {s[1] / s[0], s[2] / s[0], s[3] / s[0], wrench(gradient(kernels::approach + 4) / s[0])};
  }

 private:
  using Vector6 = Eigen::Matrix<double, 6, 1>;

  Vector6 gradient(int first) const noexcept { return Vector6::Map(sums_ + first); }
  WrenchPair wrench(const Vector6& gradient) const noexcept {
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> axes(query_.axes);
    const Eigen::Vector3d force = -(axes.transpose() * gradient.head<3>());
    return {{centre_.cross(force) - axes.transpose() * gradient.tail<3>(), force}, {}};
  }

  const kernels::Query& query_;
  Eigen::Vector3d centre_;
  double sums_[kernels::sums];
};

}  // namespace

ClearanceField::ClearanceField(const Robot& robot, const Body& body, double temperature)
    : temperature_(temperature) {
  constexpr const char* owner = "clearance field";
  if (!(temperature > 0.0) || temperature == infinity) {
    throw std::invalid_argument(std::string(owner) + ": temperature is " + std::to_string(temperature) +
                                " m, must be positive and finite");
  }
  for (const BodyEllipsoid& ellipsoid : body_ellipsoids(robot, body, owner)) {
    if (ellipsoid.joint >= 0) {
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(ellipsoid.shape);
      Eigen::Matrix3d axes = eigen.eigenvectors();
      axes.col(0) *= axes.determinant();  // right-handed, as cross products are taken in these axes
      ellipsoids_.push_back({ellipsoid, axes.transpose(), eigen.eigenvalues().cwiseSqrt()});
    }
  }
  if (ellipsoids_.empty()) {
    throw std::invalid_argument(std::string(owner) + ": no ellipsoid of the body lies on a link that a joint of robot '" +
                                robot.name() + "' moves");
  }
  for (int first = 0; first < size();) {
    const auto at = [this](int k) -> const Ellipsoid& { return ellipsoids_[static_cast<std::size_t>(k)]; };
    static_assert(Cluster::most == kernels::most_queries);
    Cluster cluster{first, 0, Eigen::Vector3d::Zero(), 0.0, 0.0, decltype(Cluster::shapes)::Zero()};
    while (first + cluster.size < size() && cluster.size < Cluster::most &&
           at(first + cluster.size).body.joint == at(first).body.joint) {
      cluster.centre += at(first + cluster.size++).body.mean;
    }
    cluster.centre /= cluster.size;
    for (int k = first; k < first + cluster.size; ++k) {
      const double distance = (at(k).body.mean - cluster.centre).norm();
      cluster.radius = std::max(cluster.radius, distance + at(k).body.extent);
      cluster.inner_radius = std::max(cluster.inner_radius, distance + at(k).semi_axes.minCoeff());
      const Eigen::Matrix3d& S = at(k).body.shape;
      const double distinct[] = {S(0, 0), S(0, 1), S(0, 2), S(1, 1), S(1, 2), S(2, 2)};
      for (int i = 0; i < 6; ++i) {
        cluster.shapes(k - first, i) = static_cast<float>(distinct[i]);
      }
    }
    clusters_.push_back(cluster);
    first += cluster.size;
  }
}

void ClearanceField::evaluate(const KinematicState& state, const Obstacles& obstacles, double reach,
                              const Horizon& horizon, ClearanceView out) const noexcept {
  const PointTree& tree = obstacles.tree();
  const kernels::Points points = points_of(tree);
  const kernels::ClearanceKernel kernel = clearance_kernel();
  kernels::QueryGroup group;
  group.inverse_T = 1.0 / temperature_;
  group.reach = reach;
  group.reach_ahead = horizon.distance;
  group.window = window * temperature_;
  group.window_ahead = window_ahead * temperature_;
  group.horizon = horizon.time;
  group.fastest = tree.fastest();
  for (const Cluster& cluster : clusters_) {
    const int joint = ellipsoids_[static_cast<std::size_t>(cluster.first)].body.joint;
    const KinematicState::Link& link = state.link(joint);
    const Eigen::Vector3d centre = link.p_WL + link.R_WL * cluster.centre;
    kernels::MovingBall ball_around;
    copy(centre, ball_around.centre);
    ball_around.radius = cluster.radius;
    copy(link.velocity.linear, ball_around.linear);
    copy(link.velocity.angular, ball_around.angular);
    ball_around.turning = link.velocity.angular.norm();
    ball_around.horizon = horizon.time;
    ball_around.fastest = tree.fastest();
    const auto measure = [&](const Balls& balls, int first, int count, PointTree::Bounds& bounds) {
      kernel.measure(ball_around, balls, first, count, bounds.values.data(), bounds.others.data());
    };
    double near = reach, ahead = horizon.distance;  // the largest of the group
    double missed = infinity, missed_ahead = infinity;
    const auto matters = [&](double bound, double after) {
      if (bound < near || after < ahead) {
        return true;
      }
      missed = std::min(missed, bound);
      missed_ahead = std::min(missed_ahead, after);
      return false;
    };
    bool placed = false;
    kernels::LinkMotion motion;
    const auto limit = [&group](int k, double to, double to_ahead) {
      group.near[k] = group.near_leaf[k] = static_cast<float>(to);
      group.ahead[k] = group.ahead_leaf[k] = static_cast<float>(to_ahead);
      group.missed[k] = group.missed_ahead[k] = std::numeric_limits<float>::infinity();
    };
    const auto place = [&] {
      copy(centre, group.origin);
      motion = motion_of(link);
      group.link = &motion;
      group.shapes = cluster.shapes.data();
      group.size = cluster.size;
      for (int k = 0; k < cluster.size; ++k) {
        const Ellipsoid& ellipsoid = ellipsoids_[static_cast<std::size_t>(cluster.first + k)];
        const Eigen::Vector3d p = link.p_WL + link.R_WL * ellipsoid.body.mean;
        for (int axis = 0; axis < 3; ++axis) {
          group.centre[axis][k] = p[axis];
          group.offset[axis][k] = static_cast<float>(p[axis] - centre[axis]);
        }
        group.extent[k] = static_cast<float>(ellipsoid.body.extent);
        group.axes_T[k] = ellipsoid.axes_T.data();
        group.semi_axes[k] = ellipsoid.semi_axes.data();
        limit(k, reach, horizon.distance);
        group.near[k] += static_cast<float>(group.window);
        group.ahead[k] += static_cast<float>(group.window_ahead);
        kernels::Query& query = group.queries[k];
        query.near = query.approached = false;
        forget(query);
      }
      for (int k = cluster.size; k < kernels::most_queries; ++k) {  // registers are filled up
        group.offset[0][k] = group.offset[1][k] = group.offset[2][k] = group.extent[k] = 0.0f;
        limit(k, -infinity, -infinity);
      }
      placed = true;
    };
    const auto visit = [&] {
      tree.visit(measure, matters, [&](int leaf, int count) {
        if (!placed) {
          place();
        }
        if (kernel.collect(group, points, leaf, count)) {
          near = *std::max_element(group.near_leaf, group.near_leaf + cluster.size);
          ahead = *std::max_element(group.ahead_leaf, group.ahead_leaf + cluster.size);
        }
      });
    };
    visit();
    if (!placed) {
      continue;
    }
    // What was left out before anything within reach was known may still weigh beside it.
    near = ahead = -infinity;
    for (int k = 0; k < cluster.size; ++k) {
      kernels::Query& query = group.queries[k];
      const double to = query.near ? group.near[k] : -infinity, to_ahead = query.approached ? group.ahead[k] : -infinity;
      if (std::min<double>(missed, group.missed[k]) < to || std::min<double>(missed_ahead, group.missed_ahead[k]) < to_ahead) {
        limit(k, to, to_ahead);
        forget(query);
        near = std::max(near, to);
        ahead = std::max(ahead, to_ahead);
      } else {
        limit(k, -infinity, -infinity);
      }
    }
    if (std::max(near, ahead) > -infinity) {
      visit();
    }
    for (int k = 0; k < cluster.size; ++k) {
      const kernels::Query& query = group.queries[k];
      if (!query.near && !query.approached) {
        continue;
      }
      kernel.sum(group, k, points);
      if (!(std::min(query.reference, query.ahead) < infinity)) {
        continue;
      }
      const Means means(query, {group.centre[0][k], group.centre[1][k], group.centre[2][k]});
      const Eigen::Index at = cluster.first + k;
      const ClearanceSample approach = means.approach();
      const ClearanceSample nearest = query.reference < infinity ? means.nearest() : approach;
      const bool within = query.reference < infinity && nearest.value < reach;
      if (within || query.ahead < horizon.distance) {
        write(within ? nearest : approach, state, joint, -1, at, out);
        write(approach, state, joint, -1, at, out.approach);
        out.nearest[at] = tree.order()[static_cast<std::size_t>(within ? query.nearest : query.minded)];
      }
    }
  }
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
    const auto measure = [&](const Balls& balls, int first, int count, PointTree::Bounds& bounds) {
      for (int i = 0; i < count; ++i) {
        const int n = first + i;
        bounds.values[static_cast<std::size_t>(i)] = distance(balls.x[n], balls.y[n], balls.z[n], balls.radius[n]);
      }
    };
    const auto near = [&](double value, double) { return !found && value < 0.0; };
    tree.visit(measure, near, [&](int leaf, int count) {
      const int first = leaf * PointTree::leaf_size;
      for (int n = first; n < first + count && !found; ++n) {
        const Eigen::Vector3d x(tree.coordinate(0)[n], tree.coordinate(1)[n], tree.coordinate(2)[n]);
        if (!(distance(x.x(), x.y(), x.z(), tree.radii()[n]) < 0.0)) {
          continue;
        }
        const Eigen::Vector3d in_link = link.R_WL.transpose() * (x - link.p_WL);
        for (int k = cluster.first; k < cluster.first + cluster.size; ++k) {
          const Ellipsoid& ellipsoid = ellipsoids_[static_cast<std::size_t>(k)];
          const double within = ellipsoid.semi_axes.minCoeff() + tree.radii()[n] - depth;
          found = found || (within > 0.0 && (in_link - ellipsoid.body.mean).squaredNorm() < within * within);
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

#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <limits>

#include "../math/kernels/in_use.hpp"
#include "../math/settings.hpp"
#include "clearance_means.hpp"
#include "kernels/clearance_kernel.hpp"
#include "sidestep/clearance/clearance_field.hpp"

namespace sidestep {
/// Looks for the points that weigh in the means of one cluster's ellipsoids after another.
class ClearanceField::Search {
 public:
  Search(const ClearanceField& field, const PointTree& tree, double reach, const Horizon& horizon) noexcept
      : field_(field), tree_(tree), points_(points_of(tree)), kernel_(clearance_kernel()), reach_(reach), horizon_(horizon) {
    group_.inverse_T = 1.0 / field.temperature_;
    group_.reach = reach;
    group_.reach_ahead = horizon.distance;
    group_.window = field.window_ * field.temperature_;
    group_.window_ahead = window_ahead * field.temperature_;
    group_.horizon = horizon.time;
    group_.fastest = tree.fastest();
  }

  /// Whether any may matter.
  bool find(const Cluster& cluster, const KinematicState::Link& link) noexcept {
    cluster_ = &cluster;
    link_ = &link;
    is_placed_ = false;
    surround();
    // Leaves beyond the reach may weigh beside what is found within it: they are put off, as far as there is space.
    kernels::Limits within = limits(reach_, horizon_.distance);
    const kernels::Limits beyond = limits(reach_ + group_.window, horizon_.distance + group_.window_ahead);
    int num_put_off = 0;
    visit(within, beyond, [&](int leaf, bool is_within) {
      if (is_within && take(leaf, beyond)) {
        within = limits(std::min<double>(reach_, largest(group_.near_leaf)),
                        std::min<double>(horizon_.distance, largest(group_.ahead_leaf)));
      } else if (!is_within) {
        if (num_put_off < most_put_off) {
          put_off_[static_cast<std::size_t>(num_put_off)] = leaf;
        }
        ++num_put_off;
      }
    });
    if (!is_waiting() && !is_placed_) {
      return false;
    }
    const bool is_full = num_put_off > most_put_off;
    int next = 0;
    while (next < num_put_off && !is_full && is_waiting() && !take(put_off_[static_cast<std::size_t>(next++)], beyond)) {
    }
    collect();
    const bool goes_beyond = is_known_beyond(reach_, horizon_.distance);
    while (goes_beyond && !is_full && next < num_put_off) {
      take(put_off_[static_cast<std::size_t>(next++)], beyond);
    }
    collect();
    // So may what was missed in leaves that were looked at before; and sums that were begun, for want of space, may hold
    // what lies too far above what was found later.
    bool is_missing = goes_beyond && is_full;
    for (int pass = 0; pass < most_passes; ++pass, is_missing = false) {
      kernels::Limits again = limits(-infinity, -infinity);
      for (int k = 0; k < cluster.size; ++k) {
        kernels::Query& query = group_.queries[k];
        if (query.begun) {
          kernel_.sum(group_, k, points_);
        }
        const double to = query.near ? group_.near[k] : -infinity, to_ahead = query.approached ? group_.ahead[k] : -infinity;
        if (is_missing || query.stale || group_.missed[k] < to || group_.missed_ahead[k] < to_ahead) {
          limit(k, to, to_ahead);
          restart(query);
          again = limits(std::max<double>(again.near, to), std::max<double>(again.ahead, to_ahead));
        } else {  // is asked no more
          limit_leaves(k, -infinity, -infinity);
        }
      }
      if (!(std::max(again.near, again.ahead) > -infinity)) {
        break;
      }
      visit(again, again, [&](int leaf, bool) { take(leaf, again); });
      collect();
    }
    return true;
  }

  /// Writes the means of ellipsoid k of the cluster.
  void write(int k, const KinematicState& state, ClearanceView& out) noexcept {
    const kernels::Query& query = group_.queries[k];
    if (!query.near && !query.approached) {
      return;
    }
    kernel_.sum(group_, k, points_);
    if (!(std::min(query.reference, query.ahead) < infinity)) {
      return;
    }
    const ClearanceMeans means(query, {group_.centre[0][k], group_.centre[1][k], group_.centre[2][k]}, group_.inverse_T);
    const Eigen::Index at = cluster_->first + k;
    const ClearanceSample approach = means.approach();
    const ClearanceSample nearest = query.reference < infinity ? means.nearest() : approach;
    const bool within = query.reference < infinity && nearest.value < reach_;
    if (within || query.ahead < horizon_.distance) {
      sidestep::write(within ? nearest : approach, approach, state, ellipsoid(k).body.joint, at, out);
      out.least[at] = query.reference;
      out.nearest[at] = tree_.order()[static_cast<std::size_t>(within ? query.nearest : query.minded)];
    }
  }

 private:
  static constexpr int most_put_off = 1024, most_passes = 3;  // Most leaves that are put off, and most passes of the search.
  static_assert(PointTree::leaf_size == kernels::most_points);

  static kernels::ClearanceKernel clearance_kernel() noexcept { return SIDESTEP_KERNEL_IN_USE(kernels::clearance_kernel)(); }

  static void copy_to(const Eigen::Vector3d& from, double* to) noexcept { Eigen::Vector3d::Map(to) = from; }

  static kernels::LinkMotion motion_of(const KinematicState::Link& link) noexcept {
    kernels::LinkMotion motion;
    Eigen::Matrix3d::Map(motion.rotation) = link.R_WL;
    copy_to(link.velocity.angular, motion.angular);
    copy_to(link.velocity.linear, motion.linear);
    copy_to(link.bias.angular, motion.bias_angular);
    copy_to(link.bias.linear, motion.bias_linear);
    motion.turning = link.velocity.angular.norm();
    // the columns of a rotation are the rows of its inverse
    Eigen::Matrix3f::Map(motion.to_link) = link.R_WL.cast<float>();
    return motion;
  }

  static kernels::Points points_of(const PointTree& tree) noexcept {
    kernels::Points points{
        {tree.coordinate(0), tree.coordinate(1), tree.coordinate(2)}, tree.radii(), tree.common_radius(), {}, {}, {}};
    if (tree.size() > 0) {
      points.leaf_balls = tree.leaf_balls();
      points.leaf_boxes = tree.leaf_boxes();
    }
    for (int axis = 0; axis < 3 && tree.moves(); ++axis) {
      points.velocity[axis] = tree.velocity(axis);
    }
    return points;
  }

  /// Begins again, with what is known of the smallest.
  static void restart(kernels::Query& query) noexcept {
    query.begun = query.stale = false;
    query.candidates.size = 0;
  }

  static void reset(kernels::Query& query) noexcept {
    query.reference = query.ahead = infinity;
    query.nearest = query.minded = 0;
    query.near = query.approached = false;
    restart(query);
  }

  const Ellipsoid& ellipsoid(int k) const noexcept { return field_.ellipsoids_[static_cast<std::size_t>(cluster_->first + k)]; }

  void surround() noexcept {
    const Eigen::Vector3d centre = link_->p_WL + link_->R_WL * cluster_->centre;
    const Eigen::Vector3d& angular = link_->velocity.angular;
    copy_to(centre, ball_.centre);
    ball_.radius = static_cast<float>(cluster_->radius);
    Eigen::Vector3f::Map(ball_.velocity) = (link_->velocity.linear + angular.cross(centre)).cast<float>();
    Eigen::Vector3f::Map(ball_.angular) = angular.cast<float>();
    ball_.turning = static_cast<float>(angular.norm());
    ball_.horizon = static_cast<float>(horizon_.time);
    ball_.fastest = static_cast<float>(tree_.fastest());
  }

  static kernels::Limits limits(double near, double ahead) noexcept {
    return {static_cast<float>(near), static_cast<float>(ahead)};
  }
  void limit(int k, double to, double to_ahead) noexcept {
    group_.near[k] = static_cast<float>(to);
    group_.ahead[k] = static_cast<float>(to_ahead);
    limit_leaves(k, to, to_ahead);
    group_.missed[k] = group_.missed_ahead[k] = std::numeric_limits<float>::infinity();
  }
  void limit_leaves(int k, double to, double to_ahead) noexcept {
    group_.near_leaf[k] = static_cast<float>(to);
    group_.ahead_leaf[k] = static_cast<float>(to_ahead);
  }

  void place() noexcept {
    copy_to(Eigen::Vector3d::Map(ball_.centre), group_.origin);
    motion_ = motion_of(*link_);
    group_.link = &motion_;
    group_.principal = cluster_->principal.data();
    group_.size = cluster_->size;
    for (int k = 0; k < cluster_->size; ++k) {
      const Eigen::Vector3d p = link_->p_WL + link_->R_WL * ellipsoid(k).body.mean;
      for (int axis = 0; axis < 3; ++axis) {
        group_.centre[axis][k] = p[axis];
        group_.offset[axis][k] = static_cast<float>(p[axis] - ball_.centre[axis]);
      }
      group_.extent[k] = static_cast<float>(ellipsoid(k).body.extent);
      group_.axes_T[k] = ellipsoid(k).axes_T.data();
      group_.semi_axes[k] = ellipsoid(k).semi_axes.data();
      limit(k, reach_, horizon_.distance);
      group_.near[k] += static_cast<float>(group_.window);
      group_.ahead[k] += static_cast<float>(group_.window_ahead);
      reset(group_.queries[k]);
    }
    for (int k = cluster_->size; k < kernels::most_queries; ++k) {  // registers are filled up
      group_.offset[0][k] = group_.offset[1][k] = group_.offset[2][k] = group_.extent[k] = 0.0f;
    }
    kernel_.begin(group_);
    is_placed_ = true;
  }

  double largest(const float* limits) const noexcept { return *std::max_element(limits, limits + cluster_->size); }
  /// Whether a limit below which something is known is beyond these.
  bool is_known_beyond(double near, double ahead) const noexcept {
    for (int k = 0; k < cluster_->size; ++k) {
      const kernels::Query& query = group_.queries[k];
      if ((query.near && group_.near[k] > near) || (query.approached && group_.ahead[k] > ahead)) {
        return true;
      }
    }
    return false;
  }

  /// Calls leaf(number, whether it is within) for the leaves that may be below `beyond`.
  template <class Leaf>
  void visit(const kernels::Limits& within, const kernels::Limits& beyond, Leaf&& leaf) const noexcept {
    const auto measure = [&](const Balls& balls, const Boxes& boxes, int first, int count, PointTree::Bounds& bounds) {
      return kernel_.measure(ball_, balls, boxes, first, count, within, beyond, bounds.data());
    };
    tree_.visit(measure, [&](int first, unsigned bits) {
      for (unsigned left = bits & 0xffffu; left != 0; left &= left - 1) {
        const int i = std::countr_zero(left);
        leaf(first + i, (bits >> (i + 16) & 1) != 0);
      }
    });
  }

  /// Leaves are looked at many at a time; returns whether they were. Of those wider than the cluster and what is within
  /// reach of it only points are taken that may be below the limits.
  bool take(int leaf, const kernels::Limits& limits) noexcept {
    kernels::Leaves& leaves = group_.leaves;
    kernels::LoosePoints& loose = group_.loose;
    const int count = tree_.count(leaf), first = leaf * PointTree::leaf_size;
    if (points_.leaf_balls.radius[leaf] > cluster_->radius + std::max(reach_, 0.0)) {
      unsigned left = kernel_.measure_points(ball_, points_, first, count, limits, limits) & 0xffffu;
      for (; left != 0; left &= left - 1) {
        const int n = first + std::countr_zero(left), to = loose.num++;
        loose.point[to] = n;
        loose.radius[to] = static_cast<float>(points_.radius[n]);
        for (int axis = 0; axis < 3; ++axis) {
          loose.position[axis][to] = static_cast<float>(points_.position[axis][n] - ball_.centre[axis]);
          loose.own[axis][to] = points_.velocity[0] != nullptr ? static_cast<float>(points_.velocity[axis][n]) : 0.0f;
        }
      }
    } else {
      leaves.leaf[leaves.num] = leaf;
      leaves.count[leaves.num++] = count;
    }
    if (leaves.num < kernels::most_leaves && loose.num <= kernels::most_loose - PointTree::leaf_size) {
      return false;
    }
    collect();
    return true;
  }

  /// Whether anything was taken that has not been looked at.
  bool is_waiting() const noexcept { return group_.leaves.num > 0 || group_.loose.num > 0; }

  void collect() noexcept {
    if (!is_waiting()) {
      return;
    }
    if (!is_placed_) {
      place();
    }
    kernel_.collect(group_, points_);
    group_.leaves.num = group_.loose.num = 0;
  }

  const ClearanceField& field_;
  const PointTree& tree_;
  kernels::Points points_;
  kernels::ClearanceKernel kernel_;
  double reach_;
  Horizon horizon_;
  const Cluster* cluster_ = nullptr;
  const KinematicState::Link* link_ = nullptr;
  kernels::MovingBall ball_;
  kernels::LinkMotion motion_;
  bool is_placed_ = false;
  kernels::QueryGroup group_;
  std::array<int, most_put_off> put_off_;
};

}  // namespace sidestep

// Edges of searches, and what proves them free.
#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "sidestep/clearance/clearance_query.hpp"

namespace sidestep {
namespace {

// Distance above a margin below which a clearance is exact [m]; beyond, a lower bound proves an edge well enough.
constexpr double exact_within = 0.015;

/// How far an item comes towards what it keeps off, its margin included, within a share of an edge around a place.
struct Motion {
  double farthest;   // Largest motion of any point on the whole edge [m].
  double slope;      // Slope of the margin, per motion.
  double speed;      // Speed of the fastest point at the place [m].
  double curvature;  // Curvature of its path [m].

  double distance(double share) const noexcept {
    return share * (slope * farthest + std::min(farthest, speed + 0.5 * share * curvature));
  }
  /// Within which the distance is no more than this.
  double share(double distance) const noexcept {
    const double rate = slope * farthest + speed;
    return std::max(distance / ((1.0 + slope) * farthest),
                    2.0 * distance / (rate + std::sqrt(rate * rate + 2.0 * curvature * distance)));
  }
};

}  // namespace

void ClearanceQuery::move(ConstVectorRef velocity, Workspace& w) const noexcept {
  for (std::size_t i = 0; i < rotations_.size(); ++i) {
    const Joint& joint = robot().joints()[i];
    const Workspace::Pose& parent = pose(w, joint.parent);
    Workspace::Pose& child = w.poses_[i];
    const Eigen::Vector3d rate = joint.multiplier * velocity[joint.coordinate] * (child.R * joint.axis);
    child.angular = parent.angular;
    child.linear = parent.linear + parent.angular.cross(child.p - parent.p);
    (joint.type == JointType::revolute ? child.angular : child.linear) += rate;
  }
}

double ClearanceQuery::speed(const ClearanceItem& item, Workspace& w) const noexcept {
  if (item.source == ClearanceItem::Source::load) {
    const GravityTorqueLimit& gravity_torque = *items_->gravity_torque();
    static_cast<void>(gravity_torque.at(gravity_torque.loads()[static_cast<std::size_t>(item.index)], state(w), w.gradient_));
    return std::abs(w.gradient_.dot(w.difference_));
  }
  if (item.source == ClearanceItem::Source::table) {
    return item.reach.dot(w.lengths_);
  }
  const Workspace::Pose& base = pose(w, item.base);
  double sum = 0.0;
  for (const int n : {item.link, item.other}) {
    if (n < 0 || items_->links()[n].joint == item.base) {
      continue;
    }
    const LinkEllipsoids& link = items_->links()[n];
    const Workspace::Pose& X = pose(w, link.joint);
    const Eigen::Vector3d& centre = w.centres_[static_cast<std::size_t>(n)];
    const Eigen::Vector3d linear = X.linear + X.angular.cross(centre - X.p) - base.linear - base.angular.cross(centre - base.p);
    sum += linear.norm() + (X.angular - base.angular).norm() * link.radius;
  }
  return sum;
}

void ClearanceQuery::bound_motions(ConstVectorRef displacement, Workspace& w) const noexcept {
  const Eigen::Index nv = displacement.size();
  w.difference_ = displacement;
  w.lengths_ = displacement.cwiseAbs();
  w.motions_.noalias() = items_->reaches() * w.lengths_;
  for (Eigen::Index i = 0, k = 0; i < nv; k += nv, ++i) {
    w.products_.segment(k, nv) = w.lengths_[i] * w.lengths_;
  }
  w.curvatures_.noalias() = items_->bends() * w.products_;
}

double ClearanceQuery::motion(int item, ConstVectorRef q, ConstVectorRef displacement, Workspace& w) const noexcept {
  place(q, w);
  bound_motions(displacement, w);
  move(displacement, w);
  const Motion moved{w.motions_[item], 0.0, speed((*items_)[item], w), w.curvatures_[item]};
  return moved.distance(1.0);
}

double ClearanceQuery::margin_at(int item, ConstVectorRef q, const Margins& margins, double& slope) const noexcept {
  double lowered = 0.0;
  for (const Margins::End& end : margins.ends) {
    const double deficit = end.deficits[item];
    if (deficit > 0.0) {
      slope = std::max(slope, deficit / margins.fade);
      const double away = (*items_)[item].reach.dot((q - end.q).cwiseAbs());
      lowered = std::max(lowered, deficit * std::max(0.0, 1.0 - away / margins.fade));
    }
  }
  return margin(item, margins) - lowered;
}

bool ClearanceQuery::free(ConstVectorRef q, const Obstacles& obstacles, const Margins& margins, Workspace& w) const noexcept {
  if (!q.allFinite()) {
    return false;
  }
  w.field_.follow(obstacles);
  place(q, w);
  double slope = 0.0;
  for (int k = 0; k < num_items(); ++k) {
    // In the order of the items, but the one that was in the way last before all.
    const int i = k == 0 ? w.last_ : (k <= w.last_ ? k - 1 : k);
    const double margin = margin_at(i, q, margins, slope);
    if (measure((*items_)[i], obstacles, {margin, margin, margin}, w).clearance < margin) {
      w.last_ = i;
      return false;
    }
  }
  return true;
}

bool ClearanceQuery::edge_free(ConstVectorRef a, ConstVectorRef b, const Obstacles& obstacles, const Margins& margins,
                               Workspace& w) const noexcept {
  w.difference_ = b - a;
  if (!a.allFinite() || !w.difference_.allFinite()) {
    return false;
  }
  w.field_.follow(obstacles);
  const std::size_t words = this->words();
  std::fill_n(w.open_.begin(), words, ~std::uint64_t{0});
  w.open_[words - 1] >>= 64 * words - static_cast<std::size_t>(num_items());
  bound_motions(w.difference_, w);
  // Breadth first: what is in the way is found early.
  w.intervals_.clear();
  w.intervals_.push_back({0.5, 0.5});
  for (std::size_t n = 0; n < w.intervals_.size(); ++n) {
    const Workspace::Interval at = w.intervals_[n];
    w.q_ = a + at.middle * w.difference_;
    place(w.q_, w);
    move(w.difference_, w);
    std::uint64_t* const open = w.open_.data() + n * words;
    double decided = at.half;  // Half width of the decided interval, around the middle.
    for (std::size_t word = 0; word < words; ++word) {
      for (std::uint64_t left = std::exchange(open[word], 0); left != 0; left &= left - 1) {
        const int bit = std::countr_zero(left);
        const int i = static_cast<int>(word) * 64 + bit;
        const ClearanceItem& item = (*items_)[i];
        double slope = 0.0;
        const double least = margin_at(i, w.q_, margins, slope);
        const Motion moved{w.motions_[i], slope, speed(item, w), w.curvatures_[i]};
        const double slack = std::min(margins.slack, 0.5 * item.most_margin);
        const double enough = least - slack + moved.distance(at.half);
        const double clearance = measure(item, obstacles, {std::max(least, enough), least + exact_within, least}, w).clearance;
        if (clearance < least) {
          w.last_ = i;
          return false;
        }
        if (clearance < enough) {
          open[word] |= std::uint64_t{1} << bit;
          decided = std::min(decided, moved.share(clearance - least + slack));
        }
      }
    }
    if (decided < at.half) {
      if (w.intervals_.size() + 2 > Workspace::most_intervals) {
        return false;
      }
      const double half = 0.5 * (at.half - decided), away = decided + half;
      for (const double middle : {at.middle - away, at.middle + away}) {
        std::copy_n(open, words, w.open_.data() + w.intervals_.size() * words);
        w.intervals_.push_back({middle, half});
      }
    }
  }
  return true;
}

bool ClearanceQuery::path_free(const std::vector<Eigen::VectorXd>& path, const Obstacles& obstacles, const Margins& margins,
                               Workspace& w) const noexcept {
  for (std::size_t k = 1; k < path.size(); ++k) {
    if (!edge_free(path[k - 1], path[k], obstacles, margins, w)) {
      return false;
    }
  }
  return true;
}

}  // namespace sidestep

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "../math/settings.hpp"
#include "sidestep/robot/kinematic_state.hpp"
#include "sidestep/arm/attachment.hpp"

namespace sidestep {
namespace {

constexpr int most_cuts = 40;         // Most cuts of one ellipsoid.
constexpr double tolerance = 5e-4;    // Accuracy of the distance kept [m].
constexpr int halvings = 60;          // Halvings of the interval of t.
constexpr int num_directions = 2000;  // Number of directions in which supports are compared.

/// Of an ellipsoid at a point, pointing to it: along the shortest way where the point is outside.
Eigen::Vector3d normal_at(const Eigen::Vector3d& e, const Eigen::Matrix3d& axes, const Eigen::Vector3d& squares) {
  const Eigen::Vector3d local = axes.transpose() * e;
  const auto w = [&](double t) -> Eigen::Vector3d { return local.cwiseQuotient((squares.array() + t).matrix()); };
  const auto square = [&](double t) { return w(t).cwiseAbs2().dot(squares); };
  double t = 0.0;
  if (square(0.0) > 1.0) {  // outside: the root of wᵀ S w = 1, which falls with t
    double above = local.norm() * std::sqrt(squares.maxCoeff());
    for (int k = 0; k < halvings; ++k) {
      const double middle = 0.5 * (t + above);
      (square(middle) > 1.0 ? t : above) = middle;
    }
  }
  return (axes * w(t)).normalized();
}

struct Cut {
  double gap = infinity;  // Distance between a plane and the point's ball [m].
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double offset = 0.0;  // Offset of the plane that the ellipsoid must stay behind [m].
  Eigen::Index point = -1;
};

Cut worst(const Eigen::Vector3d& centre, const Eigen::Matrix3d& A, const Obstacles& obstacles,
          const std::vector<Eigen::Index>& points, double distance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(A * A.transpose());
  const Eigen::Vector3d squares = solver.eigenvalues().cwiseMax(0.0);
  const double extent = std::sqrt(squares[2]);
  Cut cut;
  for (const Eigen::Index k : points) {
    const Eigen::Vector3d e = obstacles.points().col(k) - centre;
    const double r = obstacles.radii()[k];
    if (e.norm() - extent - r > distance) {
      continue;
    }
    const Eigen::Vector3d n = normal_at(e, solver.eigenvectors(), squares);
    const double gap = n.dot(e) - (A.transpose() * n).norm() - r;
    if (!(gap >= cut.gap)) {  // also where the point is the centre itself
      cut = {gap, n, n.dot(obstacles.points().col(k)) - r - distance, k};
    }
  }
  return cut;
}

/// How far a support function of one is from that of the other at most [m].
double largest_difference(const Eigen::Vector3d& c, const Eigen::Matrix3d& A, const Eigen::Vector3d& smaller_c,
                          const Eigen::Matrix3d& smaller_A) {
  double largest = 0.0;
  for (int k = 0; k < num_directions; ++k) {
    const double z = 1.0 - (2.0 * k + 1.0) / num_directions, angle = k * std::numbers::pi * (3.0 - std::sqrt(5.0));
    const double across = std::sqrt(1.0 - z * z);
    const Eigen::Vector3d n(across * std::cos(angle), across * std::sin(angle), z);
    largest = std::max(largest, n.dot(c - smaller_c) + (A.transpose() * n).norm() - (smaller_A.transpose() * n).norm());
  }
  return largest;
}

[[noreturn]] void cannot_rest(const Attachment& object, const std::string& why) {
  throw std::invalid_argument("attach '" + object.name + "': " + why);
}

std::string millimetres(double length) { return std::to_string(static_cast<int>(std::ceil(1000.0 * length - 1e-9))) + " mm"; }

std::string quoted_list(const Obstacles& obstacles) {
  std::string names;
  for (const auto& [name, count] : obstacles.groups()) {
    if (!name.empty()) {
      names += (names.empty() ? "'" : ", '") + name + "'";
    }
  }
  return names.empty() ? "none with a name" : names;
}

std::vector<Eigen::Index> points_of(const Attachment& object, const Obstacles& obstacles) {
  const auto is_named = [&](const std::string& name) {
    return std::any_of(object.rests_on.begin(), object.rests_on.end(),
                       [&](const std::string& n) { return n == name || n == Attachment::anything; });
  };
  const auto groups = obstacles.groups();
  for (const std::string& name : object.rests_on) {
    if (name != Attachment::anything &&
        std::none_of(groups.begin(), groups.end(), [&](const auto& g) { return g.first == name; })) {
      throw std::invalid_argument("attach '" + object.name + "': it rests on '" + name +
                                  "', which is no obstacle; there are: " + quoted_list(obstacles) + "; or \"" +
                                  Attachment::anything + "\", for whatever it stands on");
    }
  }
  std::vector<Eigen::Index> points;
  Eigen::Index first = 0;
  for (const auto& [name, count] : groups) {
    for (Eigen::Index k = 0; is_named(name) && k < count; ++k) {
      points.push_back(first + k);
    }
    first += count;
  }
  return points;
}

}  // namespace

RestingObject resting(const Robot& robot, const Attachment& object, const Eigen::VectorXd& q, const Obstacles& obstacles,
                      double distance) {
  const std::vector<Eigen::Index> points = points_of(object, obstacles);
  KinematicState state(robot);
  state.update(robot, q, Eigen::VectorXd::Zero(q.size()));
  const Eigen::Isometry3d X_WA = frame_pose(robot, state, robot.frame_index(object.link)) * object.X_LA;
  const Eigen::Matrix3d R = X_WA.linear();
  RestingObject out{object, {}};
  for (std::size_t i = 0; i < object.cover.centres.size(); ++i) {
    const Eigen::Vector3d whole_c = X_WA * object.cover.centres[i];
    const Eigen::Matrix3d whole_A = R * object.cover.shapes[i];
    Eigen::Vector3d c = whole_c;
    Eigen::Matrix3d A = whole_A;
    bool is_cut = false;
    for (int k = 0;; ++k) {
      const Cut cut = worst(c, A, obstacles, points, distance);
      if (cut.gap >= distance - tolerance) {
        break;
      }
      const double deep = (whole_A.transpose() * cut.normal).norm() - (cut.offset - cut.normal.dot(whole_c)) - distance;
      if (!(deep <= deepest_rest)) {
        const bool is_known = std::isfinite(deep);
        cannot_rest(object, "its cover is " + (is_known ? millimetres(deep) : std::string("too")) + " deep in " +
                                obstacles.words_for(cut.point) + ", where it may rest at most " + millimetres(deepest_rest) +
                                " deep; are its own points, or those of the gripper, among the obstacles?");
      }
      const Eigen::Vector3d along = A.transpose() * cut.normal;
      const double beta = (cut.offset - cut.normal.dot(c)) / along.norm();
      if (!(beta > -1.0) || k >= most_cuts) {
        cannot_rest(object, "an ellipsoid of its cover lies wholly within " + millimetres(distance) +
                                ", safety.margin and 1 mm, of " + obstacles.words_for(cut.point) +
                                "; lower safety.margin, or give fewer components");
      }
      const Eigen::Vector3d w = along.normalized();
      const double a = 0.5 * (1.0 + beta), across = std::sqrt(a);
      c -= 0.5 * (1.0 - beta) * (A * w);
      A = A * (across * Eigen::Matrix3d::Identity() + (a - across) * w * w.transpose());
      is_cut = true;
    }
    out.given.push_back(is_cut ? largest_difference(whole_c, whole_A, c, A) : 0.0);
    out.object.cover.centres[i] = X_WA.inverse() * c;
    out.object.cover.shapes[i] = R.transpose() * A;
  }
  return out;
}

}  // namespace sidestep

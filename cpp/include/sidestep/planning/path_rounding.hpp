#pragma once

#include <Eigen/Core>
#include <vector>

#include "sidestep/clearance/clearance_query.hpp"

namespace sidestep {

/// A path of straight edges whose corners are rounded, with two continuous derivatives.
///
/// Its station s is the length along the straight edges, which rounding leaves as it is. Between the edges with the
/// directions u and w a corner is passed from d before it to d behind it, at x = (s − s₀) / 2d, with
///
///     q'(s) = u + (w − u)(3x² − 2x³),
///
/// so that q meets both edges, |q'| <= 1, and |q''| <= 3 |w − u| / 4d. It passes the corner at a distance of 3/16 d |w − u|.
class RoundedPath {
 public:
  /// Corners that stay sharp.
  explicit RoundedPath(const Eigen::MatrixXd& path);

  /// Rounds corners as wide as half of the neighbouring edges (all of it at an end) allows, and halves them until they are free.
  /// They are checked as edges, on chords from which no point of the arm deviates by more than half a millimetre. A corner that
  /// is free at no width keeps one at which it leaves the path by no more than that.
  RoundedPath(const Eigen::MatrixXd& path, const ClearanceQuery& body, const Obstacles& obstacles, const Margins& margins,
              ClearanceQuery::Workspace& workspace);

  double length() const noexcept { return starts_.empty() ? 0.0 : starts_.back(); }

  /// Configuration and its derivatives by s (nv) at a station.
  struct Point {
    Eigen::VectorXd q, first, second;
  };
  void at(double station, Point& point) const;

  /// Stations, ascending, no farther apart than `spacing`, both ends of all edges and roundings among them.
  Eigen::VectorXd stations(double spacing) const;

  /// Middle and half width of a corner; half width 0: sharp.
  struct Corner {
    double station, half;
  };
  const std::vector<Corner>& corners() const noexcept { return corners_; }

 private:
  bool corner_is_free(std::size_t k, const ClearanceQuery& body, const Obstacles& obstacles, const Margins& margins,
                      ClearanceQuery::Workspace& workspace) const;

  std::vector<Eigen::VectorXd> waypoints_, directions_;
  std::vector<double> starts_;   // Stations of the waypoints.
  std::vector<Corner> corners_;  // Corners, between edge k and k + 1.
};

}  // namespace sidestep

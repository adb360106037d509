#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>
#include <vector>

#include "line_fit.hpp"
#include "point_grid.hpp"
#include "registration.hpp"
#include "rest_memory.hpp"
#include "sidestep/scene/velocity_estimate.hpp"

namespace sidestep {

/// What is known of the motion of a point.
struct PointMotion {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s]
  double uncertainty = 0.0;                            ///< [m/s]
  int sets = 1;                                        ///< that it was seen in
};

/// Velocities of points that have neither names nor an order, by clusters; see VelocityEstimate.
class CloudMotion {
 public:
  explicit CloudMotion(double largest_speed) : largest_speed_(largest_speed) {}

  /// Motions of points (3 × N) [m] of a set at `time` [s], later than the last. sight: see VelocityEstimate. noise: (N) [m], 0: not known.
  std::vector<PointMotion> update(const Eigen::Matrix3Xd& points, double time, Sight sight, const Eigen::VectorXd& noise);
  /// Forgets all, and takes a first look, see VelocityEstimate.
  void begin(const Eigen::Matrix3Xd& points, double time, Sight sight);
  void forget();

 private:
  /// What was connected in a set.
  struct Cluster {
    std::vector<int> points;
    Eigen::Vector3d middle, size;  // centroid and edges of its box [m]
    Eigen::Matrix3Xd sample;       // some of its points [m]
    double noise = 0.0;            // of its points, as the sensor has it [m]; 0: not known
    PointMotion motion;
    double scatter = -1.0;  // of its places about a line [m]; negative: not known
  };
  struct Set {
    double time;
    Eigen::Matrix3Xd points;
    PointGrid grid;
    Eigen::VectorXd noise;  // of each point [m]
    Sight sight;
    std::vector<Cluster> clusters;
    std::vector<PointMotion> motions;
    bool is_first_look = false;  // Only the next set is compared with it.
  };
  /// Where a cluster lay in the last set; whether it moved there.
  struct Match {
    Registration registration;
    bool moved = false;
  };
  /// The way between the middles of two clusters [m], by what both of their sets could show.
  struct Way {
    std::optional<Eigen::Vector3d> shift = std::nullopt;  // none: too little of them is what both could show
    bool is_cut = false;                                  // The end of a sight cuts one of them.
    int num = 0;                                          // Points of each that it is found from, at least.
  };
  /// Where a cluster was, from its place now on: that is the first one, then come earlier sets, the newest first.
  struct Track {
    LineFit<3>::Positions shifts = LineFit<3>::Positions::Zero();  // [m]
    std::array<double, most_sets> times{};                         // from now on, negative [s]
    int num = 1;
    double error = 0.0;      // of a shift [m]
    bool has_moved = false;  // in the last set

    void add(const Eigen::Vector3d& shift, double time, double shift_error);
    /// Where it is expected at a time [s].
    Eigen::Vector3d at(double time) const { return LineFit<3>(shifts, times, num).at(time); }
  };
  /// Shifts at which a cluster may lie in an earlier set [m].
  struct Starts {
    std::vector<Start> shifts;
    bool is_cut = false;  // by the end of a sight
  };

  /// Clusters of what is new, and of what rested before but is not old; what is old rests.
  static void add_clusters(Set& set, const std::vector<char>& is_old, const std::vector<char>& is_new);
  static void add_cluster(Set& set, std::vector<int> points);
  /// Takes what the oldest set does not have out of clusters that rest: a thing that moves so near to them that they are connected.
  void split(Set& set) const;
  bool is_repeated(const Eigen::Matrix3Xd& points, double time) const;
  void judge(Cluster& cluster, const Set& set, bool among_few) const;
  /// Whether neither the last set nor the oldest one shows a shift; if so, and in the next two, sets what is known.
  bool rests(Cluster& cluster, double time) const;
  /// The same of one that the last set does not have, by the two sets before.
  bool flickers(Cluster& cluster, double time) const;
  /// Whether few points lie beside what rested for long: its noise.
  bool is_stray(Cluster& cluster) const;
  /// The way back from a cluster of `now` to one of `then`.
  Way way_back(const Cluster& cluster, const Set& now, const Cluster& other, const Set& then) const;
  /// Where to look for a cluster of `now` in an earlier set, in which it is expected at a shift `ahead` [m]. has_moved: it, or what was
  /// beside it, moved in the last set.
  Starts starts_in(const Cluster& cluster, const Set& now, const Set& then, const Eigen::Vector3d& ahead, bool has_moved) const;
  /// Whether two clusters have as many points, within a factor of four, and are as large, within half of it and a slack [m].
  static bool is_alike(const Cluster& one, const Cluster& other, double slack);
  Match match(const Cluster& cluster, const Set& now, bool among_few) const;
  /// Where a cluster was, by the nearest points of earlier sets.
  Track track_points(const Cluster& cluster, const Match& match, const Set& now) const;
  /// The same by the middles of clusters, for noisy ones.
  Track track_middle(const Cluster& cluster, const Set& now) const;
  /// Whether it is known by so much noise that the nearest points of another set say little; few points have no middle.
  static bool is_noisy(const Cluster& cluster) noexcept;
  /// The cluster of an earlier set that this one was; null: none is as large and near enough. `expected`: where it should be, as a shift
  /// from here [m]. Without it, each one is taken on by its own velocity, and one that fits another cluster of `now` better is left to it.
  const Cluster* same_in(const Set& then, const Cluster& cluster, const Set& now,
                         std::optional<Eigen::Vector3d> expected) const;
  /// The velocity that a track shows.
  void follow(Cluster& cluster, const Track& track, double time) const;
  /// Whether the last set alone tells that a cluster moved, by a way with an error [m], in a duration [s].
  bool has_jumped(const Cluster& cluster, double way, double error, double duration) const;
  /// What the last set alone tells of a cluster that lay in it at a shift [m], with an error [m].
  void follow_jump(Cluster& cluster, const Eigen::Vector3d& shift, double error, double time) const;
  void learn_noise(const Set& set);
  void spread_out(Set& set, const std::vector<RestMemory::Rest>& rests);

  double largest_speed_;
  std::deque<Set> sets_;  // the newest first
  RestMemory memory_;
  double noise_ = 0.0;  // of the places of clusters from set to set [m]: sensors that shake
};

}  // namespace sidestep

#pragma once

#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "cell_ball.hpp"
#include "reach.hpp"
#include "sidestep/perception/perception.hpp"
#include "sidestep/perception/steady_depth.hpp"
#include "sidestep/perception/unseen_space.hpp"
#include "sidestep/scene/velocity_estimate.hpp"

namespace sidestep {

inline constexpr std::size_t most_cameras = 16;

/// What a camera sees moving in one piece.
struct Mover {
  Eigen::AlignedBox3d box;   // where it was at the camera's last image [m]
  Eigen::Vector3d velocity;  // [m/s]
  double uncertainty;        // [m/s]
  int cells;                 // that show it; many where they are large
  double age;                // for which it was seen to move [s]
  bool is_apart;             // Some of them are not beside what rests.
};

struct Perception::Impl {
  /// A camera with its last image.
  struct View {
    View(const DepthCamera& its, const Arm& arm, int steady_images);

    DepthCamera camera;
    CameraRays rays;
    DepthImage image;
    SteadyDepth steady;
    ArmMask mask;
    int frame_of_arm;                                        // Frame on which the camera is; -1: the world.
    const float* depth;                                      // of the last image that was used, with less noise where it rests
    Eigen::Isometry3d X_WC;                                  // at the last image that was used
    Eigen::Isometry3d shown_X_WC;                            // at the image that is held, used or not
    double time = std::numeric_limits<double>::quiet_NaN();  // of the last image that was used [s]
    double before = std::numeric_limits<double>::quiet_NaN();  // of the one before that [s]
    double begin = std::numeric_limits<double>::quiet_NaN();   // of its first image [s]
    double judged = std::numeric_limits<double>::quiet_NaN();  // Time at which `through` was updated [s].
    double through = 0.0;                                      // share of rays that see through the arm, smoothed
    VelocityEstimate motion;                                   // of what the camera shows
    std::vector<Mover> movers;                                 // in its last image
    bool stands_still = true;                                  // The camera, at its last image.
  };
  struct Region {
    std::string name;
    Obstacles balls;
    double grow;
    int frame;  // of the arm; -1: the world
  };
  /// A voxel as it was when it was compared with told shapes.
  struct Tested {
    float low[3], high[3];
    std::uint64_t version = 0;
    int cell = -1;
    bool is_explained = false;
  };

  /// What the controller is given of a cell: its ball where it was seen, moved on by its velocity for its age; its size stays.
  struct Handed {
    int voxel;
    Eigen::Vector3d velocity;  // [m/s]
    double uncertainty;        // of the velocity [m/s]
    double age;                // since an image showed it [s]
  };

  Impl(Controller& controller, const std::vector<DepthCamera>& cameras, const PerceptionSettings& settings);

  std::size_t index(const std::string& camera) const;
  template <class Take>
  PerceptionReport update(std::size_t number, const Capture& capture, Take&& take);
  /// Takes over the arm of the controller, with what it holds.
  void refresh_arm();
  bool find_arm(const View& view, double time, const Eigen::VectorXd& q, PerceptionReport& report);
  Eigen::Isometry3d pose_of(const View& view, const KinematicState& state) const;
  void add_unseen(const SeenImage& seen);
  void judge(View& view, PerceptionReport& report) const;
  /// Gives the controller what the camera shows, and what no camera shows now.
  void hand_over(const SeenImage& seen, PerceptionReport& report);
  /// The ball of a voxel; `moved`: around what the last image alone shows.
  CellBall ball_of(const Voxel& voxel, bool moved) const;
  /// Those of several, at rest.
  Obstacles balls(const std::vector<int>& chosen, bool moved) const;
  /// Finds the velocities of what a camera shows now and has not rested.
  void find_velocities(View& view, double time);
  /// What another camera than one sees moving near a point at a time [s]; null: nothing.
  const Mover* mover_beside(std::size_t number, const Eigen::Vector3d& point, double time) const;
  /// What a camera shows, with velocities, and what it showed before where that moved or may move and is hidden. What two images
  /// alone or points with much noise tell to move comes twice, also at rest; so does what it cannot tell to move beside what another
  /// camera sees moving.
  Obstacles moving_balls(const SeenImage& seen);
  /// Takes what other sources say, where it was at a time [s].
  void find_told(double time);
  bool is_explained(std::size_t voxel);
  bool is_left_out(const Voxel& voxel) const;
  bool drop_region(const std::string& name);
  std::vector<Cell> cells() const;
  std::vector<PixelLabel> labels(const View& view) const;

  Controller& controller;
  const PerceptionSettings& settings;
  mutable std::mutex mutex;
  std::optional<Arm> arm;
  std::vector<View> views;
  Eigen::VectorXd zero;
  KinematicState before, now, after;
  Reach reach;
  VoxelMap map;
  std::optional<UnseenSpace> unseen;
  double unseen_time = -std::numeric_limits<double>::infinity();  // Time at which its border was found [s].
  Eigen::Matrix3Xd border{3, 0};
  std::vector<Region> regions;
  std::vector<std::shared_ptr<const Obstacles>> told;  // what other sources say
  std::uint64_t told_version = 0;                      // Sum of their versions.
  std::vector<Tested> tested;                          // one per voxel
  std::vector<int> fresh;                              // Voxels that a camera shows and that may move, in work.
  std::vector<int> doubtful;                           // Those of them whose motion may be none, in work.
  std::vector<int> shown, remembered;                  // Voxels that a camera shows, and that none shows, in work.
  std::vector<Handed> handed;                          // What a camera shows and has just shown, in work.
  std::vector<int> last_remembered;                    // The latter, as the controller has them.
  std::vector<Eigen::Vector3f> velocities;             // Per voxel, as the last image that showed it says [m/s].
  std::vector<float> uncertainties;                    // The same: how far they may be wrong [m/s].
  std::vector<char> is_excluded;                       // Per voxel: explained or left out.
};

}  // namespace sidestep

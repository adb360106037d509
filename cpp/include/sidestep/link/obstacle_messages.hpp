#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "sidestep/link/message.hpp"
#include "sidestep/scene/obstacles.hpp"

// From a client to a server: what is seen. With the token; the client need not be in command.
namespace sidestep::link {

/// Obstacles in a message, see sidestep::Obstacles.
struct ObstacleSet {
  Eigen::Matrix3Xd points, velocities;  ///< [m], [m/s]; velocities empty: at rest, or not told
  Eigen::VectorXd radii, uncertainty;   ///< [m], [m/s]; uncertainty empty: zero
  std::vector<std::string> names;       ///< of the groups of points; empty: none
  std::vector<std::int64_t> counts;     ///< number of points of each group
  Eigen::Matrix4Xd poses;               ///< (4 × 4 groups) poses in the world; empty: at the origin

  ObstacleSet() = default;
  explicit ObstacleSet(const Obstacles& obstacles);
  /// Throws std::invalid_argument that names the value and what is allowed.
  Obstacles obstacles() const;
};
void each_field(Of<ObstacleSet> auto& m, auto&& visit) {
  visit("points", m.points, "(3 × N) [m] in the world");
  visit("velocities", m.velocities, "(3 × N) [m/s]; empty: none are told");
  visit("radii", m.radii, "(N) [m]");
  visit("uncertainty", m.uncertainty, "of the velocities (N) [m/s]; empty: zero");
  visit("names", m.names, "of groups of points; empty: none");
  visit("counts", m.counts, "number of points of each group");
  visit("poses", m.poses, "(4 × 4 groups) in the world; empty: all at the origin");
}

struct SetObstacles {
  static constexpr MessageInfo info{MessageType::set_obstacles, "SetObstacles", Sender::client, 32 << 20,
                                    "As Controller.set_obstacles. With the token."};
  std::string source;
  double time = std::numeric_limits<double>::quiet_NaN(), valid_for = time;
  bool as_given = false;
  ObstacleSet set;

  void check() const;
};
void each_field(Of<SetObstacles> auto& m, auto&& visit) {
  visit("source", m.source, "name");
  visit("time", m.time, "of capture, on the clock of the steps [s]; NaN: when the next step takes it");
  visit("valid_for", m.valid_for, "[s]; NaN: as the settings say");
  visit("as_given", m.as_given, "the set is taken as it is");
  each_field(m.set, visit);
}

struct AddObstacle {
  static constexpr MessageInfo info{MessageType::add_obstacle, "AddObstacle", Sender::client, 32 << 20,
                                    "As Controller.add_obstacle. With the token."};
  std::string source;
  ObstacleSet set;

  void check() const;
};
void each_field(Of<AddObstacle> auto& m, auto&& visit) {
  visit("source", m.source, "name");
  each_field(m.set, visit);
}

struct MoveObstacle {
  static constexpr MessageInfo info{MessageType::move_obstacle, "MoveObstacle", Sender::client, 16384,
                                    "As Controller.move_obstacle. With the token."};
  std::string name, source;
  Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
  double time = std::numeric_limits<double>::quiet_NaN(), valid_for = time;

  void check() const;
};
void each_field(Of<MoveObstacle> auto& m, auto&& visit) {
  visit("name", m.name, "of the obstacle");
  visit("source", m.source, "name");
  visit("pose", m.pose, "(4 × 4) in the world");
  visit("time", m.time, "of capture [s]; NaN: when the next step takes it");
  visit("valid_for", m.valid_for, "[s]; NaN: as the settings say");
}

struct RemoveObstacle {
  static constexpr MessageInfo info{MessageType::remove_obstacle, "RemoveObstacle", Sender::client, 16384,
                                    "As Controller.remove_obstacle. With the token."};
  std::string name, source;

  void check() const;
};
void each_field(Of<RemoveObstacle> auto& m, auto&& visit) {
  visit("name", m.name, "of the obstacle");
  visit("source", m.source, "name");
}

struct RemoveObstacles {
  static constexpr MessageInfo info{MessageType::remove_obstacles, "RemoveObstacles", Sender::client, 8192,
                                    "As Controller.remove_obstacles. With the token."};
  std::string source;

  void check() const;
};
void each_field(Of<RemoveObstacles> auto& m, auto&& visit) { visit("source", m.source, "name"); }

struct ExpectObstacles {
  static constexpr MessageInfo info{MessageType::expect_obstacles, "ExpectObstacles", Sender::client, 8192,
                                    "As Controller.expect_obstacles. With the token."};
  std::string source;

  void check() const;
};
void each_field(Of<ExpectObstacles> auto& m, auto&& visit) { visit("source", m.source, "name"); }

struct DepthImageMessage {
  static constexpr MessageInfo info{MessageType::depth_image, "DepthImageMessage", Sender::client, 32 << 20,
                                    "As Perception.update, where the server has a perception. With the token."};
  /// What a pixel is.
  enum class Pixel : std::uint8_t { uint16 = 1, float32 = 2 };

  std::string camera;
  double time = 0.0, unit = 0.001;
  std::uint32_t width = 0, height = 0;
  Pixel pixel = Pixel::uint16;
  std::vector<double> pose;
  std::string pixels;

  void check() const;
};
void each_field(Of<DepthImageMessage> auto& m, auto&& visit) {
  visit("camera", m.camera, "name");
  visit("time", m.time, "of capture, on the clock of the steps [s]");
  visit("unit", m.unit, "of the pixels [m]");
  visit("width", m.width, "[pixel]");
  visit("height", m.height, "[pixel]");
  visit("pixel", m.pixel, "1: uint16, 2: float32");
  visit("pose", m.pose, "of the camera in the world (4 × 4), column by column; empty: as it is mounted");
  visit("pixels", m.pixels, "row by row");
}

}  // namespace sidestep::link

#include "sidestep/link/obstacle_messages.hpp"

#include <utility>

namespace sidestep::link {

ObstacleSet::ObstacleSet(const Obstacles& obstacles) : points(obstacles.points()), radii(obstacles.radii()) {
  if (!obstacles.velocities().isZero(0.0)) {
    velocities = obstacles.velocities();
  }
  if (!obstacles.uncertainty().isZero(0.0)) {
    uncertainty = obstacles.uncertainty();
  }
  const auto groups = obstacles.groups();
  if (groups.size() == 1 && groups.front().first.empty()) {
    return;
  }
  poses.resize(4, static_cast<Eigen::Index>(4 * groups.size()));
  for (std::size_t k = 0; const auto& [name, count] : groups) {
    names.push_back(name);
    counts.push_back(count);
    poses.middleCols<4>(static_cast<Eigen::Index>(4 * k)) = obstacles.pose_of(k).matrix();
    ++k;
  }
}

Obstacles ObstacleSet::obstacles() const {
  const Eigen::Index size = points.cols();
  require_size("radii", radii.size(), size);
  if (velocities.cols() != 0) {
    require_size("velocities", velocities.cols(), size);
  }
  if (uncertainty.size() != 0) {
    require_size("uncertainty", uncertainty.size(), size);
  }
  if (size == 0) {
    return Obstacles::none();
  }
  const Eigen::Matrix3Xd moving = velocities.cols() == 0 ? Eigen::Matrix3Xd(Eigen::Matrix3Xd::Zero(3, size)) : velocities;
  Obstacles made(points, radii, moving);
  if (uncertainty.size() != 0) {
    made = made.moving(moving, uncertainty);
  }
  if (names.empty()) {
    return made;
  }
  for (const std::string& name : names) {
    require_text("names", name);
  }
  const auto groups = static_cast<Eigen::Index>(names.size());
  if (poses.cols() != 0) {
    require_size("poses", poses.cols(), 4 * groups);
    require_finite("poses", poses);
  }
  std::vector<Eigen::Isometry3d> placed;
  for (Eigen::Index k = 0; k < poses.cols() / 4; ++k) {
    placed.emplace_back(Eigen::Matrix4d(poses.middleCols<4>(4 * k)));
  }
  return made.named(names, {counts.begin(), counts.end()}, std::move(placed));
}

void SetObstacles::check() const { require_text("source", source); }

void AddObstacle::check() const { require_text("source", source); }

void MoveObstacle::check() const {
  require_text("name", name);
  require_text("source", source);
  require_finite("pose", pose);
}

void RemoveObstacle::check() const {
  require_text("name", name);
  require_text("source", source);
}

void RemoveObstacles::check() const { require_text("source", source); }

void ExpectObstacles::check() const { require_text("source", source); }

void DepthImageMessage::check() const {
  require_text("camera", camera);
  if (pixel != Pixel::uint16 && pixel != Pixel::float32) {
    throw std::invalid_argument("pixel is " + std::to_string(static_cast<int>(pixel)) + "; allowed: 1, uint16, and 2, float32");
  }
  if (!std::isfinite(time)) {
    throw std::invalid_argument("time is " + std::to_string(time) + "; when the image was captured must be told");
  }
  const std::size_t wanted = std::size_t{width} * height * (pixel == Pixel::uint16 ? 2 : 4);
  if (pixels.size() != wanted || wanted == 0) {
    throw std::invalid_argument("pixels has " + std::to_string(pixels.size()) + " bytes; " + std::to_string(width) + " × " +
                                std::to_string(height) + " pixels have " + std::to_string(wanted));
  }
  if (!pose.empty()) {
    require_size("pose", static_cast<Eigen::Index>(pose.size()), 16);
    require_finite("pose", Eigen::Map<const Eigen::VectorXd>(pose.data(), 16));
  }
}

}  // namespace sidestep::link

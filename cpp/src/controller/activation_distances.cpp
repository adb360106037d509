#include "activation_distances.hpp"

#include <algorithm>

#include "sidestep/planning/timed_path.hpp"

namespace sidestep {

Places::Places(Eigen::Index nv) : q(Eigen::MatrixXd::Zero(nv, TimedPathFollower::most_places + 1)) {}

ActivationDistances::ActivationDistances(std::shared_ptr<const GeometricSystem> system,
                                         const std::vector<Eigen::Index>& clearances)
    : system_(std::move(system)),
      clearances_(clearances),
      workspace_(*system_),
      values_(system_->activations()),
      lowered_places_(Places(system_->robot().num_coordinates()).q) {}

bool ActivationDistances::lower_at(const Places& places, const Obstacles& obstacles, GeometricSystem::Workspace& workspace,
                                   Eigen::VectorXd& activations) const noexcept {
  activations = system_->activations();
  bool inside = false;
  for (Eigen::Index k = 0; k < places.num; ++k) {
    static_cast<void>(system_->lower_activations(places.q.col(k), obstacles, workspace, activations));
    inside = std::any_of(clearances_.begin(), clearances_.end(),
                         [&](Eigen::Index i) { return workspace.clearances.least[i] < 0.0; });
  }
  return inside;
}

void ActivationDistances::update(const Places& places, const Obstacles& obstacles, bool& target_blocked) noexcept {
  const std::uint64_t version = obstacles.version();
  if (places.num == num_lowered_ && version == lowered_version_ &&
      places.q.leftCols(places.num) == lowered_places_.leftCols(places.num)) {
    return;
  }
  target_blocked = lower_at(places, obstacles, workspace_, values_);
  lowered_places_ = places.q;
  num_lowered_ = places.num;
  lowered_version_ = version;
}

}  // namespace sidestep

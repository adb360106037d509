#pragma once

#include <memory>
#include <vector>

#include "sidestep/body/link_pair.hpp"
#include "sidestep/clearance/clearance_group.hpp"
#include "sidestep/clearance/link_ellipsoids.hpp"

namespace sidestep {

/// Clearances of pairs of links that must not touch, one each.
///
/// The clearance of two ellipsoids is the gap between them (see ellipsoid_gap.hpp), their distance, less the gap at
/// which the links touch (see link_pair.hpp). The pairs of ellipsoids of two links are reduced to one clearance by the
/// Boltzmann mean (see boltzmann_mean.hpp).
class PairClearances final : public ClearanceGroup {
 public:
  static constexpr double default_temperature = 0.002;  // Temperature of the mean [m].

  struct Pair {
    int first, second;  ///< Indices of the links.
    double contact;     ///< Gap at which the links touch [m].
  };

  /// Throws std::invalid_argument, which `owner` begins, if there is no pair, a link is unknown or has no ellipsoid, the two
  /// are rigidly connected, or `contact` or the temperature [m] is at fault.
  PairClearances(const Robot& robot, std::shared_ptr<const BodyLinks> links, const std::vector<LinkPair>& pairs,
                 double temperature, const char* owner);

  int size() const noexcept override { return static_cast<int>(pairs_.size()); }
  CoordinateLabel label(int k) const override;
  void evaluate(const KinematicState& state, const Obstacles& obstacles, double reach, const Horizon& horizon,
                ClearanceView out) const noexcept override;
  double longest_activation(int k) const noexcept override { return activations_[static_cast<std::size_t>(k)]; }

  const Pair& operator[](int k) const noexcept { return pairs_[static_cast<std::size_t>(k)]; }

 private:
  std::vector<double> usual_activations(const Robot& robot) const;

  double temperature_;
  std::shared_ptr<const BodyLinks> links_;
  std::vector<Pair> pairs_;
  std::vector<double> activations_;
};

}  // namespace sidestep

#pragma once

#include <algorithm>

#include "sidestep/clearance/clearance_group.hpp"
#include "sidestep/attractor/barrier_function.hpp"
#include "sidestep/attractor/embedding.hpp"

namespace sidestep {

/// An embedding whose coordinates are barriers of clearances, ψ_k = f(h_k).
///
/// Every coordinate has its own activation distance; the caller may shorten it (EmbeddingView::activations). Where the arm has
/// to come close, at its goal, the metric would otherwise be so steep that the arm creeps. The safety margin (SafetySettings)
/// shrinks along with it for clearances that no sensor sees, so that links can come as close to each other as they have to.
class Barrier : public Embedding {
 public:
  int num_coordinates() const noexcept final { return static_cast<int>(activations_.size()); }

  const BarrierFunction& function() const noexcept { return function_; }

  /// The activation distance of every coordinate (m) [m | rad].
  const Eigen::VectorXd& activations() const noexcept { return activations_; }

  /// Floor of a coordinate: that of the barrier function, scaled with the coordinate's activation distance.
  double floor(Eigen::Index k) const noexcept { return function_.floor * activations_[k] / function_.activation; }

  void write_activations(Eigen::Ref<Eigen::VectorXd> activations) const noexcept final { activations = activations_; }
  void lower_activations(ConstVectorRef clearances, Eigen::Ref<Eigen::VectorXd> activations) const noexcept final;

  /// Share of a clearance at the goal that the activation distance there is reduced to [-].
  static constexpr double relaxed_share = 0.9;
  /// Shortest activation distance, in floors of the barrier function.
  static constexpr double relaxed_floors = 2.0;
  /// Largest share of an activation distance that is kept as a safety margin by what no sensor sees [-].
  static constexpr double margin_share = ClearanceGroup::margin_share;

 protected:
  /// Throws std::invalid_argument that names `owner`, the setting at fault, its value and what is allowed.
  Barrier(Robot robot, const BarrierFunction& function, const char* owner);

  void set_num_coordinates(int num) { activations_.setConstant(num, function_.activation); }
  /// Makes the activation distance of a coordinate shorter than the barrier function's.
  void shorten_activation(int k, double most) { activations_[k] = std::min(activations_[k], most); }

  /// Horizon of the critical samples: the activation distance beyond what can be closed while the arm stops.
  Horizon horizon(const KinematicState& state) const noexcept {
    return {Horizon::of_stop(state.v(), robot().limits()), function_.activation};
  }

  /// Adds ψ_k = f(h_k) with its derivatives, for every clearance that `out.clearances` holds.
  void add_barriers(EmbeddingView out) const noexcept;

  /// Whether the clearances are from points that a sensor sees, with errors that the safety margin covers.
  virtual bool is_seen() const noexcept { return false; }

 private:
  BarrierFunction function_;
  Eigen::VectorXd activations_;
};

}  // namespace sidestep

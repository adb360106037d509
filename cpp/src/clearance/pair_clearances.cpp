#include "sidestep/clearance/pair_clearances.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>

#include "pair_of_links.hpp"

namespace sidestep {
namespace {

constexpr int configurations = 101;  // Number of configurations whose median is the usual clearance of two links.
constexpr int newton_steps = 30;     // Newton steps for the root that spreads the configurations.

/// Configurations spread evenly over the ranges: n α_j modulo 1, with α_j = x^-(j+1) and x^(nv+1) = x + 1 (Roberts 2018).
std::vector<Eigen::VectorXd> spread_configurations(const Robot& robot) {
  const Eigen::Index nv = robot.num_coordinates();
  double x = 1.5;
  for (int n = 0; n < newton_steps; ++n) {
    const double power = std::pow(x, static_cast<double>(nv));
    x -= (power * x - x - 1.0) / (static_cast<double>(nv + 1) * power - 1.0);
  }
  std::vector<Eigen::VectorXd> all(configurations, Eigen::VectorXd(nv));
  for (int n = 0; n < configurations; ++n) {
    for (Eigen::Index j = 0; j < nv; ++j) {
      const double lower = robot.limits().lower[j], upper = robot.limits().upper[j], turn = 2.0 * std::numbers::pi;
      const double low = std::isfinite(lower) ? lower : std::isfinite(upper) ? upper - turn : -0.5 * turn;
      const double high = std::isfinite(upper) ? upper : low + turn;
      const double place = (static_cast<double>(n) + 0.5) * std::pow(x, -static_cast<double>(j + 1));
      all[static_cast<std::size_t>(n)][j] = low + (place - std::floor(place)) * (high - low);
    }
  }
  return all;
}

}  // namespace

PairClearances::PairClearances(const Robot& robot, std::shared_ptr<const BodyLinks> links, const std::vector<LinkPair>& pairs,
                               double temperature, const char* owner)
    : temperature_(checked_temperature(temperature, owner)), links_(std::move(links)) {
  if (pairs.empty()) {
    throw std::invalid_argument(std::string(owner) + ": there is no pair of links");
  }
  for (const auto& [a, b, contact] : pairs) {
    const Pair pair{links_->index(robot, a, owner), links_->index(robot, b, owner), contact};
    if (!std::isfinite(contact)) {
      throw std::invalid_argument(std::string(owner) + ": contact of links '" + a + "' and '" + b + "' is " +
                                  std::to_string(contact) + " m, must be finite");
    }
    if ((*links_)[pair.first].joint == (*links_)[pair.second].joint) {
      throw std::invalid_argument(std::string(owner) + ": links '" + a + "' and '" + b +
                                  "' are rigidly connected, so nothing could keep them apart");
    }
    pairs_.push_back(pair);
  }
  activations_ = usual_activations(robot);
}

std::vector<double> PairClearances::usual_activations(const Robot& robot) const {
  std::vector<std::vector<double>> near(pairs_.size());
  KinematicState state(robot);
  const Eigen::VectorXd v = Eigen::VectorXd::Zero(robot.num_coordinates());
  for (const Eigen::VectorXd& q : spread_configurations(robot)) {
    state.update(robot, q, v);
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const double reach = usually_near + pairs_[i].contact;
      const PairOfLinks pair(state, (*links_)[pairs_[i].first], (*links_)[pairs_[i].second]);
      if (pair.find_below(reach, [](const auto&...) { return true; })) {
        near[i].push_back(solved(pair, temperature_, 0.0, reach, reach).least() - pairs_[i].contact);
      }
    }
  }
  constexpr auto half = static_cast<std::size_t>(configurations / 2);
  std::vector<double> activations(pairs_.size(), std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    if (near[i].size() > half) {  // of what is not near, it does not matter how far it is
      std::nth_element(near[i].begin(), near[i].begin() + half, near[i].end());
      activations[i] = activation_for_usual(near[i][half]);
    }
  }
  return activations;
}

void PairClearances::evaluate(const KinematicState& state, const Obstacles& /*obstacles*/, double reach_asked,
                              const Horizon& ahead, ClearanceView out) const noexcept {
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const double contact = pairs_[i].contact;
    const LinkEllipsoids &first = (*links_)[pairs_[i].first], &second = (*links_)[pairs_[i].second];
    const PairOfLinks pair(state, first, second);
    // Most pairs of links end here.
    if (!pair.within(std::max(reach_asked, ahead.distance + ahead.time * pair.speed()) + contact)) {
      continue;
    }
    const double reach = std::max(reach_asked, ahead.distance + ahead.time * pair.closing_speed());
    if (!pair.find_below(reach + contact, [](const auto&...) { return true; })) {
      continue;
    }
    const MeanGap gaps = solved(pair, temperature_, ahead.time, reach + contact, ahead.distance + contact);
    ClearanceSample mean = gaps.mean(), approach = gaps.approach();
    mean.value -= contact;
    approach.value -= contact;
    if (mean.value < reach) {
      const auto k = static_cast<Eigen::Index>(i);
      write(mean, state, first.joint, second.joint, k, out);
      write(approach, state, first.joint, second.joint, k, out.approach);
      out.nearest[k] = gaps.nearest();
      out.least[k] = gaps.least() - contact;
    }
  }
}

CoordinateLabel PairClearances::label(int k) const {
  const Pair& pair = pairs_[static_cast<std::size_t>(k)];
  return {CoordinateLabel::Kind::self, (*links_)[pair.first].name, (*links_)[pair.second].name};
}

}  // namespace sidestep

#include "sidestep/thesis/sum.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace sidestep {
namespace {

const Embedding& first_of(const std::vector<std::shared_ptr<const Embedding>>& terms) {
  if (terms.empty()) {
    throw std::invalid_argument("sum of embeddings: there is no term");
  }
  return *terms.front();
}

}  // namespace

Sum::Sum(std::vector<std::shared_ptr<const Embedding>> terms) : Embedding(first_of(terms).robot()), terms_(std::move(terms)) {
  for (const auto& term : terms_) {
    if (term->num_coordinates() != num_coordinates()) {
      throw std::invalid_argument("sum of embeddings: terms have " + std::to_string(num_coordinates()) + " and " +
                                  std::to_string(term->num_coordinates()) + " coordinates, must be equal");
    }
    if (!term->robot().same_joints(robot())) {
      throw std::invalid_argument("sum of embeddings: terms were made for robots '" + robot().name() + "' and '" +
                                  term->robot().name() + "'");
    }
  }
}

void Sum::add_to(EmbeddingView out, const KinematicState& state, const Obstacles& obstacles) const noexcept {
  for (const auto& term : terms_) {
    term->add_to(out, state, obstacles);
  }
}

void Sum::lower_distances(Eigen::Ref<Eigen::VectorXd> distances, const KinematicState& state,
                          const Obstacles& obstacles) const noexcept {
  for (const auto& term : terms_) {
    term->lower_distances(distances, state, obstacles);
  }
}

bool Sum::measures_distances() const noexcept {
  return std::any_of(terms_.begin(), terms_.end(), [](const auto& term) { return term->measures_distances(); });
}

}  // namespace sidestep

#include "sidestep/attractor/embedding.hpp"

namespace sidestep {

bool Embedding::touches(const KinematicState& /*state*/, const Obstacles& /*obstacles*/, double /*depth*/) const noexcept {
  return false;
}

CoordinateLabel Embedding::label(int /*k*/) const { return {}; }

void Embedding::write_activations(Eigen::Ref<Eigen::VectorXd> activations) const noexcept {
  activations.setConstant(std::numeric_limits<double>::infinity());
}

void Embedding::lower_activations(ConstVectorRef /*clearances*/, Eigen::Ref<Eigen::VectorXd> /*activations*/) const noexcept {}

void Embedding::lower_distances(Eigen::Ref<Eigen::VectorXd> /*distances*/, const KinematicState& /*state*/,
                                const Obstacles& /*obstacles*/) const noexcept {}

EmbeddingEvaluation evaluate(const Embedding& embedding, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                             const Obstacles& obstacles) {
  const Robot& robot = embedding.robot();
  KinematicState state(robot);
  state.update(robot, q, v);
  const int m = embedding.num_coordinates();
  EmbeddingEvaluation result{Eigen::VectorXd::Zero(m), {}, Eigen::VectorXd::Zero(m), Clearances(robot.num_coordinates(), m)};
  Eigen::MatrixXd jacobian_transposed = Eigen::MatrixXd::Zero(robot.num_coordinates(), m);
  embedding.add_to({{result.values.data(), m},
                    {jacobian_transposed.data(), jacobian_transposed.rows(), m},
                    {result.curvatures.data(), m},
                    result.clearances.view(0, m)},
                   state, obstacles);
  result.jacobian = jacobian_transposed.transpose();
  return result;
}

std::vector<Eigen::MatrixXd> hessians(const Embedding& embedding, const Eigen::VectorXd& q, const Obstacles& obstacles) {
  const int nv = embedding.robot().num_coordinates();
  const Obstacles frozen = obstacles.frozen();
  const auto quadratic_form = [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
    return evaluate(embedding, q, v, frozen).curvatures;
  };
  std::vector<Eigen::MatrixXd> result(static_cast<std::size_t>(embedding.num_coordinates()), Eigen::MatrixXd::Zero(nv, nv));
  for (int i = 0; i < nv; ++i) {
    for (int j = 0; j <= i; ++j) {
      // vᵀ H w = ¼ [(v + w)ᵀ H (v + w) − (v − w)ᵀ H (v − w)]
      const Eigen::VectorXd e_i = Eigen::VectorXd::Unit(nv, i);
      const Eigen::VectorXd e_j = Eigen::VectorXd::Unit(nv, j);
      const Eigen::VectorXd entry = 0.25 * (quadratic_form(e_i + e_j) - quadratic_form(e_i - e_j));
      for (std::size_t k = 0; k < result.size(); ++k) {
        result[k](i, j) = result[k](j, i) = entry[static_cast<Eigen::Index>(k)];
      }
    }
  }
  return result;
}

}  // namespace sidestep

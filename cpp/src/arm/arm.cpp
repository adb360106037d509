#include "sidestep/arm/arm.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "arm_file.hpp"
#include "sha256.hpp"

namespace sidestep {
namespace {

void check_pair_of_links(const Robot& robot, const std::string& first, const std::string& second, const char* what) {
  robot.frame_index(first);
  robot.frame_index(second);
  if (first == second) {
    throw std::invalid_argument(std::string(what) + " of link '" + first + "' with itself");
  }
}

void check(const ArmParts& arm) {
  const Body& body = arm.body;
  if (body.levels.size() == 0) {
    throw std::invalid_argument("the body of robot '" + arm.robot.name() +
                                "' is not calibrated (it has no levels); make one that covers its links: Body.cover");
  }
  for (const std::string& link : body.links) {
    arm.robot.frame_index(link);
  }
  for (const LinkPair& pair : arm.pairs) {
    check_pair_of_links(arm.robot, pair.first, pair.second, "pair");
    if (!std::isfinite(pair.contact)) {
      throw std::invalid_argument("pair of links '" + pair.first + "' and '" + pair.second + "': contact is " +
                                  std::to_string(pair.contact) + ", must be finite");
    }
    for (const std::string& link : {pair.first, pair.second}) {
      if (std::find(body.links.begin(), body.links.end(), link) == body.links.end()) {
        throw std::invalid_argument("pair of links '" + pair.first + "' and '" + pair.second + "': the body does not cover '" +
                                    link + "'");
      }
    }
  }
  for (const PairDistanceTable& table : arm.tables) {
    check_pair_of_links(arm.robot, table.first, table.second, "clearance table");
    table.validate(arm.robot.num_coordinates());
  }
  for (const auto& [first, second] : arm.details.allowed_pairs) {
    check_pair_of_links(arm.robot, first, second, "allowed pair");
  }
  for (const CoverProof& proof : arm.details.proof) {
    arm.robot.frame_index(proof.link);
    for (const double value : {proof.coverage, proof.mean_overshoot, proof.max_overshoot, proof.volume_ratio,
                               proof.interior_coverage, proof.slimness}) {
      if (!(value >= 0.0) || !std::isfinite(value)) {
        throw std::invalid_argument("cover of link '" + proof.link + "': " + std::to_string(value) +
                                    " must be finite and not negative");
      }
    }
  }
  if (!arm.inertials.empty()) {
    const RigidBodyDynamics checked(arm.robot, arm.inertials);
  }
}

}  // namespace

Arm::Arm(Robot robot, Body body, std::vector<LinkPair> pairs, std::vector<PairDistanceTable> tables,
         std::vector<Inertial> inertials, ArmDetails details) {
  auto content = std::make_shared<Content>(Content{std::move(robot), std::move(body), std::move(pairs), std::move(tables),
                                                   std::move(inertials), std::move(details), ""});
  const ArmParts parts{content->robot, content->body, content->pairs, content->tables, content->inertials, content->details};
  check(parts);
  content->hash = hexadecimal(sha256(encode_content(parts)));
  content_ = std::move(content);
}

RigidBodyDynamics Arm::dynamics() const {
  if (!has_dynamics()) {
    throw std::invalid_argument("arm '" + name() +
                                "' has no inertias; give mass matrix and bias, or a description with <inertial>");
  }
  return RigidBodyDynamics(robot(), inertials());
}

Eigen::VectorXd Arm::neutral() const {
  const JointLimits& limits = robot().limits();
  Eigen::VectorXd q(num_coordinates());
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    const double lower = limits.lower[i], upper = limits.upper[i];
    if (std::isfinite(lower) && std::isfinite(upper)) {
      q[i] = 0.5 * (lower + upper);
    } else if (std::isfinite(lower)) {
      q[i] = lower + std::numbers::pi;
    } else if (std::isfinite(upper)) {
      q[i] = upper - std::numbers::pi;
    } else {
      q[i] = 0.0;
    }
  }
  return q;
}

}  // namespace sidestep

#include "sidestep/link/request_messages.hpp"

namespace sidestep::link {

void Hello::check() const {
  require_text("name", name);
  require_text("token", token);
}

void Subscribe::check() const {
  if (!(rate >= 0.0)) {
    throw std::invalid_argument("rate is " + std::to_string(rate) + " Hz; allowed: from 0, inf for every cycle");
  }
}

void SetPoseGoal::check() const {
  if (targets.empty()) {
    throw std::invalid_argument("targets is empty; at least one pose is needed");
  }
  for (const PoseTarget& target : targets) {
    require_text("frame", target.frame);
    require_finite("pose", target.pose);
    require_finite("twist", target.twist);
    require_finite("rest", target.rest);
  }
}

void SetTwist::check() const { require_text("frame", frame); }

void StopRun::check() const { require_text("words", words); }

}  // namespace sidestep::link

#include "sidestep/link/report_messages.hpp"

namespace sidestep::link {
namespace {

void require_number(const char* field, int value, int most) {
  if (value < 0 || value > most) {
    throw std::invalid_argument(std::string(field) + " is " + std::to_string(value) + "; allowed: 0 to " +
                                std::to_string(most));
  }
}

}  // namespace

void Notice::check() const { require_number("kind", static_cast<int>(kind), static_cast<int>(Kind::closing)); }

void CycleMessage::check() const {
  require_number("status", static_cast<int>(command.status), static_cast<int>(SafetyStatus::clearance_lost));
  require_number("activity", static_cast<int>(command.activity), static_cast<int>(Activity::stale));
  for (const Eigen::VectorXd* vector :
       {&state.v, &command.position, &command.velocity, &command.acceleration, &command.torque}) {
    require_size("vectors of joints", vector->size(), state.q.size());
  }
}

}  // namespace sidestep::link

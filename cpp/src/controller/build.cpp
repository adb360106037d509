// A controller from an arm and settings: its stages, and the threads' beginning and end.
#include <algorithm>
#include <limits>
#include <utility>

#include "impl.hpp"
#include "sidestep/controller/controller.hpp"

namespace sidestep {

Controller::Impl::StepState::StepState(Eigen::Index nv)
    : told{false, Eigen::VectorXd::Zero(nv), Eigen::VectorXd::Zero(nv), Eigen::VectorXd::Zero(nv)},
      wanted(Eigen::VectorXd::Zero(nv)),
      coupling(wanted),
      places(nv) {}

Controller::Impl::Impl(Arm a, ControllerSettings s, Command& c, bool works)
    : model(std::move(a), std::move(s)),
      board_(model.arm.num_coordinates()),
      clock_(model.settings.period, model.settings.synchronous),
      measured_(model.arm.robot(), model.joints, model.plausible, model.settings, sidestep::drives_track(model.settings)),
      sources_(board_.worlds(), model.body, model.arm.robot(), model.arm.body(), model.settings),
      inputs_(board_, model.body, model.arm.robot(), model.joints, model.settings, model.usable, model.clearances,
              model.dynamics, works),
      look_ahead_(model.system, model.settings, model.dynamics),
      attractor_(model.system, model.settings),
      distances_(model.system, model.clearances),
      dynamics_(model.dynamics, model.arm.robot(), model.settings, model.torque),
      touch_(model.arm.robot(), model.joints, model.settings, model.torque && model.settings.tracking.stiffness == 0.0),
      speed_(model.body, model.settings),
      program_(within_margins(model.arm.robot(), model.settings, model.settings.speed), model.settings, model.torque),
      solution_(model.arm.num_coordinates(), model.settings.safety.max_rows),
      guard_(model.body, within_margins(model.arm.robot(), model.settings, model.settings.speed).limits(),
             model.settings.safety.margin),
      tracker_(model.arm.robot(), model.joints, model.settings, model.torque),
      activity_(model.settings, model.joints, model.look_period),
      worker_(board_, model.system, distances_, look_ahead_, model.settings, model.look_period),
      reference_(model.arm.num_coordinates()),
      last_(model.arm.num_coordinates()),
      state_(model.arm.num_coordinates()),
      command_(c) {
  if (works && !model.settings.synchronous) {
    worker_.start(inputs_.goal(), look_ahead_);
  }
}

void Controller::Impl::let_rest(const std::vector<RestingObject>& objects) {
  for (const RestingObject& one : objects) {
    std::size_t i = 0;
    for (std::size_t k = 0; k < model.system->labels().size(); ++k) {
      const CoordinateLabel& label = model.system->labels()[k];
      if (label.kind == CoordinateLabel::Kind::obstacle && label.name == one.object.name) {
        const double free = std::max(lifted_clearance, model.settings.safety.margin + attached_distance);
        resting_.add({static_cast<Eigen::Index>(k), one.given[i++] + free});
      }
    }
  }
}

Controller::Impl::~Impl() {
  delete lifted.load();
  worker_.stop();
}

}  // namespace sidestep

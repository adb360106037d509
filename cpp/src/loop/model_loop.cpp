#include "sidestep/loop/model_loop.hpp"

#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "loop_cycle.hpp"
#include "start_checks.hpp"

namespace sidestep {

/// A robot that is where the caller says.
class ModelLoop::Model final : public Driver {
 public:
  explicit Model(const Controller& controller) {
    description_.name = "model of " + controller.arm().name();
    description_.outputs = {output_of(controller)};
    description_.period = controller.settings().period;
    description_.real_time = false;
    description_.when_silent = "it is not moved";
  }

  const RobotDescription& description() const noexcept override { return description_; }
  void start(ControllerSettings::Output) override {}
  DriverResult read(RobotState& state, double) noexcept override {
    state = *given;
    return DriverResult::ok;
  }
  DriverResult write(const Command&) noexcept override { return DriverResult::ok; }
  void stop() noexcept override {}
  std::string trouble() const override { return {}; }

  const RobotState* given = nullptr;

 private:
  RobotDescription description_;
};

LoopSettings ModelLoop::usual_settings() noexcept {
  LoopSettings usual;
  usual.silent_timeout = std::numeric_limits<double>::infinity();
  usual.longest_gap = 10.0;
  return usual;
}

ModelLoop::ModelLoop(Controller& controller, const LoopSettings& settings)
    : controller_(controller),
      model_((settings.validate(), std::make_unique<Model>(controller))),
      cycle_(std::make_unique<LoopCycle>(controller, *model_, settings, std::vector<CycleObserver*>{})) {}

ModelLoop::~ModelLoop() {
  if (has_begun_ && !is_over_) {
    cycle_->end();
  }
}

const Command& ModelLoop::cycle(const RobotState& state) {
  if (is_over_) {
    throw std::runtime_error("loop: the run is over: " + report().why);
  }
  if (state.q.size() != controller_.num_coordinates() || state.v.size() != controller_.num_coordinates()) {
    throw std::invalid_argument("loop: the state has " + std::to_string(state.q.size()) + " positions and " +
                                std::to_string(state.v.size()) + " velocities, the arm has " +
                                std::to_string(controller_.num_coordinates()) + " joints");
  }
  const Controller::ClaimedController use(controller_);
  model_->given = &state;
  if (!std::exchange(has_begun_, true)) {
    controller_.restart();
    cycle_->begin();
  }
  if (!cycle_->run()) {
    is_over_ = true;
    cycle_->end();
  }
  return controller_.command();
}

void ModelLoop::stop(RunEnd end, const std::string& why) noexcept { cycle_->stop(end, why); }

RunReport ModelLoop::report() const { return cycle_->report(); }

}  // namespace sidestep

#pragma once

#include <memory>
#include <string>

#include "sidestep/controller/controller.hpp"
#include "sidestep/loop/loop_settings.hpp"
#include "sidestep/loop/robot_state.hpp"
#include "sidestep/loop/run_report.hpp"

namespace sidestep {

class LoopCycle;

/// Runs a Controller on a model that its caller moves: the cycle of a Loop once per call, in the caller's thread, in the model's own time.
///
/// A model shows what the controller does in any state, so nothing is checked before its first motion. The controller is free for others
/// between two cycles.
class ModelLoop {
 public:
  /// Settings under which nothing ends a run but `stop`, or a time that jumps by more than 10 s.
  static LoopSettings usual_settings() noexcept;

  /// All that is given must outlive this. Throws std::invalid_argument that names a wrong setting.
  explicit ModelLoop(Controller& controller, const LoopSettings& settings = usual_settings());
  ~ModelLoop();
  ModelLoop(const ModelLoop&) = delete;
  ModelLoop& operator=(const ModelLoop&) = delete;

  /// One cycle at a state; the command. The first one begins the run, as Loop::start does. Throws std::runtime_error once the run is over,
  /// and while the controller is in use.
  const Command& cycle(const RobotState& state);
  /// Ends the run: brings the arm to rest first, in the cycles that follow; the first reason counts.
  void stop(RunEnd end = RunEnd::stopped, const std::string& why = {}) noexcept;
  bool is_over() const noexcept { return is_over_; }
  /// Of the run, once it is over; before, why it is ending.
  RunReport report() const;

 private:
  class Model;

  Controller& controller_;
  const std::unique_ptr<Model> model_;
  const std::unique_ptr<LoopCycle> cycle_;
  bool has_begun_ = false, is_over_ = false;
};

}  // namespace sidestep

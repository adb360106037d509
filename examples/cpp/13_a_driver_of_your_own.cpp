// A driver of your own in C++: an arm in the loop of the core, at 1 kHz, with one way to stop.
//     sidestep prepare fr3 -o fr3.arm && build/example/13_a_driver_of_your_own fr3.arm
// Exit code 0 if the arm arrives. The robot is made here: it takes velocities, and lags behind them by 5 ms.
#include <cstdio>
#include <sidestep/sidestep.hpp>

class LaggingRobot final : public sidestep::Driver {
 public:
  explicit LaggingRobot(const sidestep::Arm& arm) : state_(arm.num_coordinates()), told_(state_.v) {
    about_.name = "lagging robot";
    about_.joints = arm.robot().coordinate_names();
    about_.outputs = {sidestep::ControllerSettings::Output::velocity};
    about_.paced = false;  // the loop keeps the period
    about_.when_silent = "it keeps its velocity";
    state_.q = arm.neutral();
  }
  const sidestep::RobotDescription& description() const noexcept override { return about_; }
  void start(sidestep::ControllerSettings::Output) override {}
  sidestep::DriverResult read(sidestep::RobotState& state, double) noexcept override {
    state_.v += about_.period / 0.005 * (told_ - state_.v);
    state_.q += about_.period * state_.v;
    state = state_;
    return sidestep::DriverResult::ok;
  }
  sidestep::DriverResult write(const sidestep::Command& command) noexcept override {
    told_ = command.velocity;
    return sidestep::DriverResult::ok;
  }
  void stop() noexcept override { told_.setZero(); }
  std::string trouble() const override { return {}; }

 private:
  sidestep::RobotDescription about_;
  sidestep::RobotState state_;
  Eigen::VectorXd told_;
};

int main(int argc, char** argv) {
  const sidestep::Arm arm = sidestep::Arm::load(argc > 1 ? argv[1] : "fr3.arm");
  sidestep::Controller controller(arm, {.output = sidestep::ControllerSettings::Output::velocity});
  controller.set_obstacles({Eigen::Vector3d(0.6, 0.3, 0.6), Eigen::VectorXd::Constant(1, 0.05), Eigen::Vector3d::Zero()});
  controller.set_goal(arm.neutral() + Eigen::VectorXd::Constant(7, 0.3));
  LaggingRobot robot(arm);
  sidestep::Loop loop(controller, robot, {.duration = 20.0, .until_arrived = true});
  loop.start();
  const sidestep::RunReport& report = loop.finish();
  std::printf("%s: %s, %s\n", sidestep::to_string(report.end), report.why.c_str(), report.scheduling.c_str());
  return report.end == sidestep::RunEnd::arrived ? 0 : 1;
}

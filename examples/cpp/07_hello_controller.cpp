// The controller in a program of your own: an arm file, a goal, an obstacle, and a loop at 1 kHz. No Python at run time.
//     sidestep prepare fr3 -o fr3.arm && build/example/07_hello_controller fr3.arm
// Exit code 0 if the arm arrives. `step` allocates nothing: cpp/tests/controller/step_test.cpp counts.
#include <chrono>
#include <cstdio>
#include <sidestep/sidestep.hpp>
#include <thread>

int main(int argc, char** argv) {
  const sidestep::Arm arm = sidestep::Arm::load(argc > 1 ? argv[1] : "fr3.arm");
  sidestep::Controller controller(arm);
  Eigen::VectorXd q = arm.neutral(), v = Eigen::VectorXd::Zero(arm.num_coordinates());
  controller.set_goal(q + Eigen::VectorXd::Constant(q.size(), 0.3));
  controller.set_obstacles({Eigen::Vector3d(0.6, 0.3, 0.6), Eigen::VectorXd::Constant(1, 0.05), Eigen::Vector3d::Zero()});
  const sidestep::Command& command = controller.command();
  auto due = std::chrono::steady_clock::now();
  for (int k = 0; k < 10000 && controller.step(q, v).activity != sidestep::Activity::arrived; ++k) {
    v = command.velocity;  // an ideal robot: it tracks the command exactly; send command.torque to an arm
    q = command.position;
    std::this_thread::sleep_until(due += std::chrono::milliseconds(1));
  }
  std::printf("%s, clearance %s\n", controller.explain().c_str(), command.clearance > 0.0 ? "kept" : "lost");
  return command.activity == sidestep::Activity::arrived ? 0 : 1;
}

// The controller in a program of your own: an arm file, a goal, an obstacle, and a loop at 1 kHz. No Python at run time.
//     sidestep prepare fr3 -o fr3.arm && build/example/07_hello_controller fr3.arm
#include <cstdio>
#include <sidestep/sidestep.hpp>

int main(int, char** argv) {
  const sidestep::Arm arm = sidestep::Arm::load(argv[1]);
  sidestep::Controller controller(arm);
  Eigen::VectorXd q = arm.neutral(), v = Eigen::VectorXd::Zero(arm.num_coordinates());
  controller.set_goal(q + Eigen::VectorXd::Constant(q.size(), 0.3));
  controller.set_obstacles({Eigen::Vector3d(0.6, 0.3, 0.6), Eigen::VectorXd::Constant(1, 0.05), Eigen::Vector3d::Zero()});
  int steps = 0;
  while (steps < 10000 && controller.step(q, v).activity != sidestep::Activity::arrived) {
    v = controller.command().velocity;  // a model that does what it is told; send command().torque to an arm
    q = controller.command().position;
    ++steps;
  }
  std::printf("%s, clearance %s\n", controller.explain().c_str(), controller.command().clearance > 0.0 ? "kept" : "lost");
}

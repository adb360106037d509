// A filter of velocities: whatever velocity you send, the arm avoids the ball; without new ones it stops.
//     sidestep prepare fr3 -o fr3.arm && build/example/08_filter_of_velocities fr3.arm
// Exit code 0 if nothing was touched.
#include <algorithm>
#include <sidestep/sidestep.hpp>

int main(int argc, char** argv) {
  const sidestep::Arm arm = sidestep::Arm::load(argc > 1 ? argv[1] : "fr3.arm");
  sidestep::Controller controller(arm);
  controller.set_obstacles({Eigen::Vector3d(0.3, 0.55, 0.6), Eigen::VectorXd::Constant(1, 0.1), Eigen::Vector3d::Zero()});
  Eigen::VectorXd q = arm.neutral(), v = Eigen::VectorXd::Zero(q.size());
  double least = 1.0;
  for (int k = 0; k < 4000; ++k) {
    controller.set_velocity(0.5 * Eigen::VectorXd::Unit(q.size(), 0));  // at any rate, from any thread; counts for 0.25 s
    const sidestep::Command& command = controller.step(q, v);           // command.torque goes to an arm
    q = command.position, v = command.velocity, least = std::min(least, command.clearance);
  }
  return least > 0.0 ? 0 : 1;
}

// A trajectory, of a policy or another planner: kept to, and waited on while something blocks it.
//     sidestep prepare fr3 -o fr3.arm && build/example/10_trajectory_of_a_policy fr3.arm
// Exit code 0 if it arrives.
#include <sidestep/sidestep.hpp>

int main(int argc, char** argv) {
  const sidestep::Arm arm = sidestep::Arm::load(argc > 1 ? argv[1] : "fr3.arm");
  sidestep::Controller controller(arm);
  controller.set_obstacles(sidestep::Obstacles::none());  // the space is free
  Eigen::VectorXd q = arm.neutral(), v = Eigen::VectorXd::Zero(q.size());
  Eigen::MatrixXd chunk(q.size(), 2);
  chunk << q, q + Eigen::VectorXd::Constant(q.size(), 0.3);
  controller.set_trajectory(chunk, Eigen::Vector2d(0.0, 2.0));  // or TrajectoryBehaviour::steer: around what is in the way
  for (int k = 0; k < 4000 && controller.step(q, v).activity != sidestep::Activity::arrived; ++k) {
    q = controller.command().position, v = controller.command().velocity;  // controller.command().torque goes to an arm
  }
  return controller.command().activity == sidestep::Activity::arrived ? 0 : 1;
}

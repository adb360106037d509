// The controller as a filter, in a program of your own: of velocities, of a twist, of a trajectory.
//     sidestep prepare fr3 -o fr3.arm && build/example/08_inputs fr3.arm
// Exit code 0 if the trajectory arrives. Each is a hello world of its own: arm, controller, order, loop.
#include <cstdio>
#include <sidestep/sidestep.hpp>

using sidestep::Controller;

/// Steps at 1 kHz; send command.torque to an arm. Here a model does what it is told.
void run(Controller& controller, Eigen::VectorXd& q, Eigen::VectorXd& v, int steps) {
  for (int k = 0; k < steps; ++k) {
    const sidestep::Command& command = controller.step(q, v);
    q = command.position;
    v = command.velocity;
  }
  std::printf("%s\n", controller.explain().c_str());
}

int main(int argc, char** argv) {
  const sidestep::Arm arm = sidestep::Arm::load(argc > 1 ? argv[1] : "fr3.arm");
  Eigen::VectorXd q = arm.neutral(), v = Eigen::VectorXd::Zero(arm.num_coordinates());

  Controller controller(arm);
  controller.set_velocity(Eigen::VectorXd::Constant(q.size(), 0.1));  // counts for 0.25 s: tell it again and again
  run(controller, q, v, 200);

  sidestep::Vector6d twist;
  twist << 0.0, 0.1, 0.0, 0.0, 0.0, 0.2;  // m/s and rad/s, of the world
  controller.set_twist("fr3_hand_tcp", twist);
  run(controller, q, v, 200);

  Eigen::MatrixXd chunk(q.size(), 2);
  chunk << q, arm.neutral();
  controller.set_trajectory(chunk, Eigen::Vector2d(0.0, 1.0));  // or TrajectoryBehaviour::steer
  run(controller, q, v, 3000);
  return controller.command().activity == sidestep::Activity::arrived ? 0 : 1;
}

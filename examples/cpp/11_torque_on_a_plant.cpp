// Torque for an arm that is not as its model: dry friction and rotors, which the controller finds out about.
//     sidestep prepare fr3 -o fr3.arm && build/example/11_torque_on_a_plant fr3.arm
// Exit code 0 if it arrives.
#include <sidestep/sidestep.hpp>

int main(int argc, char** argv) {
  const sidestep::Arm arm = sidestep::Arm::load(argc > 1 ? argv[1] : "fr3.arm");
  sidestep::Controller controller(arm);
  controller.set_obstacles(sidestep::Obstacles::none());  // the space is free
  Eigen::VectorXd q = arm.neutral(), v = Eigen::VectorXd::Zero(7), h = v;
  Eigen::MatrixXd M(7, 7);
  sidestep::RigidBodyDynamics::Workspace workspace(arm.dynamics());
  controller.set_goal(q + Eigen::VectorXd::Constant(7, 0.3));
  for (int k = 0; k < 10000 && controller.step(q, v).activity != sidestep::Activity::arrived; ++k) {
    arm.dynamics().mass_matrix(q, workspace, M), arm.dynamics().bias(q, v, workspace, h);
    h += (v / 0.01).array().tanh().matrix();  // friction of 1 Nm; and rotors of 0.1 kg m²
    q += 0.001 * (v += 0.001 * (M + 0.1 * Eigen::MatrixXd::Identity(7, 7)).ldlt().solve(controller.command().torque - h));
  }
  return controller.command().activity == sidestep::Activity::arrived ? 0 : 1;
}

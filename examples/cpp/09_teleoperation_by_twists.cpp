// Teleoperation: the twist of the hand, 0.1 m/s along y and a turn about the vertical.
//     sidestep prepare fr3 -o fr3.arm && build/example/09_teleoperation_by_twists fr3.arm
// Exit code 0 if the hand has its twist at the end, within 5 mm/s and 5 mrad/s.
#include <sidestep/sidestep.hpp>

int main(int argc, char** argv) {
  const sidestep::Arm arm = sidestep::Arm::load(argc > 1 ? argv[1] : "fr3.arm");
  sidestep::Controller controller(arm);
  controller.set_obstacles(sidestep::Obstacles::none());  // the space is free
  Eigen::VectorXd q = arm.neutral(), v = Eigen::VectorXd::Zero(q.size());
  const sidestep::Vector6d twist = (sidestep::Vector6d() << 0.0, 0.1, 0.0, 0.0, 0.0, 0.2).finished();  // of the world
  for (int k = 0; k < 1000; ++k) {
    controller.set_twist("fr3_hand_tcp", twist);
    q = controller.step(q, v).position, v = controller.command().velocity;  // controller.command().torque goes to an arm
  }
  sidestep::KinematicState state(arm.robot());
  state.update(arm.robot(), q, v);
  const int hand = arm.robot().frame_index("fr3_hand_tcp");
  return (sidestep::frame_jacobian(arm.robot(), state, hand) * v - twist).cwiseAbs().maxCoeff() < 0.005 ? 0 : 1;
}

// A depth camera in a program of your own: its images become obstacles, without the arm and with what it hides.
//     sidestep prepare fr3 -o fr3.arm && build/example/12_camera fr3.arm
// Exit code 0 if the arm arrives. The image is made here: something 30 cm wide beside the arm, and nothing else.
#include <cstdio>
#include <sidestep/sidestep.hpp>

int main(int argc, char** argv) {
  const sidestep::Arm arm = sidestep::Arm::load(argc > 1 ? argv[1] : "fr3.arm");
  sidestep::Controller controller(arm);
  sidestep::DepthCamera camera{.name = "front", .width = 424, .height = 240, .fx = 210, .fy = 210, .cx = 211.5, .cy = 119.5};
  camera.pose.linear() << 0, 0, -1, 1, 0, 0, 0, -1, 0;  // of the optical frame: x right, y down, z forward
  camera.pose.translation() << 2.0, 0.0, 0.6;           // [m] in the world
  sidestep::Perception perception(controller, {camera});
  controller.set_goal(arm.neutral() + Eigen::VectorXd::Constant(7, 0.3));
  std::vector<std::uint16_t> depth(424 * 240, 0);  // [mm] of your driver; 0: nothing seen
  for (std::size_t v = 100; v < 140; ++v) {
    std::fill_n(depth.begin() + static_cast<std::ptrdiff_t>(424 * v + 310), 40, std::uint16_t{1500});
  }
  Eigen::VectorXd q = arm.neutral(), v = Eigen::VectorXd::Zero(7);
  sidestep::PerceptionReport report;
  for (int k = 0; k < 10000 && controller.step(q, v, 0.001 * k).activity != sidestep::Activity::arrived; ++k) {
    if (k % 33 == 0) {  // 30 images a second; from any thread, `step` waits for none
      report = perception.update("front", {std::span<const std::uint16_t>(depth)}, {.time = 0.001 * k});
    }
    q = controller.command().position, v = controller.command().velocity;  // an ideal robot: it tracks the command exactly
  }
  std::printf("%s, %d obstacles seen\n", controller.explain().c_str(), report.seen);
  return controller.command().activity == sidestep::Activity::arrived && report.seen > 0 ? 0 : 1;
}

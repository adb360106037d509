// The cameras, and the arm in front of them.
#include <stdexcept>
#include <utility>

#include "impl.hpp"

namespace sidestep {
Perception::Impl::View::View(const DepthCamera& its, const Arm& arm, int steady_images)
    : camera(its),
      rays(its),
      image(its),
      steady(its, steady_images),
      mask(arm.robot(), arm.body()),
      frame_of_arm(its.link.empty() ? -1 : arm.robot().frame_index(its.link)),
      depth(image.depth()),
      X_WC(its.pose),
      shown_X_WC(its.pose) {}

Perception::Impl::Impl(Controller& its, const std::vector<DepthCamera>& cameras, const PerceptionSettings& chosen)
    : controller(its),
      settings(chosen),
      arm(its.arm()),
      zero(Eigen::VectorXd::Zero(arm->num_coordinates())),
      before(arm->robot()),
      now(arm->robot()),
      after(arm->robot()),
      reach(reach_of(*arm)),
      map(reach.centre, reach.radius, chosen) {
  views.reserve(cameras.size());
  for (const DepthCamera& camera : cameras) {
    views.emplace_back(camera, *arm, settings.steady_images);
  }
  if (!settings.unseen_is_free) {
    unseen.emplace(reach.centre, reach.radius, settings);
  }
}

std::size_t Perception::Impl::index(const std::string& camera) const {
  std::string names;
  for (std::size_t n = 0; n < views.size(); ++n) {
    if (views[n].camera.name == camera) {
      return n;
    }
    names += (n == 0 ? "'" : ", '") + views[n].camera.name + "'";
  }
  throw std::invalid_argument("perception: there is no camera '" + camera + "', there are: " + names);
}

void Perception::Impl::refresh_arm() {
  Arm current = controller.arm();
  if (current.content_hash() != arm->content_hash()) {
    arm = std::move(current);
    for (View& view : views) {
      view.mask = ArmMask(arm->robot(), arm->body());
    }
  }
}

Eigen::Isometry3d Perception::Impl::pose_of(const View& view, const KinematicState& state) const {
  return view.frame_of_arm < 0 ? view.camera.pose : frame_pose(arm->robot(), state, view.frame_of_arm) * view.camera.pose;
}

}  // namespace sidestep

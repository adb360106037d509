#include "sidestep/perception/perception.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "impl.hpp"

namespace sidestep {
namespace {

constexpr double least_valid_share = 0.01;      // Share of pixels with a depth, below which an image shows nothing at all.
constexpr double smoothing_time = 0.5;          // Time constant of the share of rays that see through the arm [s].
constexpr double through_share_at_most = 0.25;  // The same, above which the arm is not where it should be.
constexpr double sees_nothing_of_arm = 0.9;     // The same, of one image, above which it is not used.
constexpr int least_rays = 60;                  // Rays through the arm from which on it can be told.
constexpr double future = 0.5;  // Time by which an image may be newer than the last step before that is worth a word [s].

constexpr const char* sees_nothing = "' sees nothing: fewer than 1 % of its pixels have a depth; the image is not used";
constexpr const char* sees_through_arm =
    "': its image sees through the arm and is not used; check the unit of depth, the camera's pose and the times of its images";

using Clock = std::chrono::steady_clock;
double since(Clock::time_point& mark) noexcept {
  const Clock::time_point now = Clock::now();
  return std::chrono::duration<double>(now - std::exchange(mark, now)).count();
}

/// Whether an image shows nothing of an arm that it should show: one of another unit, place or time, which says nothing of what is free.
bool sees_through(const ArmResidual& arm) noexcept {
  return arm.rays >= least_rays && arm.through_share() > sees_nothing_of_arm;
}

void count_pixels(const DepthImage& image, PerceptionReport& report) noexcept {
  report.obstacle_pixels = image.count(PixelLabel::obstacle);
  report.arm_pixels = image.count(PixelLabel::arm);
  report.edge_pixels = image.count(PixelLabel::edge);
}

}  // namespace

Perception::Perception(Controller& controller, std::vector<DepthCamera> cameras, const PerceptionSettings& settings)
    : cameras_(std::move(cameras)), settings_(settings) {
  settings_.validate();
  if (cameras_.empty() || cameras_.size() > most_cameras) {
    throw std::invalid_argument("perception: there are " + std::to_string(cameras_.size()) + " cameras, allowed: 1 to " +
                                std::to_string(most_cameras));
  }
  for (std::size_t n = 0; n < cameras_.size(); ++n) {
    const DepthCamera& camera = cameras_[n];
    camera.validate();
    if (camera.name == memory_source || camera.name == unseen_source || camera.name == SourceOptions::scene) {
      throw std::invalid_argument("camera '" + camera.name +
                                  "': the name is that of a source, allowed: others than 'memory', 'unseen' and 'scene'");
    }
    for (std::size_t m = 0; m < n; ++m) {
      if (cameras_[m].name == camera.name) {
        throw std::invalid_argument("perception: two cameras have the name '" + camera.name + "', allowed: a name each");
      }
    }
  }
  impl_ = std::make_unique<Impl>(controller, cameras_, settings_);
  std::vector<std::string> names;
  std::transform(cameras_.begin(), cameras_.end(), std::back_inserter(names), [](const DepthCamera& its) { return its.name; });
  controller.expect_obstacles(names);
}
Perception::~Perception() = default;

const DepthCamera& Perception::camera(const std::string& name) const { return cameras_[impl_->index(name)]; }

PerceptionReport Perception::update(const std::string& camera, const RawDepth& depth, const Capture& capture) {
  const std::lock_guard lock(impl_->mutex);
  return impl_->update(impl_->index(camera), capture,
                       [&](const DepthCamera& its, DepthImage& image) { image.take(its, depth); });
}

PerceptionReport Perception::update(const std::string& camera, const Eigen::Matrix3Xd& points, const Capture& capture) {
  const std::lock_guard lock(impl_->mutex);
  return impl_->update(impl_->index(camera), capture,
                       [&](const DepthCamera& its, DepthImage& image) { image.take(its, points); });
}

template <class Take>
PerceptionReport Perception::Impl::update(std::size_t number, const Capture& capture, Take&& take) {
  View& view = views[number];
  const double time = capture.time;
  if (!std::isfinite(time)) {
    throw std::invalid_argument("camera '" + view.camera.name + "': time is " + std::to_string(time) +
                                ", allowed: seconds on the clock of step, when the image was captured");
  }
  PerceptionReport report;
  refresh_arm();
  if (!find_arm(view, time, capture.q, report)) {
    return report;
  }
  Clock::time_point mark = Clock::now();
  take(view.camera, view.image);
  report.depth_time = since(mark);
  // An image that is not used is still masked: its labels are shown, and must not call the arm an obstacle.
  const bool is_blind =
      view.image.count(PixelLabel::nothing) > (1.0 - least_valid_share) * static_cast<double>(view.image.size());
  const auto placed = [&](const KinematicState& state) {
    return ArmInView{state, capture.pose.value_or(pose_of(view, state))};
  };
  const Eigen::Isometry3d X_WC = view.shown_X_WC = placed(now).X_WC;
  view.mask.mark(view.camera, view.rays, placed(before), placed(now), placed(after), view.image);
  report.mask_time = since(mark);
  report.arm = view.mask.residual();
  count_pixels(view.image, report);
  if (is_blind || sees_through(report.arm)) {
    report.question = "camera '" + view.camera.name + (is_blind ? sees_nothing : sees_through_arm);
    return report;
  }
  view.stands_still = view.camera.link.empty() && !capture.pose;
  if (view.stands_still && settings.steady_images > 1) {
    view.steady.add(view.camera, view.image);
    view.depth = view.steady.depth();
  } else {
    view.depth = view.image.depth();
  }
  const SeenImage seen{
      view.camera, view.rays, X_WC, view.image, view.depth, view.mask.front(), static_cast<std::uint8_t>(number), time};
  map.add(seen);
  report.map_time = since(mark);
  if (unseen) {
    add_unseen(seen);
  }
  report.unseen_time = since(mark);
  view.X_WC = X_WC;
  view.before = view.time;
  view.time = time;
  view.begin = std::isnan(view.begin) ? time : view.begin;
  judge(view, report);
  hand_over(seen, report);
  report.obstacles_time = since(mark);
  report.used = true;
  return report;
}

bool Perception::Impl::find_arm(const View& view, double time, const Eigen::VectorXd& q, PerceptionReport& report) {
  const Robot& robot = arm->robot();
  if (q.size() != 0) {
    if (q.size() != robot.num_coordinates() || !q.allFinite()) {
      throw std::invalid_argument("perception: q has " + std::to_string(q.size()) +
                                  " entries, allowed: " + std::to_string(robot.num_coordinates()) + ", all finite");
    }
    for (KinematicState* const state : {&before, &now, &after}) {
      state->update(robot, q, zero);
    }
    return true;
  }
  const StateHistory& history = controller.history();
  const double last = history.last_time(), error = view.camera.clock_error;
  Eigen::VectorXd at(zero.size()), earlier(zero.size()), later(zero.size());
  if (!history.at(time, at)) {
    report.question = "camera '" + view.camera.name + "': nobody knows where the arm was at " + std::to_string(time) +
                      " s; the clock of step " + (std::isnan(last) ? "has not begun" : "is at " + std::to_string(last) + " s") +
                      ", and it remembers the last " + std::to_string(StateHistory::capacity) + " steps";
    return false;
  }
  if (time > last + future) {
    report.question = "camera '" + view.camera.name + "': its image was captured at " + std::to_string(time) +
                      " s, later than the last step at " + std::to_string(last) + " s: give both the same clock";
    return false;
  }
  if (!history.at(time - error, earlier)) {
    earlier = at;
  }
  history.at(time + error, later);
  if (time + error > last) {  // after the last step the arm goes on as before
    later = at + (at - earlier);
  }
  before.update(robot, earlier, zero);
  now.update(robot, at, zero);
  after.update(robot, later, zero);
  return true;
}

void Perception::Impl::judge(View& view, PerceptionReport& report) const {
  if (report.arm.rays >= least_rays) {
    const double share =
        std::isnan(view.judged) ? 1.0 : 1.0 - std::exp(-std::max(0.0, view.time - view.judged) / smoothing_time);
    view.through += share * (report.arm.through_share() - view.through);
    view.judged = view.time;
  }
  report.through = view.through;
  if (view.through > through_share_at_most) {
    report.question =
        "camera '" + view.camera.name + "': the arm is not where q says, " +
        std::to_string(static_cast<int>(std::lround(100.0 * view.through))) +
        " % of the rays that should meet it pass; check the camera's pose and the times of its images (sidestep camera check)";
  }
}

void Perception::leave_out(const std::string& name, const Obstacles& region, double grow, const std::string& link) {
  const std::lock_guard lock(impl_->mutex);
  if (name.empty() || region.size() == 0 || !(grow >= 0.0 && grow <= 1.0)) {
    throw std::invalid_argument("leave_out: the name is '" + name + "', the region has " + std::to_string(region.size()) +
                                " balls, grow is " + std::to_string(grow) + " m, allowed: a name, at least one ball, 0 to 1 m");
  }
  const int frame = link.empty() ? -1 : impl_->arm->robot().frame_index(link);
  impl_->drop_region(name);
  impl_->regions.push_back({name, region, grow, frame});
}

void Perception::take_in(const std::string& name) {
  const std::lock_guard lock(impl_->mutex);
  if (!impl_->drop_region(name)) {
    std::string names;
    for (const auto& region : impl_->regions) {
      names += (names.empty() ? "'" : ", '") + region.name + "'";
    }
    throw std::invalid_argument("take_in: there is no region '" + name + "', there " +
                                (names.empty() ? "is none" : "are: " + names));
  }
}

void Perception::forget() {
  const std::lock_guard lock(impl_->mutex);
  impl_->map.clear();
  impl_->tested.clear();
  if (impl_->unseen) {
    impl_->unseen->forget();
    impl_->unseen_time = -std::numeric_limits<double>::infinity();
  }
  for (auto& view : impl_->views) {
    view.begin = std::numeric_limits<double>::quiet_NaN();
    view.motion.forget();
    view.movers.clear();
    view.steady.forget();
  }
}

Eigen::Isometry3d Perception::pose(const std::string& camera) const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->views[impl_->index(camera)].shown_X_WC;
}
std::vector<float> Perception::depth(const std::string& camera) const {
  const std::lock_guard lock(impl_->mutex);
  const DepthImage& image = impl_->views[impl_->index(camera)].image;
  return {image.depth(), image.depth() + image.size()};
}
std::vector<PixelLabel> Perception::labels(const std::string& camera) const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->labels(impl_->views[impl_->index(camera)]);
}
double Perception::time(const std::string& camera) const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->views[impl_->index(camera)].time;
}
std::vector<Perception::Cell> Perception::cells() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->cells();
}
Eigen::Matrix3Xd Perception::unseen() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->border;
}

}  // namespace sidestep

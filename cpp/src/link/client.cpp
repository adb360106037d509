#include "sidestep/link/client.hpp"

#include <algorithm>
#include <cstring>

#include "client_impl.hpp"
#include "controller_requests.hpp"

namespace sidestep::link {

Client::Client(const Address& address, const ClientSettings& settings)
    : impl_(std::make_unique<Impl>(Connection(address), settings)) {}
Client::Client(Descriptor socket, const ClientSettings& settings)
    : impl_(std::make_unique<Impl>(Connection(std::move(socket)), settings)) {}
Client::~Client() = default;
void Client::close() noexcept { impl_->close(); }

const Welcome& Client::welcome() const noexcept { return impl_->welcome; }

void Client::take_command(bool force, bool keep_goal) { impl_->ask(TakeCommand{force, keep_goal}); }
void Client::release_command() { impl_->ask(ReleaseCommand{}); }
bool Client::is_in_command() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->in_command != 0 && impl_->in_command == impl_->welcome.client;
}

std::string Client::set_goal(const Eigen::VectorXd& position) { return impl_->ask(SetJointGoal{position, {}, {}}); }
std::string Client::set_goal(const Goal& goal) {
  if (const auto* joint = std::get_if<JointGoal>(&goal)) {
    return impl_->ask(SetJointGoal{joint->position, joint->velocity, joint->acceleration});
  }
  return impl_->ask(pose_request(std::get<PoseGoal>(goal)));
}
std::string Client::set_velocity(const Eigen::VectorXd& v) { return impl_->ask(SetVelocity{v}); }
std::string Client::set_twist(const std::string& frame, const Vector6d& twist, bool local, bool free_rotation) {
  return impl_->ask(SetTwist{frame, twist, local, free_rotation});
}
std::string Client::set_trajectory(const Eigen::MatrixXd& q, const Eigen::VectorXd& times, TrajectoryBehaviour behaviour) {
  return impl_->ask(SetTrajectory{q, times, behaviour == TrajectoryBehaviour::steer});
}
void Client::clear_goal() { impl_->ask(ClearGoal{}); }
void Client::restart() { impl_->ask(Restart{}); }
void Client::resume() { impl_->ask(Resume{}); }

std::string Client::set_obstacles(const Obstacles& obstacles, const SourceOptions& options) {
  return impl_->ask(SetObstacles{options.source, options.time, options.valid_for, options.as_given, ObstacleSet(obstacles)});
}
std::string Client::add_obstacle(const Obstacles& obstacle, const std::string& source) {
  return impl_->ask(AddObstacle{source, ObstacleSet(obstacle)});
}
std::string Client::move_obstacle(const std::string& name, const Eigen::Isometry3d& pose, const SourceOptions& options) {
  return impl_->ask(MoveObstacle{name, options.source, pose.matrix(), options.time, options.valid_for});
}
void Client::remove_obstacle(const std::string& name, const std::string& source) { impl_->ask(RemoveObstacle{name, source}); }
void Client::remove_obstacles(const std::string& source) { impl_->ask(RemoveObstacles{source}); }
void Client::expect_obstacles(const std::string& source) { impl_->ask(ExpectObstacles{source}); }

void Client::update(const std::string& camera, int width, int height, const RawDepth& depth, double time,
                    const Eigen::Isometry3d* pose) {
  DepthImageMessage image;
  image.camera = camera;
  image.time = time;
  image.unit = depth.unit;
  image.width = static_cast<std::uint32_t>(std::max(width, 0));
  image.height = static_cast<std::uint32_t>(std::max(height, 0));
  std::visit(
      [&image](const auto& pixels) {
        using Pixel = typename std::remove_cvref_t<decltype(pixels)>::value_type;
        image.pixel = std::is_same_v<Pixel, float> ? DepthImageMessage::Pixel::float32 : DepthImageMessage::Pixel::uint16;
        image.pixels.resize(pixels.size_bytes());
        for (std::size_t k = 0; k < pixels.size(); ++k) {
          const Pixel stored = binary::little_endian(pixels[k]);
          std::memcpy(image.pixels.data() + k * sizeof stored, &stored, sizeof stored);
        }
      },
      depth.pixels);
  if (pose != nullptr) {
    image.pose.assign(pose->data(), pose->data() + 16);
  }
  image.check();
  impl_->ask(image);
}

void Client::pause() { impl_->ask(Pause{}); }
void Client::stop_run(const std::string& why) { impl_->ask(StopRun{why}); }
void Client::subscribe(double rate) { impl_->ask(Subscribe{rate}); }

CycleMessage Client::cycle() const {
  CycleMessage found;
  if (!next_cycle(found, 0, impl_->settings.timeout)) {
    throw std::runtime_error("no cycle has come yet: no run is under way, or the rate is zero, see `subscribe`");
  }
  return found;
}

bool Client::next_cycle(CycleMessage& cycle, std::uint64_t after, double timeout) const {
  std::unique_lock lock(impl_->mutex);
  const auto came = [&] { return impl_->newest.cycle > after || !impl_->lost.empty(); };
  if (!impl_->changed.wait_until(lock, deadline_in(timeout), came)) {
    return false;
  }
  if (!impl_->lost.empty()) {
    throw ConnectionLost(impl_->lost);
  }
  cycle = impl_->newest;
  return true;
}

bool Client::wait(const std::function<bool(const CycleMessage&)>& until, double timeout, const Interrupted& interrupted) const {
  const auto deadline = deadline_in(timeout);
  std::uint64_t after = 0;
  bool commands = false;
  {
    const std::lock_guard lock(impl_->mutex);
    after = impl_->followed;
    commands = impl_->in_command == impl_->welcome.client;
  }
  CycleMessage found;
  for (;;) {
    constexpr double look_period = 0.05;  // Longest time between two looks at whether the run goes on [s].
    const double left = time_left(deadline);
    if (next_cycle(found, after, std::min(left, look_period))) {
      if (until(found)) {
        return true;
      }
      after = found.cycle;
    }
    if (interrupted()) {
      return false;
    }
    const std::lock_guard lock(impl_->mutex);
    after = std::max(after, impl_->followed);  // another thread may ask for something meanwhile
    if (!impl_->ended.empty()) {
      throw RunInterrupted("the run has ended: " + impl_->ended);
    }
    if (commands && impl_->in_command != impl_->welcome.client) {
      throw RunInterrupted("this client is in command no more");
    }
    if (left <= 0.0) {
      return false;
    }
  }
}

bool Client::wait_arrived(double timeout) const {
  return wait([](const CycleMessage& cycle) { return cycle.command.activity == Activity::arrived; }, timeout);
}

std::string Client::explain() {
  Explanation explanation;
  impl_->ask(Explain{}, explanation);
  return explanation.words;
}

double Client::ping() {
  const auto began = PollClock::now();
  impl_->ask(Ping{});
  return std::chrono::duration<double>(PollClock::now() - began).count();
}

std::vector<Notice> Client::notices() {
  const std::lock_guard lock(impl_->mutex);
  return std::exchange(impl_->notices, {});
}

}  // namespace sidestep::link

#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "sidestep/attractor/goal.hpp"
#include "sidestep/controller/joint_trajectory.hpp"
#include "sidestep/controller/source.hpp"
#include "sidestep/link/address.hpp"
#include "sidestep/link/descriptor.hpp"
#include "sidestep/link/report_messages.hpp"
#include "sidestep/math/interruption.hpp"
#include "sidestep/perception/depth_image.hpp"
#include "sidestep/scene/obstacles.hpp"

namespace sidestep::link {

struct ClientSettings {
  std::string name = {};   ///< for messages to other clients; empty: a number
  std::string token = {};  ///< of the server; empty: the client only looks
  double rate = 100.0;     ///< of cycles [Hz]; inf: every cycle; 0: none
  double timeout = 2.0;    ///< for an answer [s]
};

/// The server does not answer, or the connection has ended.
class ConnectionLost : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What a client waits for can come no more: the run has ended, or another client has taken the command.
class RunInterrupted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Moves an arm that another program serves: the methods of a Controller, over a connection.
///
/// From any thread; each call waits for its answer. All of them throw std::invalid_argument in the words of the server where it refuses,
/// and ConnectionLost. Those that set something return what is hard to believe in it, see Controller::questions; empty: nothing. A thread
/// of its own receives the newest cycle.
class Client {
 public:
  /// Throws std::system_error where nobody listens, std::invalid_argument where the token is wrong.
  explicit Client(const Address& address, const ClientSettings& settings = {});
  /// Over a stream socket that somebody else has connected, as a bridge does.
  explicit Client(Descriptor socket, const ClientSettings& settings = {});
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Ends the connection; every later call throws ConnectionLost. For one thread, once no other waits for an answer.
  void close() noexcept;
  /// What is served.
  const Welcome& welcome() const noexcept;
  int num_coordinates() const noexcept { return static_cast<int>(welcome().joints.size()); }

  /// Becomes the client that moves the arm. force: also where another one is, which is told. keep_goal: the goal stays when this client
  /// leaves or is lost; else it is cleared, and the arm comes to rest.
  void take_command(bool force = false, bool keep_goal = false);
  void release_command();
  bool is_in_command() const;

  // In command.
  std::string set_goal(const Eigen::VectorXd& position);
  std::string set_goal(const Goal& goal);
  std::string set_velocity(const Eigen::VectorXd& v);
  std::string set_twist(const std::string& frame, const Vector6d& twist, bool local = false, bool free_rotation = false);
  std::string set_trajectory(const Eigen::MatrixXd& q, const Eigen::VectorXd& times,
                             TrajectoryBehaviour behaviour = TrajectoryBehaviour::keep_path);
  void clear_goal();
  void restart();
  void resume();

  // With the token.
  std::string set_obstacles(const Obstacles& obstacles, const SourceOptions& options = {});
  std::string add_obstacle(const Obstacles& obstacle, const std::string& source = SourceOptions::scene);
  std::string move_obstacle(const std::string& name, const Eigen::Isometry3d& pose, const SourceOptions& options = {});
  void remove_obstacle(const std::string& name, const std::string& source = SourceOptions::scene);
  void remove_obstacles(const std::string& source);
  void expect_obstacles(const std::string& source);
  /// An image of a camera of the server, see Perception::update. It is worked on after the answer; see `notices`.
  void update(const std::string& camera, int width, int height, const RawDepth& depth, double time,
              const Eigen::Isometry3d* pose = nullptr);
  void pause();
  void stop_run(const std::string& why = {});

  // For everybody.
  /// How often cycles come [Hz].
  void subscribe(double rate);
  /// State and command of the newest cycle. Throws std::runtime_error where none came within the timeout.
  CycleMessage cycle() const;
  /// The next cycle after number `after`; false: it did not come within `timeout` [s].
  bool next_cycle(CycleMessage& cycle, std::uint64_t after, double timeout) const;
  /// Waits until `until` is true of a cycle that follows the last request of this client; false: not within `timeout` [s], or
  /// interrupted. Throws RunInterrupted where the run has ended or another client is in command now.
  bool wait(const std::function<bool(const CycleMessage&)>& until, double timeout,
            const Interrupted& interrupted = never_interrupted) const;
  /// Waits until the arm has arrived.
  bool wait_arrived(double timeout) const;
  std::string explain();
  /// Time until the server has answered a message without content [s].
  double ping();
  /// What the server has told all clients since the last call.
  std::vector<Notice> notices();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sidestep::link

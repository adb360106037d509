#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "sidestep/link/message.hpp"
#include "sidestep/robot/kinematic_state.hpp"

// From a client to a server: the methods of Controller and Perception, and who is in command. The server answers each by Done, or by
// Refused with the words of the error. Units, frames and meaning are those of Controller's methods of the same names.
namespace sidestep::link {

struct Hello {
  static constexpr MessageInfo info{MessageType::hello, "Hello", Sender::client, 8192,
                                    "The first message of a client. The answer is Welcome."};
  std::string name, token;

  void check() const;
};
void each_field(Of<Hello> auto& m, auto&& visit) {
  visit("name", m.name, "of the client, for messages to others");
  visit("token", m.token, "of the server; empty: the client only looks");
}

struct Subscribe {
  static constexpr MessageInfo info{MessageType::subscribe, "Subscribe", Sender::client, 64,
                                    "How often the client is sent CycleMessage. For everybody."};
  double rate = 0.0;

  void check() const;
};
void each_field(Of<Subscribe> auto& m, auto&& visit) {
  visit("rate", m.rate, "[Hz], at most every cycle; inf: every cycle; 0: never");
}

struct TakeCommand {
  static constexpr MessageInfo info{MessageType::take_command, "TakeCommand", Sender::client, 64,
                                    "The client wants to be the one that moves the arm. With the token."};
  bool force = false, keep_goal = false;
};
void each_field(Of<TakeCommand> auto& m, auto&& visit) {
  visit("force", m.force, "also where another client is in command, which is told");
  visit("keep_goal", m.keep_goal,
        "the goal stays when this client leaves or is lost; else it is cleared, and the arm comes to rest");
}

struct ReleaseCommand {
  static constexpr MessageInfo info{MessageType::release_command, "ReleaseCommand", Sender::client, 64,
                                    "The client in command is it no more."};
};
void each_field(Of<ReleaseCommand> auto&, auto&&) {}

struct SetJointGoal {
  static constexpr MessageInfo info{MessageType::set_joint_goal, "SetJointGoal", Sender::client, joint_vectors(3),
                                    "As Controller.set_goal. In command."};
  Eigen::VectorXd position, velocity, acceleration;
};
void each_field(Of<SetJointGoal> auto& m, auto&& visit) {
  visit("position", m.position, "(nv) [rad | m]");
  visit("velocity", m.velocity, "(nv) [rad/s | m/s]; empty: at rest");
  visit("acceleration", m.acceleration, "(nv) [rad/s² | m/s²]; empty: zero");
}

/// The pose that one frame is to have.
struct PoseTarget {
  std::string frame;
  Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();  ///< X_WF
  Vector6d twist = Vector6d::Zero();                   ///< of the moving pose, in the world [m/s], [rad/s]
  bool position_only = false;
  Eigen::VectorXd rest;  ///< (nv); empty: none
  double posture_stiffness = 0.0;
};
void describe(auto& archive, Of<PoseTarget> auto& p) {
  archive(p.frame, p.pose, p.twist, p.position_only, p.rest, p.posture_stiffness);
}

struct SetPoseGoal {
  static constexpr MessageInfo info{MessageType::set_pose_goal, "SetPoseGoal", Sender::client, 65536,
                                    "As Controller.set_goal. In command."};
  std::vector<PoseTarget> targets;

  void check() const;
};
void each_field(Of<SetPoseGoal> auto& m, auto&& visit) {
  visit(
      "targets", m.targets,
      "list of: frame (text), pose X_WF (4 × 4), twist (6), position_only (bool), rest (nv or empty), posture_stiffness (float64)");
}

struct SetVelocity {
  static constexpr MessageInfo info{MessageType::set_velocity, "SetVelocity", Sender::client, joint_vectors(1),
                                    "As Controller.set_velocity. In command."};
  Eigen::VectorXd velocity;
};
void each_field(Of<SetVelocity> auto& m, auto&& visit) { visit("velocity", m.velocity, "(nv) [rad/s | m/s]"); }

struct SetTwist {
  static constexpr MessageInfo info{MessageType::set_twist, "SetTwist", Sender::client, 8192,
                                    "As Controller.set_twist. In command."};
  std::string frame;
  Vector6d twist = Vector6d::Zero();
  bool local = false, free_rotation = false;

  void check() const;
};
void each_field(Of<SetTwist> auto& m, auto&& visit) {
  visit("frame", m.frame, "of the arm");
  visit("twist", m.twist, "(6) velocity of its origin [m/s], angular velocity [rad/s]");
  visit("local", m.local, "in the axes of the frame; else of the world");
  visit("free_rotation", m.free_rotation, "the frame may turn as it likes");
}

struct SetTrajectory {
  static constexpr MessageInfo info{MessageType::set_trajectory, "SetTrajectory", Sender::client, 8 << 20,
                                    "As Controller.set_trajectory. In command."};
  Eigen::MatrixXd q;
  Eigen::VectorXd times;
  bool steer = false;
};
void each_field(Of<SetTrajectory> auto& m, auto&& visit) {
  visit("q", m.q, "(nv × K) [rad | m], column by column");
  visit("times", m.times, "(K) [s] after the next step");
  visit("steer", m.steer, "goes around what is in the way; else waits");
}

struct ClearGoal {
  static constexpr MessageInfo info{MessageType::clear_goal, "ClearGoal", Sender::client, 64,
                                    "As Controller.clear_goal. In command."};
};
void each_field(Of<ClearGoal> auto&, auto&&) {}

struct Restart {
  static constexpr MessageInfo info{MessageType::restart, "Restart", Sender::client, 64, "As Controller.restart. In command."};
};
void each_field(Of<Restart> auto&, auto&&) {}

struct Pause {
  static constexpr MessageInfo info{MessageType::pause, "Pause", Sender::client, 64,
                                    "The arm comes to rest; its goal is kept. With the token."};
};
void each_field(Of<Pause> auto&, auto&&) {}

struct Resume {
  static constexpr MessageInfo info{MessageType::resume, "Resume", Sender::client, 64,
                                    "The arm goes on after Pause, or after a run has ended. In command."};
};
void each_field(Of<Resume> auto&, auto&&) {}

struct StopRun {
  static constexpr MessageInfo info{MessageType::stop_run, "StopRun", Sender::client, 8192,
                                    "The arm comes to rest, and the run ends. With the token."};
  std::string words;

  void check() const;
};
void each_field(Of<StopRun> auto& m, auto&& visit) { visit("words", m.words, "why"); }

struct Explain {
  static constexpr MessageInfo info{MessageType::explain, "Explain", Sender::client, 64,
                                    "As Controller.explain. The answer is Explanation. For everybody."};
};
void each_field(Of<Explain> auto&, auto&&) {}

struct Ping {
  static constexpr MessageInfo info{MessageType::ping, "Ping", Sender::client, 64, "Is answered by Done. For everybody."};
};
void each_field(Of<Ping> auto&, auto&&) {}

}  // namespace sidestep::link

// What the messages of clients lead to, and who may send them.
#include <algorithm>
#include <stdexcept>

#include "../controller/recording_content.hpp"
#include "../loop/real_time_thread.hpp"
#include "controller_requests.hpp"
#include "server_impl.hpp"
#include "sidestep/link/token.hpp"

namespace sidestep::link {
namespace {

/// Requests that move the arm: for the client in command.
template <class M>
constexpr bool moves = std::is_same_v<M, SetJointGoal> || std::is_same_v<M, SetPoseGoal> || std::is_same_v<M, SetVelocity> ||
                       std::is_same_v<M, SetTwist> || std::is_same_v<M, SetTrajectory> || std::is_same_v<M, ClearGoal> ||
                       std::is_same_v<M, Restart> || std::is_same_v<M, Resume>;
/// Requests for everybody.
template <class M>
constexpr bool looks = std::is_same_v<M, Hello> || std::is_same_v<M, Subscribe> || std::is_same_v<M, Ping>;

}  // namespace

void Server::Impl::handle(Session& session, const RawMessage& raw) {
  try {
    if (!session.said_hello && raw.header.type != MessageType::hello) {
      throw std::invalid_argument("the first message of a client must be Hello");
    }
    dispatch(session, raw);
  } catch (const std::exception& error) {  // the controller's words, or those of a check
    session.tell(Refused{error.what()}, raw.header.sequence);
  }
}

template <Message M>
void Server::Impl::carry_out(Session& session, const RawMessage& raw) {
  M request;
  decode(raw.payload, request);
  if constexpr (moves<M>) {
    require_command(session);
  } else if constexpr (!looks<M>) {
    require_token(session);
  }
  std::string words;
  if constexpr (requires { apply(controller_, request); }) {
    words = apply(controller_, request);
  } else if constexpr (std::is_same_v<M, Subscribe>) {
    subscribe(session, request);
  } else if constexpr (std::is_same_v<M, TakeCommand>) {
    take_command(session, request);
  } else if constexpr (std::is_same_v<M, ReleaseCommand>) {
    require_command(session);
    leave_command(session.info.name + " has released it");
  } else if constexpr (std::is_same_v<M, Pause>) {
    controller_.pause();
  } else if constexpr (std::is_same_v<M, Resume>) {
    controller_.resume();
    if (run_ && run_->kind == Notice::Kind::run_ended) {  // of nothing that goes on
      const std::lock_guard lock(shared);
      stop_asked.reset();
    }
    resume_asked.store(true);
  } else if constexpr (std::is_same_v<M, StopRun>) {
    const std::lock_guard lock(shared);
    stop_asked = session.info.name + " asked for it" + (request.words.empty() ? "" : ": " + request.words);
  } else if constexpr (std::is_same_v<M, DepthImageMessage>) {
    if (!images_) {
      throw std::invalid_argument("this server has no cameras: images are of no use to it");
    }
    images_->put(std::move(request), session.info.number);
  } else {
    static_assert(std::is_same_v<M, Ping>);
  }
  session.tell(Done{cycles_.load(std::memory_order_acquire), words}, raw.header.sequence);
}

void Server::Impl::dispatch(Session& session, const RawMessage& raw) {
  switch (raw.header.type) {
    case MessageType::hello: {
      Hello hello;
      decode(raw.payload, hello);
      say_hello(session, hello, raw.header.sequence);
      break;
    }
    case MessageType::explain: {
      Explain request;
      decode(raw.payload, request);
      session.asks_explanation = true;
      session.explain_sequence = raw.header.sequence;
      session.asked = monotonic_time();
      break;
    }
    case MessageType::subscribe: carry_out<Subscribe>(session, raw); break;
    case MessageType::take_command: carry_out<TakeCommand>(session, raw); break;
    case MessageType::release_command: carry_out<ReleaseCommand>(session, raw); break;
    case MessageType::set_joint_goal: carry_out<SetJointGoal>(session, raw); break;
    case MessageType::set_pose_goal: carry_out<SetPoseGoal>(session, raw); break;
    case MessageType::set_velocity: carry_out<SetVelocity>(session, raw); break;
    case MessageType::set_twist: carry_out<SetTwist>(session, raw); break;
    case MessageType::set_trajectory: carry_out<SetTrajectory>(session, raw); break;
    case MessageType::clear_goal: carry_out<ClearGoal>(session, raw); break;
    case MessageType::restart: carry_out<Restart>(session, raw); break;
    case MessageType::set_obstacles: carry_out<SetObstacles>(session, raw); break;
    case MessageType::add_obstacle: carry_out<AddObstacle>(session, raw); break;
    case MessageType::move_obstacle: carry_out<MoveObstacle>(session, raw); break;
    case MessageType::remove_obstacle: carry_out<RemoveObstacle>(session, raw); break;
    case MessageType::remove_obstacles: carry_out<RemoveObstacles>(session, raw); break;
    case MessageType::expect_obstacles: carry_out<ExpectObstacles>(session, raw); break;
    case MessageType::depth_image: carry_out<DepthImageMessage>(session, raw); break;
    case MessageType::pause: carry_out<Pause>(session, raw); break;
    case MessageType::resume: carry_out<Resume>(session, raw); break;
    case MessageType::stop_run: carry_out<StopRun>(session, raw); break;
    case MessageType::ping: carry_out<Ping>(session, raw); break;
    default:
      throw std::invalid_argument("a server takes no message of type " + std::to_string(static_cast<int>(raw.header.type)));
  }
}

void Server::Impl::say_hello(Session& session, const Hello& hello, std::uint64_t sequence) {
  if (session.said_hello) {
    throw std::invalid_argument("Hello was said already");
  }
  if (!hello.token.empty() && !is_token(token_, hello.token)) {
    throw std::invalid_argument("the token is wrong; that of this server is in " + token_file.string());
  }
  session.said_hello = true;
  session.info.name = hello.name.empty() ? "client " + std::to_string(session.info.number) : hello.name;
  session.info.may_command = !hello.token.empty();
  if (session.info.may_command) {
    session.connection.accept_at_most(static_cast<std::size_t>(-1));
  }
  clients_changed_ = true;
  session.tell(welcome(session), sequence);
  if (run_) {
    session.tell(*run_, 0);
  }
}

void Server::Impl::subscribe(Session& session, const Subscribe& request) {
  session.info.rate = request.rate;
  session.spacing = 1.0 / request.rate;
  session.due = request.rate > 0.0 ? monotonic_time() : session.spacing;
  clients_changed_ = true;
}

void Server::Impl::take_command(Session& session, const TakeCommand& request) {
  if (in_command_ != 0 && in_command_ != session.info.number) {
    if (!request.force) {
      throw std::invalid_argument(name_of(in_command_) + " is in command; it must release it, or take it by force");
    }
    leave_command(session.info.name + " has taken it by force");
  }
  in_command_ = session.info.number;
  keeps_goal_ = request.keep_goal;
  clients_changed_ = true;
  tell_all({Notice::Kind::command_taken, in_command_, session.info.name + " is in command"});
}

void Server::Impl::leave_command(const std::string& why) {
  if (!keeps_goal_) {
    controller_.clear_goal();
  }
  clients_changed_ = true;
  tell_all({Notice::Kind::command_free, std::exchange(in_command_, 0), why});
}

void Server::Impl::require_token(const Session& session) const {
  if (!session.info.may_command) {
    throw std::invalid_argument("this needs the token of the server, which is in " + token_file.string());
  }
}

void Server::Impl::require_command(const Session& session) const {
  require_token(session);
  if (in_command_ != session.info.number) {
    throw std::invalid_argument((in_command_ == 0 ? "nobody" : name_of(in_command_)) +
                                " is in command: only the client that took the command may do this");
  }
}

std::string Server::Impl::name_of(std::uint32_t client) const {
  const auto found = std::ranges::find_if(sessions_, [&](const auto& session) { return session->info.number == client; });
  return found == sessions_.end() ? "client " + std::to_string(client) : (*found)->info.name;
}

Welcome Server::Impl::welcome(const Session& session) const {
  const Arm arm = controller_.arm();
  const Robot& robot = arm.robot();
  Welcome said;
  said.server = settings.address;
  said.sidestep_version = recording::sidestep_version();
  said.arm = robot.name();
  said.joints = robot.coordinate_names();
  for (const sidestep::Frame& frame : robot.frames()) {
    said.frames.push_back(frame.name);
  }
  if (perception_ != nullptr) {
    for (const DepthCamera& camera : perception_->cameras()) {
      said.cameras.push_back(camera.name);
    }
  }
  said.lower = robot.limits().lower;
  said.upper = robot.limits().upper;
  said.velocity = robot.limits().velocity;
  said.period = controller_.settings().period;
  said.output = controller_.settings().output;
  said.client = session.info.number;
  said.may_command = session.info.may_command;
  return said;
}

}  // namespace sidestep::link

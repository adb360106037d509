// What is set, as records.
#include "recorded_content.hpp"

#include <string>
#include <utility>
#include <variant>

namespace sidestep {
namespace {

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};

recording::PoseRecord to_record(const PoseGoal& goal) {
  const PoseGoalSettings& s = goal.settings;
  return {goal.frame().name,    goal.pose.matrix(),      goal.twist,          s.position_only,
          s.position_stiffness, s.orientation_stiffness, s.posture_stiffness, s.rest};
}

}  // namespace

recording::RequestRecord to_record(std::uint64_t number, const Request& request) {
  recording::RequestRecord record;
  record.number = number;
  // A kind of request that is new does not compile until it is recorded here, and given again in a replay.
  std::visit(Overloaded{[](const std::monostate&) {},
                        [&](const Goal& goal) {
                          if (const auto* joint = std::get_if<JointGoal>(&goal)) {
                            record.kind = recording::RequestRecord::Kind::joint_goal;
                            record.position = joint->position;
                            record.velocity = joint->velocity;
                            record.acceleration = joint->acceleration;
                            return;
                          }
                          const auto& pose = std::get<PoseGoal>(goal);
                          record.kind = recording::RequestRecord::Kind::pose_goal;
                          record.poses.push_back(to_record(pose));
                          for (const PoseGoal& other : pose.others) {
                            record.poses.push_back(to_record(other));
                          }
                        },
                        [&](const VelocityRequest& velocity) {
                          record.kind = recording::RequestRecord::Kind::velocity;
                          record.velocity = velocity.velocity;
                        },
                        [&](const TwistRequest& twist) {
                          record.kind = recording::RequestRecord::Kind::twist;
                          record.frame = twist.frame.name;
                          record.twist = twist.twist;
                          record.local = twist.local;
                          record.free_rotation = twist.free == TwistFreedom::rotation;
                        },
                        [&](const TrajectoryRequest& trajectory) {
                          record.kind = recording::RequestRecord::Kind::trajectory;
                          record.q = trajectory.samples->q;
                          record.times = trajectory.samples->times;
                          record.steer = trajectory.behaviour == TrajectoryBehaviour::steer;
                        }},
             request);
  return record;
}

}  // namespace sidestep

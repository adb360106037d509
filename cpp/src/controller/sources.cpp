#include "sources.hpp"

#include <cmath>
#include <utility>

namespace sidestep {
namespace {

constexpr double near_moving = 0.1;  // distance of the arm to what moves below which activation distances do not shrink [m]
constexpr double moving_foresight = 1.0;  // time in which what moves could be as near [s]

}  // namespace

Sources::Sources(TripleBuffer<NumberedObstacles>& handed_over, const ClearanceQuery& body, const Robot& robot,
                 const Body& ellipsoids, const ControllerSettings& settings)
    : body_(body),
      workspace_(body),
      settings_(settings),
      buffer_(handed_over),
      closing_(robot, ellipsoids, body.items().obstacles(), settings.safety.margin) {}

bool Sources::update(const Eigen::VectorXd& q, double time) noexcept {
  if (buffer_.is_fresh()) {
    Obstacles& before = buffer_.current().obstacles;
    before.advance(settings_.period);
    closing_.leave(q, before);
    buffer_.update();  // one that comes after the question above is taken by the next step
  }
  const bool others = buffer_.current().number != number_;
  if (others) {
    number_ = buffer_.current().number;
    age_ = 0.0;
    closing_.take(buffer_.current().obstacles, time);
  } else {
    age_ += settings_.period;
    buffer_.current().obstacles.advance(settings_.period);
  }
  closing_.advance(time);
  return others;
}

bool Sources::look_for_movers(const Eigen::VectorXd& q) noexcept {
  has_movers_ = body_.nearest_moving(q, obstacles(), moving_foresight, workspace_) < near_moving ||
                closing_.nearest(moving_foresight) < near_moving;
  return has_movers_;
}

void Sources::go_on_from(Sources& before) noexcept {
  number_ = before.number_;
  age_ = before.age_;
  has_movers_ = before.has_movers_;
  closing_.go_on_from(before.closing_);
  buffer_.update();
  if (buffer_.current().number == number_) {  // as they have moved on until now
    std::swap(buffer_.current().obstacles, before.buffer_.current().obstacles);
  }
}

bool Sources::is_stale() const noexcept {
  return age_ > settings_.obstacle_timeout || (number_ == 0 && std::isfinite(settings_.obstacle_timeout));
}

}  // namespace sidestep

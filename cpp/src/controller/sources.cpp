#include "sources.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "../math/settings.hpp"

namespace sidestep {
namespace {

constexpr double near_moving = 0.1;  // distance of the arm to what moves below which activation distances do not shrink [m]
constexpr double moving_foresight = 1.0;  // time in which what moves could be as near [s]
constexpr double most_ahead = 0.05;       // Time by which a capture may be in the future: clocks differ, and jitter [s].

std::string seconds(double time) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.2f s", time);
  return text.data();
}

}  // namespace

Sources::Sources(TripleBuffer<World>& handed_over, const ClearanceQuery& body, const Robot& robot, const Body& ellipsoids,
                 const ControllerSettings& settings)
    : body_(body),
      workspace_(body),
      settings_(settings),
      buffer_(handed_over),
      closing_(robot, ellipsoids, body.items().obstacles(), settings.safety.margin) {}

bool Sources::update(const Eigen::VectorXd& q, const Tick& tick) noexcept {
  time_ = tick.time;
  if (buffer_.is_fresh()) {
    advance(buffer_.current(), tick);
    closing_.leave(q, buffer_.current().obstacles);
    buffer_.update();  // one that comes after the question above is taken by the next step
  }
  bool others = buffer_.current().number != number_;
  if (others) {
    number_ = buffer_.current().number;
    adopt(tick);
    closing_.take(buffer_.current().obstacles, tick.time);
  } else {
    advance(buffer_.current(), tick);
  }
  others = believe_empty(tick.time) || others;
  judge_ages();
  closing_.advance(tick.time);
  return others;
}

void Sources::adopt(const Tick& tick) noexcept {
  World& world = buffer_.current();
  std::array<Known, most_sources> before = known_;
  const std::size_t num_before = std::exchange(num_known_, std::min(world.sources.size(), most_sources));
  for (std::size_t k = 0; k < num_known_; ++k) {
    const SourceSet& set = world.sources[k];
    const Known *const begin = before.data(), *const end = begin + num_before;
    const Known* const same = std::find_if(begin, end, [&](const Known& one) { return one.id == set.id; });
    Known& known = known_[k] = same == end ? Known{.id = set.id} : *same;
    const auto captured = [&](double told) { return std::isnan(told) ? tick.time : tick.own_time(told); };
    if (known.number != set.number) {
      known.number = set.number;
      known.uncertain = set.points->size() > 0 && set.points->uncertainty().maxCoeff() > 0.0;
      known.time = std::min(captured(set.time), tick.time);
      known.ahead = std::max(0.0, captured(set.time) - tick.time);
    }
    if (known.heard_number != set.heard_number) {
      known.heard_number = set.heard_number;
      known.heard = std::min(captured(set.heard), tick.time);
    }
    if (set.emptied && !known.emptied) {
      known.emptied_at = tick.time;
    }
    known.emptied = set.emptied;
    motion_.parts[k] = {};
  }
  for (std::size_t k = 0; k < num_known_; ++k) {
    move(world, k, tick.time - known_[k].time, world.sources[k].moves_for);
  }
}

void Sources::advance(World& world, const Tick& tick) noexcept {
  for (std::size_t k = 0; k < std::min(num_known_, world.sources.size()); ++k) {
    if (!motion_.parts[k].frozen && !motion_.parts[k].hidden) {
      move(world, k, tick.elapsed, known_[k].time + world.sources[k].moves_for - (tick.time - tick.elapsed));
    }
  }
}

void Sources::move(World& world, std::size_t k, double duration, double most) noexcept {
  const double moved = std::max(0.0, std::min(duration, most));
  if (moved > 0.0 && world.obstacles.moves(k)) {
    world.obstacles.advance(k, moved);
    motion_.parts[k].moved += moved;
  }
  if (duration > most) {
    world.obstacles.freeze(k);
    motion_.parts[k].frozen = true;
  }
}

bool Sources::believe_empty(double time) noexcept {
  bool any = false;
  for (std::size_t k = 0; k < num_known_; ++k) {
    WorldMotion::Part& part = motion_.parts[k];
    if (known_[k].emptied && !part.hidden && time - known_[k].emptied_at >= settings_.sources.empty_after) {
      buffer_.current().obstacles.hide(k);
      part.hidden = any = true;
    }
  }
  return any;
}

double Sources::age(std::size_t k) const noexcept {
  return time_ -
         (motion_.parts[k].hidden || buffer_.current().sources[k].points->size() == 0 ? known_[k].heard : known_[k].time);
}

bool Sources::has_not_come(std::size_t k) const noexcept { return buffer_.current().sources[k].time == SourceSet::not_come; }

void Sources::judge_ages() noexcept {
  const World& world = buffer_.current();
  overdue_ = -1;
  double most = 0.0;
  std::array<ClosingEstimate::Widening, most_sources> parts{};
  bool any = false;
  for (std::size_t k = 0; k < std::min(num_known_, world.sources.size()); ++k) {
    const double late = age(k) - world.sources[k].valid_for;
    const double beyond = known_[k].ahead > most_ahead || has_not_come(k) ? infinity : late;
    if (beyond > most) {
      most = beyond;
      overdue_ = static_cast<int>(k);
    }
    if (!motion_.parts[k].hidden && world.sources[k].points->size() > 0) {
      parts[k] = {settings_.sources.largest_speed * std::max(0.0, late), age(k) - std::max(0.0, late)};
      any = any || late > 0.0 || known_[k].uncertain;
    }
  }
  closing_.widen(any ? &world.obstacles : nullptr, parts);
}

bool Sources::look_for_movers(const Eigen::VectorXd& q) noexcept {
  has_movers_ = body_.nearest_moving(q, obstacles(), moving_foresight, workspace_) < near_moving ||
                closing_.nearest(moving_foresight) < near_moving;
  return has_movers_;
}

void Sources::go_on_from(Sources& before) noexcept {
  time_ = before.time_;
  has_movers_ = before.has_movers_;
  overdue_ = before.overdue_;
  known_ = before.known_;
  num_known_ = before.num_known_;
  closing_.go_on_from(before.closing_);
  buffer_.update();
  if (buffer_.current().number == before.number_) {  // as they have moved on until now
    number_ = before.number_;
    motion_ = before.motion_;
    std::swap(buffer_.current().obstacles, before.buffer_.current().obstacles);
  }
}

std::vector<SourceState> Sources::states() const {
  std::vector<SourceState> states;
  for (std::size_t k = 0; k < num_known_; ++k) {
    const SourceSet& set = buffer_.current().sources[k];
    const bool believed_empty = motion_.parts[k].hidden;
    states.push_back({set.name, believed_empty ? 0 : static_cast<int>(set.points->size()), age(k), set.valid_for,
                      age(k) > set.valid_for || known_[k].ahead > most_ahead || has_not_come(k),
                      set.emptied && !believed_empty});
  }
  return states;
}

std::string Sources::explain() const {
  if (number_ == 0) {
    return "obstacles were never set: the arm stays where it is; set_obstacles(Obstacles.none()) says that the space is free";
  }
  if (overdue_ < 0) {
    return {};
  }
  const auto k = static_cast<std::size_t>(overdue_);
  const SourceSet& set = buffer_.current().sources[k];
  const std::string who = "source '" + set.name + "' ";
  if (has_not_come(k)) {
    return who + "was expected and has not come yet; the arm goes on when it does";
  }
  if (known_[k].ahead > most_ahead) {
    return who + "was captured " + seconds(known_[k].ahead) + " after now: its clock is not that of step";
  }
  return who + "is " + seconds(age(k)) + " old and valid for " + seconds(set.valid_for) +
         (set.emptied    ? ", and what came since is empty"
          : set.repeated ? ", and what came since are the same points although they move: old data with new times"
                         : "") +
         "; the arm goes on when it comes again";
}

}  // namespace sidestep

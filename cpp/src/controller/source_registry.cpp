#include "source_registry.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "sidestep/math/rotation.hpp"

namespace sidestep {
namespace {

constexpr double no_time = SourceOptions::untold;  // Time of a set that says nothing of how often they come.
constexpr double longest_between = 1.0;            // Time between two sets beyond which they say nothing of velocities [s].
constexpr double least_largest_speed = 1e-3;  // Largest speed that is assumed, at least: 0 is none that can be found [m/s].
constexpr int least_of_scene = 10;            // Sets of the scene in a row, each another one, after which more are expected.
constexpr std::size_t longest_source_name = 100;  // Length of a source's name, at most.

std::string quoted(const std::string& name) { return "'" + name + "'"; }

void check(const SourceOptions& options) {
  if (options.source.empty() || options.source.size() > longest_source_name) {
    throw std::invalid_argument("obstacles: the source's name is " + quoted(options.source) +
                                ", allowed: 1 to 100 characters, such as 'camera'");
  }
  if (std::isinf(options.time)) {
    throw std::invalid_argument("obstacles: time of source " + quoted(options.source) +
                                " is infinite, allowed: seconds on the clock of step");
  }
  if (!std::isnan(options.valid_for) && !(options.valid_for > 0.0)) {
    throw std::invalid_argument("obstacles: valid_for of source " + quoted(options.source) + " is " +
                                std::to_string(options.valid_for) + " s, allowed: above 0, inf for ever");
  }
}

/// Whether two sets say the same: a scene that is set again and again, and rests.
bool are_same(const Obstacles& a, const Obstacles& b) {
  return a.size() == b.size() && a.points() == b.points() && a.radii() == b.radii();
}

/// Points by the names of what they belong to.
class Groups {
 public:
  struct One {
    std::string name;
    Eigen::Isometry3d pose;
    Eigen::Matrix3Xd points, velocities;
    Eigen::VectorXd radii;
  };

  void add(const Obstacles& obstacles) {
    Eigen::Index at = 0;
    std::size_t k = 0;
    for (const auto& [name, count] : obstacles.groups()) {
      all_.push_back({name, obstacles.pose_of(k++), obstacles.points().middleCols(at, count),
                      obstacles.velocities().middleCols(at, count), obstacles.radii().segment(at, count)});
      at += count;
    }
  }
  const One* find(const std::string& name) const {
    const auto found = std::find_if(all_.begin(), all_.end(), [&](const One& one) { return one.name == name; });
    return name.empty() || found == all_.end() ? nullptr : &*found;
  }
  One& at(const std::string& name, const std::string& source) {
    if (const One* const found = find(name)) {
      return all_[static_cast<std::size_t>(found - all_.data())];
    }
    std::string names;
    for (const One& one : all_) {
      names += one.name.empty() ? "" : (names.empty() ? "" : ", ") + quoted(one.name);
    }
    throw std::invalid_argument("obstacles: source " + quoted(source) + " has no " + quoted(name) + ", it has " +
                                (names.empty() ? "none with a name" : names));
  }
  void remove(const std::string& name, const std::string& source) {
    const One* const found = &at(name, source);
    all_.erase(all_.begin() + (found - all_.data()));
  }
  Obstacles obstacles() const {
    Eigen::Index num = 0;
    for (const One& one : all_) {
      num += one.points.cols();
    }
    if (num == 0) {
      return Obstacles::none();
    }
    Eigen::Matrix3Xd points(3, num), velocities(3, num);
    Eigen::VectorXd radii(num);
    std::vector<std::string> names;
    std::vector<Eigen::Index> counts;
    std::vector<Eigen::Isometry3d> poses;
    Eigen::Index at = 0;
    for (const One& one : all_) {
      const Eigen::Index count = one.points.cols();
      points.middleCols(at, count) = one.points;
      velocities.middleCols(at, count) = one.velocities;
      radii.segment(at, count) = one.radii;
      names.push_back(one.name);
      counts.push_back(count);
      poses.push_back(one.pose);
      at += count;
    }
    return Obstacles(std::move(points), std::move(radii), std::move(velocities))
        .named(std::move(names), counts, std::move(poses));
  }

 private:
  std::vector<One> all_;
};

}  // namespace

SourceRegistry::SourceRegistry(const ControllerSettings& settings) : settings_(settings) {}

SourceRegistry::Entry* SourceRegistry::find(const std::string& source) noexcept {
  const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.set.name == source; });
  return found == entries_.end() ? nullptr : &*found;
}

std::vector<SourceContent> SourceRegistry::said() const {
  std::vector<SourceContent> all;
  for (const Entry& entry : entries_) {
    if (entry.set.time != SourceSet::not_come) {
      all.push_back({entry.set.name, entry.set.time, entry.set.points});
    }
  }
  return all;
}

SourceRegistry::Entry& SourceRegistry::at(const std::string& source) {
  if (Entry* const entry = find(source)) {
    return *entry;
  }
  std::string names;
  for (const Entry& entry : entries_) {
    names += (names.empty() ? "" : ", ") + quoted(entry.set.name);
  }
  throw std::invalid_argument("obstacles: there is no source " + quoted(source) + ", there " +
                              (names.empty() ? "is none: nothing was set" : "are: " + names));
}

void SourceRegistry::require_room(const std::string& source, std::size_t number) {
  if (number > most_sources) {
    throw std::invalid_argument("obstacles: source " + quoted(source) + " would be number " + std::to_string(number) +
                                ", allowed: " + std::to_string(most_sources) +
                                " sources; remove_obstacles(source) forgets one");
  }
}

SourceRegistry::Entry& SourceRegistry::at_or_new(const std::string& source) {
  if (Entry* const entry = find(source)) {
    return *entry;
  }
  require_room(source, entries_.size() + 1);
  Entry& entry = entries_.emplace_back();
  entry.set.name = source;
  entry.set.id = ++last_id_;
  entry.set.points = std::make_shared<const Obstacles>(Obstacles::none());
  entry.set.valid_for = settings_.obstacle_timeout;
  return entry;
}

void SourceRegistry::note(Entry& entry, double time) const noexcept {
  const bool third =
      entry.last_but_one < entry.last && entry.last < time && time - entry.last_but_one <= settings_.sources.valid_for;
  entry.comes = third || (entry.comes && time - entry.last < longest_between);  // after a while it begins anew
  if (time != entry.last) {
    entry.in_a_row = time - entry.last <= settings_.sources.valid_for && time > entry.last ? entry.in_a_row + 1 : 1;
  }
  entry.last_but_one = entry.last;
  entry.last = time;
}

double SourceRegistry::validity(const Entry& entry, const SourceOptions& options) const noexcept {
  if (!std::isnan(options.valid_for)) {
    return options.valid_for;
  }
  // A scene may be changed now and then, and rest; one that is changed again and again is what a camera sees.
  const bool streams = entry.set.name == SourceOptions::scene ? entry.in_a_row >= least_of_scene : entry.comes;
  const bool ages = !std::isnan(options.time) || streams || entry.given.tree().moves();
  return ages && std::isinf(settings_.obstacle_timeout) ? settings_.sources.valid_for : settings_.obstacle_timeout;
}

void SourceRegistry::set(Obstacles obstacles, const SourceOptions& options, double now) {
  check(options);
  Entry& entry = at_or_new(options.source);
  const double time = std::isnan(options.time) ? now : options.time;
  const bool same = are_same(entry.given, obstacles);
  if (same && obstacles.tree().moves() && time > entry.last && entry.given.velocities() == obstacles.velocities()) {
    entry.set.repeated = true;  // old points with a new time: what moves is not where it was
    ++number_;
    return;
  }
  const bool believed = obstacles.size() > 0 || entry.given.size() == 0 || options.as_given ||
                        (entry.set.emptied && time - entry.emptied_at >= settings_.sources.empty_after);
  if (believed) {
    const bool comes = options.source != SourceOptions::scene || !same;  // a scene that is set again and again may rest
    replace(entry, std::move(obstacles), options, comes ? time : no_time);
    return;
  }
  note(entry, time);
  if (!std::exchange(entry.set.emptied, true)) {
    entry.emptied_at = time;
  }
  entry.set.heard = options.time;
  entry.set.heard_number = ++number_;
}

void SourceRegistry::expect(const std::vector<std::string>& sources) {
  std::size_t number = entries_.size();
  for (const std::string& source : sources) {
    check({.source = source});
    if (find(source) == nullptr) {
      require_room(source, ++number);
    }
  }
  for (const std::string& source : sources) {
    if (find(source) == nullptr) {
      Entry& entry = at_or_new(source);
      entry.set.time = entry.set.heard = SourceSet::not_come;
      entry.set.valid_for = settings_.sources.valid_for;
      entry.set.number = entry.set.heard_number = ++number_;
    }
  }
}

void SourceRegistry::find_velocities(Entry& entry, const Obstacles& before, double last, double time, bool has_time) const {
  const bool follows = time > last && time - last < longest_between;
  if (!follows || !(entry.comes || has_time)) {  // the first one, or the first after a while
    entry.motion.reset();
    return;
  }
  if (!entry.motion) {
    entry.motion.emplace(VelocityEstimate::Settings{std::max(settings_.sources.largest_speed, least_largest_speed)});
    entry.motion->update(before, last);
  }
  VelocityEstimate::Result found = entry.motion->update(entry.given, time);
  if (found.velocities != entry.given.velocities()) {
    entry.set.moves_for = std::min(entry.set.valid_for, settings_.sources.valid_for);
  }
  entry.set.points =
      std::make_shared<const Obstacles>(entry.given.moving(std::move(found.velocities), std::move(found.uncertainty)));
}

void SourceRegistry::replace(Entry& entry, Obstacles obstacles, const SourceOptions& options, double time) {
  const Obstacles before = std::exchange(entry.given, std::move(obstacles));
  const double last = entry.last;
  if (!std::isnan(time)) {
    note(entry, time);
  }
  entry.set.points = std::make_shared<const Obstacles>(entry.given);
  entry.set.number = entry.set.heard_number = ++number_;
  entry.set.time = entry.set.heard = options.time;
  entry.set.emptied = entry.set.repeated = false;
  entry.set.valid_for = entry.set.moves_for = validity(entry, options);
  if (!std::isnan(time) && !std::isinf(options.valid_for) && !options.as_given) {
    find_velocities(entry, before, last, time, !std::isnan(options.time));
  }
}

void SourceRegistry::add(const Obstacles& obstacles, const std::string& source) {
  check({.source = source});
  Groups groups;
  if (const Entry* const entry = find(source)) {
    groups.add(entry->given);
  }
  for (const auto& [name, count] : obstacles.groups()) {
    if (name.empty()) {
      throw std::invalid_argument("add_obstacle: it has no name, allowed: a name by which it is moved and removed");
    }
    if (groups.find(name) != nullptr) {
      throw std::invalid_argument("add_obstacle: source " + quoted(source) + " has " + quoted(name) +
                                  " already; move_obstacle moves it, remove_obstacle removes it");
    }
  }
  groups.add(obstacles);
  Entry& entry = at_or_new(source);
  const bool has_come = entry.set.time != SourceSet::not_come;
  const double time = has_come ? entry.set.time : SourceOptions::untold;
  const double valid_for = has_come ? entry.set.valid_for : settings_.obstacle_timeout;
  replace(entry, groups.obstacles(), {source, time, valid_for}, no_time);
}

void SourceRegistry::move(const std::string& name, const Eigen::Isometry3d& pose, const SourceOptions& options, double now) {
  check(options);
  check_rotation(pose.linear(), "move_obstacle");
  Entry& entry = at(options.source);
  Groups groups;
  groups.add(entry.given);
  Groups::One& moved = groups.at(name, options.source);
  const Eigen::Isometry3d step = pose * moved.pose.inverse();
  moved.points = (step.linear() * moved.points).colwise() + step.translation();
  moved.velocities.setZero();
  moved.pose = pose;
  replace(entry, groups.obstacles(), options, std::isnan(options.time) ? now : options.time);
}

void SourceRegistry::remove(const std::string& name, const std::string& source) {
  Entry& entry = at(source);
  Groups groups;
  groups.add(entry.given);
  groups.remove(name, source);
  replace(entry, groups.obstacles(), {source, entry.set.time, entry.set.valid_for}, no_time);
}

void SourceRegistry::remove(const std::string& source) {
  const Entry* const entry = &at(source);
  entries_.erase(entries_.begin() + (entry - entries_.data()));
  ++number_;
}

World SourceRegistry::world() const {
  World world;
  world.number = number_;
  for (const Entry& entry : entries_) {
    world.sources.push_back(entry.set);
  }
  world.obstacles = join(world.sources);
  return world;
}

}  // namespace sidestep

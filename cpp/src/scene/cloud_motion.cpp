#include "cloud_motion.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "../math/settings.hpp"

namespace sidestep {
namespace {

constexpr double longest_pause = 0.5;     // Time between sets after which earlier ones say nothing [s].
constexpr double longest_history = 0.51;  // Time over which sets are compared [s]: six sets at 10 Hz.
constexpr double remembered_rest = 0.35;  // Time for which a place counts as occupied after it was last seen [s].
constexpr double background_age = 0.4;    // Time after which what rests is background [s].
constexpr int background_sets = 5;        // Number of sets in which it must have been seen.
constexpr double rested_age = 0.18;       // Time after which what rests makes clusters apart from what is new [s].
constexpr int rested_sets = 4;            // Number of sets in which it must have been seen.
constexpr double certain_age = 1.0;       // Time of rest after which there is no uncertainty left [s].
constexpr Eigen::Index sample_size = 60;  // Number of points of a cluster that are registered.
constexpr double least_error = 0.0003;    // Least error of a registration [m]: rounding of sensors' formats.
constexpr double sure = 3.0;              // Standard deviations within which a shift is noise [-].
constexpr double learned = 0.15;          // Share of one set in the noise that is learned [-].
constexpr double lag = 3.0;               // Ratio of a displacement to what two steps of a registration from rest find of it.
constexpr double least_way = 0.002;       // Displacement that is never excluded at first [m].
constexpr double slowest = 0.02;          // Least speed that is found [m/s]; slower is for margins.
constexpr double sphere = 4.0;  // Radius that holds an error in space, in standard deviations: 2.8 for 95 %, and more since
                                // registrations share errors.
constexpr double large_noise = 0.015;   // Noise of places beyond which a motion is likely [m].
constexpr double slip = 0.1;            // Relative error of a velocity where other points of a surface are seen each time [-].
constexpr double other_points = 0.002;  // Error of a registration from which on that is so [m].
constexpr double same_scatter = 4.0;    // Ratio of scatters about a long and a short line beyond which the long one is wrong.
constexpr double least_spacing = 0.02;  // Time in which the same points again say nothing, not even that they rest [s].
constexpr std::size_t least_split = 5;  // Number of connected points that are taken out of a cluster that rests, at least.
constexpr double split_distance = 0.008;   // Distance from the oldest set that noise explains [m].
constexpr double held = 1.5;               // Spacings of the sets for which the same points again say nothing new [-].
constexpr std::size_t few_clusters = 300;  // Number of clusters up to which every pair is compared.
constexpr int cut_iterations = 10;         // Steps to the way of what is cut.
constexpr double long_wait = 0.05;        // Spacing from which on two sets alone can tell a motion: a third one comes late [s],
constexpr double longest_jump = 0.25;     // up to which they can [s],
constexpr std::size_t least_jumping = 8;  // of so many points at least,
constexpr double least_jump = 0.03;       // whose displacement is larger than this [m],
constexpr double surely_jumped = 6.0;     // and than so many standard deviations,
constexpr double seen_before = 2.0 / 3.0;  // where the last set would have shown so large a share of them.
constexpr double jump_slip = 0.5;          // Its relative error: what is seen of a thing changes as it goes [-].
constexpr std::size_t stray_points = 3;    // Number of points of a cluster that can be noise of the background, at most.

const Sight everywhere;

/// How much wider an error is if its deviation was found from `num` positions [-].
double few_positions(int num) { return num == 3 ? 2.5 : num == 4 ? 1.5 : 1.2; }

bool is_background(const RestMemory::Rest& rest) { return rest.age >= background_age && rest.sets >= background_sets; }

/// Uncertainty of what rests within `distance` [m] for some time [s].
double drift(double distance, double age) { return age >= certain_age ? 0.0 : distance / age; }

}  // namespace

void CloudMotion::forget() {
  sets_.clear();
  memory_.forget();
  noise_ = 0.0;
}

void CloudMotion::begin(const Eigen::Matrix3Xd& points, double time, Sight sight) {
  forget();
  const auto num = static_cast<std::size_t>(points.cols());
  Set set{time, points, PointGrid(points), Eigen::VectorXd::Zero(points.cols()), std::move(sight), {}, {}, true};
  set.motions.resize(num, {.uncertainty = largest_speed_});
  add_clusters(set, std::vector<char>(num, 0), std::vector<char>(num, 1));
  sets_.push_front(std::move(set));
}

bool CloudMotion::is_repeated(const Eigen::Matrix3Xd& points, double time) const {
  if (sets_.empty() || points.cols() != sets_[0].points.cols() || points != sets_[0].points) {
    return false;
  }
  const auto moves = [](const PointMotion& motion) { return !motion.velocity.isZero(0.0); };
  const bool any = sets_.size() > 1 && std::any_of(sets_[0].motions.begin(), sets_[0].motions.end(), moves);
  return time - sets_[0].time <= (any ? held * (sets_[0].time - sets_[1].time) : least_spacing);
}

std::vector<PointMotion> CloudMotion::update(const Eigen::Matrix3Xd& points, double time, Sight sight,
                                             const Eigen::VectorXd& noise) {
  if (!sets_.empty() && time - sets_[0].time > longest_pause) {
    sets_.clear();
  }
  if (is_repeated(points, time)) {
    return sets_[0].motions;
  }
  const auto num = static_cast<std::size_t>(points.cols());
  const double spacing = sets_.empty() ? 0.0 : time - sets_[0].time;
  memory_.begin(time, std::max(remembered_rest, 3.0 * spacing), num);
  std::vector<RestMemory::Rest> rests(num);
  std::vector<char> is_old(num), is_new(num);
  for (std::size_t n = 0; n < num; ++n) {
    rests[n] = memory_.at(points.col(static_cast<Eigen::Index>(n)));
    is_new[n] = rests[n].age < rested_age || rests[n].sets < rested_sets;
    is_old[n] = is_background(rests[n]);
  }
  Set set{time, points, PointGrid(points), noise, std::move(sight), {}, {}};
  add_clusters(set, is_old, is_new);
  const bool few = set.clusters.size() <= few_clusters && (sets_.empty() || sets_[0].clusters.size() <= few_clusters);
  for (Cluster& cluster : set.clusters) {
    judge(cluster, set, few);
  }
  learn_noise(set);
  split(set);
  spread_out(set, rests);
  if (!sets_.empty() && sets_[0].is_first_look) {
    sets_.clear();
  }
  sets_.push_front(std::move(set));
  if (sets_.size() >= most_sets) {
    sets_.pop_back();
  }
  return sets_[0].motions;
}

void CloudMotion::add_clusters(Set& set, const std::vector<char>& is_old, const std::vector<char>& is_new) {
  std::vector<char> left_out(is_old.size());
  for (const bool newly : {true, false}) {
    for (std::size_t n = 0; n < left_out.size(); ++n) {
      left_out[n] = is_old[n] != 0 || (is_new[n] != 0) != newly;
    }
    for (std::vector<int>& members : set.grid.clusters(left_out)) {
      add_cluster(set, std::move(members));
    }
  }
}

void CloudMotion::add_cluster(Set& set, std::vector<int> points) {
  Cluster cluster;
  cluster.points = std::move(points);
  const auto count = static_cast<Eigen::Index>(cluster.points.size());
  const Eigen::Matrix3Xd all = set.points(Eigen::all, cluster.points);
  cluster.middle = all.rowwise().mean();
  cluster.noise = set.noise(cluster.points).mean();
  cluster.size = all.rowwise().maxCoeff() - all.rowwise().minCoeff();
  const Eigen::Index kept = std::min(count, sample_size);
  cluster.sample.resize(3, kept);
  for (Eigen::Index k = 0; k < kept; ++k) {
    cluster.sample.col(k) = all.col(k * count / kept);
  }
  set.clusters.push_back(std::move(cluster));
}

void CloudMotion::split(Set& set) const {
  std::vector<char> is_explained(static_cast<std::size_t>(set.points.cols()), 1);
  for (Cluster& cluster : set.clusters) {
    if (sets_.empty() || cluster.motion.sets < 2 || !cluster.motion.velocity.isZero(0.0) ||
        cluster.points.size() < 2 * least_split) {
      continue;
    }
    std::vector<double> distances;
    for (const int n : cluster.points) {
      distances.push_back(sets_.back().grid.nearest(set.points.col(n)).distance);
    }
    std::vector<double> sorted = distances;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    const double limit = std::max(split_distance, 2.5 * *middle);
    for (std::size_t k = 0; k < distances.size(); ++k) {
      is_explained[static_cast<std::size_t>(cluster.points[k])] = distances[k] <= limit;
    }
  }
  for (std::vector<int>& members : set.grid.clusters(is_explained)) {
    if (members.size() >= least_split) {
      add_cluster(set, std::move(members));  // later clusters have the last word on their points
      judge(set.clusters.back(), set, true);
    }
  }
}

void CloudMotion::judge(Cluster& cluster, const Set& set, bool among_few) const {
  const double time = set.time;
  cluster.motion = {.uncertainty = largest_speed_};
  if (sets_.empty() || is_stray(cluster)) {
    return;
  }
  if (among_few && is_noisy(cluster)) {
    if (const Track track = track_middle(cluster, set); track.num > 2) {
      follow(cluster, track, time);
      return;
    }
  }
  if (rests(cluster, time)) {
    return;
  }
  const Match found = match(cluster, set, among_few);
  const Registration& last = found.registration;
  const double most = largest_speed_ * (time - sets_[0].time) + sure * std::max(last.error, least_error);
  if (last.is_known() && last.shift.norm() <= most) {
    follow(cluster, track_points(cluster, found, set), time);
  } else {
    flickers(cluster, time);
  }
}

bool CloudMotion::rests(Cluster& cluster, double time) const {
  const std::size_t oldest = sets_.size() - 1;
  double largest = 0.0, farthest = 0.0;
  for (std::size_t k = 0; k <= oldest; k += std::max<std::size_t>(1, oldest)) {
    const Registration at = register_points(cluster.sample, sets_[k].grid, Eigen::Vector3d::Zero(), 2);
    const double error = sure * std::max(at.error, least_error);
    if (!at.is_known() || at.shift.norm() > error) {
      return false;
    }
    largest = (lag * at.shift.norm() + error + least_way) / (time - sets_[k].time);
    farthest = std::max(farthest, at.shift.norm());
  }
  cluster.motion = {.uncertainty = std::min(largest_speed_, largest), .sets = static_cast<int>(sets_.size()) + 1};
  cluster.scatter = farthest / std::sqrt(6.0);
  return true;
}

bool CloudMotion::flickers(Cluster& cluster, double time) const {
  for (std::size_t k = 1; k < std::min<std::size_t>(sets_.size(), 3); ++k) {
    const Registration at = register_points(cluster.sample, sets_[k].grid, Eigen::Vector3d::Zero(), 2);
    if (at.is_known()) {
      const double way = lag * at.shift.norm() + sure * std::max(at.error, least_error) + RestMemory::reach;
      cluster.motion = {.uncertainty = std::min(largest_speed_, way / (time - sets_[k].time))};
      return true;
    }
  }
  return false;
}

bool CloudMotion::is_stray(Cluster& cluster) const {
  if (cluster.points.size() > stray_points) {
    return false;
  }
  double farthest = 0.0;
  for (Eigen::Index k = 0; k < cluster.sample.cols(); ++k) {
    const PointGrid::Nearest nearest = sets_[0].grid.nearest(cluster.sample.col(k));
    if (nearest.point < 0) {
      return false;
    }
    const PointMotion& beside = sets_[0].motions[static_cast<std::size_t>(nearest.point)];
    if (beside.sets < 3 || !beside.velocity.isZero(0.0)) {
      return false;
    }
    farthest = std::max(farthest, nearest.distance);
  }
  cluster.motion = {.uncertainty = std::min(largest_speed_, farthest / background_age), .sets = 2};
  return true;
}

CloudMotion::Way CloudMotion::way_back(const Cluster& cluster, const Set& now, const Cluster& other, const Set& then) const {
  Way way{.shift = other.middle - cluster.middle,
          .num = static_cast<int>(std::min(cluster.points.size(), other.points.size()))};
  if (!now.sight || !then.sight || cluster.sample.cols() < few_in_sight || other.sample.cols() < few_in_sight) {
    return way;
  }
  const auto in_its_sight = [](const Cluster& its, const Sight& sight) {
    std::vector<Eigen::Vector3d> points;
    for (Eigen::Index n = 0; n < its.sample.cols(); ++n) {
      if (sight(its.sample.col(n))) {
        points.emplace_back(its.sample.col(n));
      }
    }
    return points;
  };
  const std::vector<Eigen::Vector3d> points = in_its_sight(cluster, now.sight), earlier = in_its_sight(other, then.sight);
  // From the sights' ends a shift that is wrong by e goes on with an error of e/2 or less.
  Eigen::Vector3d shift = *way.shift;
  for (int k = 0; k < cut_iterations; ++k) {
    Eigen::Vector3d here = Eigen::Vector3d::Zero(), there = here;
    int num_here = 0, num_there = 0;
    for (const Eigen::Vector3d& point : points) {
      if (then.sight(point + shift)) {
        here += point;
        ++num_here;
      }
    }
    for (const Eigen::Vector3d& point : earlier) {
      if (now.sight(point - shift)) {
        there += point;
        ++num_there;
      }
    }
    if (num_here == cluster.sample.cols() && num_there == other.sample.cols()) {
      break;
    }
    way.is_cut = true;
    if (num_here < few_in_sight || num_there < few_in_sight) {
      way.shift.reset();
      return way;
    }
    shift = there / num_there - here / num_here;
    way.num = std::min(num_here, num_there);
  }
  if (way.is_cut && shift.norm() <= largest_speed_ * (now.time - then.time)) {
    way.shift = shift;
  }
  return way;
}

CloudMotion::Starts CloudMotion::starts_in(const Cluster& cluster, const Set& now, const Set& then,
                                           const Eigen::Vector3d& ahead, bool has_moved) const {
  if (cluster.points.size() <= stray_points) {  // their middle is their noise
    return {.shifts = {{ahead, has_moved}}};
  }
  const Eigen::Vector3d place = cluster.middle + ahead;
  const Cluster* nearest = nullptr;
  for (const Cluster& other : then.clusters) {
    if (((other.middle - place).cwiseAbs() - 0.5 * other.size).maxCoeff() <= PointGrid::edge &&
        (nearest == nullptr || (other.middle - place).squaredNorm() < (nearest->middle - place).squaredNorm())) {
      nearest = &other;
    }
  }
  Starts starts;
  Way way;
  if (nearest != nullptr) {
    way = way_back(cluster, now, *nearest, then);
  }
  if (way.shift) {
    starts.shifts.push_back({*way.shift, has_moved});
  }
  // What is not known to move has slid in the newer set, too, where a sight's end cuts it.
  if (!way.is_cut || !way.shift || has_moved) {
    starts.shifts.push_back({ahead, has_moved});
  }
  starts.is_cut = way.is_cut;
  return starts;
}

bool CloudMotion::is_alike(const Cluster& one, const Cluster& other, double slack) {
  const std::size_t more = std::max(one.points.size(), other.points.size()),
                    less = std::min(one.points.size(), other.points.size());
  return more <= 4 * less && (one.size - other.size).norm() <= 0.5 * std::max(one.size.norm(), other.size.norm()) + slack;
}

CloudMotion::Match CloudMotion::match(const Cluster& cluster, const Set& now, bool among_few) const {
  const Set& last = sets_[0];
  const double duration = now.time - last.time;
  Match best;
  Starts starts;
  for (std::size_t k = 0; among_few && k < last.clusters.size(); ++k) {
    const Cluster& other = last.clusters[k];
    const Eigen::Vector3d way = other.middle - cluster.middle;
    const double differs = (other.size - cluster.size).norm();
    if (way.norm() > largest_speed_ * duration + 0.5 * differs + PointGrid::edge ||
        !is_alike(other, cluster, PointGrid::edge)) {
      continue;
    }
    const Way common = way_back(cluster, now, other, last);
    const bool moved = other.motion.sets > 2 && !other.motion.velocity.isZero(0.0);  // by more than a jump
    if (common.shift) {
      starts.shifts.push_back({*common.shift, moved});
    }
    starts.is_cut = starts.is_cut || common.is_cut;
    if (moved) {
      starts.shifts.push_back({-duration * other.motion.velocity, true});
    }
    best.moved = best.moved || moved;
  }
  const Sight& sight = starts.is_cut && cluster.sample.cols() >= few_in_sight ? last.sight : everywhere;
  best.registration = register_points(cluster.sample, last.grid, starts.shifts, 5, sight);
  return best;
}

void CloudMotion::Track::add(const Eigen::Vector3d& shift, double time, double shift_error) {
  shifts.col(num) = shift;
  times[static_cast<std::size_t>(num)] = time;
  error = std::max(error, shift_error);
  ++num;
}

CloudMotion::Track CloudMotion::track_points(const Cluster& cluster, const Match& match, const Set& now) const {
  Track track{.error = least_error, .has_moved = match.moved};
  track.add(match.registration.shift, sets_[0].time - now.time, match.registration.error);
  for (std::size_t k = 1; k < sets_.size() && now.time - sets_[k].time <= longest_history; ++k) {
    const double time = sets_[k].time - now.time;
    const Starts starts = starts_in(cluster, now, sets_[k], track.at(time), match.moved);
    const Sight& sight = starts.is_cut ? sets_[k].sight : everywhere;
    const Registration then = register_points(cluster.sample, sets_[k].grid, starts.shifts, 3, sight);
    if (!then.is_known()) {
      break;
    }
    track.add(then.shift, time, then.error);
  }
  return track;
}

bool CloudMotion::is_noisy(const Cluster& cluster) noexcept {
  return cluster.noise > VelocityEstimate::noisy && cluster.points.size() > stray_points;
}

const CloudMotion::Cluster* CloudMotion::same_in(const Set& then, const Cluster& cluster, const Set& now,
                                                 std::optional<Eigen::Vector3d> expected) const {
  const double duration = now.time - then.time, noise = sure * cluster.noise;
  const auto fits = [&](const Cluster& other) { return is_alike(other, cluster, PointGrid::edge + cluster.noise); };
  const Cluster* nearest = nullptr;
  double least = expected ? PointGrid::edge + noise : infinity;
  for (const Cluster& other : then.clusters) {
    const Eigen::Vector3d way = other.middle - cluster.middle;
    const double off = (way - expected.value_or(-duration * other.motion.velocity)).norm();
    if (off < least && way.norm() <= largest_speed_ * duration + noise && fits(other)) {
      nearest = &other;
      least = off;
    }
  }
  if (nearest == nullptr || expected || least <= 0.5 * nearest->size.norm()) {
    return nearest;
  }
  const Eigen::Vector3d place = nearest->middle + duration * nearest->motion.velocity;
  const auto is_nearer = [&](const Cluster& other) { return (other.middle - place).norm() < least && fits(other); };
  return std::any_of(now.clusters.begin(), now.clusters.end(), is_nearer) ? nullptr : nearest;
}

CloudMotion::Track CloudMotion::track_middle(const Cluster& cluster, const Set& now) const {
  Track track{.error = least_error};
  for (const Set& then : sets_) {
    const double duration = now.time - then.time;
    if (duration > longest_history) {
      break;
    }
    const bool is_newest = track.num == 1;
    const Cluster* const other = same_in(then, cluster, now, is_newest ? std::nullopt : std::optional(track.at(-duration)));
    const Way way = other == nullptr ? Way() : way_back(cluster, now, *other, then);
    if (way.shift) {
      track.has_moved = track.has_moved || (is_newest && other->motion.sets > 2 && !other->motion.velocity.isZero(0.0));
      track.add(*way.shift, -duration, cluster.noise / std::sqrt(static_cast<double>(way.num)));
    } else if (is_newest) {
      break;  // it has appeared
    }
  }
  return track;
}

void CloudMotion::follow(Cluster& cluster, const Track& track, double time) const {
  const auto& [shifts, times, num, error, has_moved] = track;
  if (num == 2) {
    follow_jump(cluster, shifts.col(1), error, time);
    return;
  }
  const LineFit<3> newest(shifts, times, 3);
  int used = num;
  LineFit<3> line = newest;
  for (; used > 3; --used) {
    line = LineFit<3>(shifts, times, used);
    if (line.scatter <= same_scatter * std::max(newest.scatter, error)) {
      break;
    }
  }
  line = used == 3 ? newest : line;
  const double deviation = line.deviation(error), speed = line.velocity.norm(),
               noise = is_noisy(cluster) ? error : std::max(error, noise_);
  double off = sphere * few_positions(used) * deviation;
  off += std::max(0.0, (line.velocity - newest.velocity).norm() - sure * newest.deviation(error));
  off += slip * speed * std::min(1.0, error / other_points);
  const bool is_far = speed * line.spread > sure * std::max(large_noise, noise);
  const bool moves = speed > slowest && is_motion(line, used, noise, has_moved || is_far);
  cluster.scatter = newest.scatter;
  cluster.motion = {.uncertainty = std::min(largest_speed_, moves ? off : off + speed), .sets = num};
  if (moves) {
    cluster.motion.velocity = line.velocity * std::min(1.0, largest_speed_ / speed);
  }
}

bool CloudMotion::has_jumped(const Cluster& cluster, double way, double error, double duration) const {
  const Sight& sight = sets_[0].sight;
  if (!sight || duration < long_wait || duration > longest_jump || cluster.points.size() < least_jumping ||
      way <= std::max(least_jump, surely_jumped * std::max(error, noise_))) {
    return false;
  }
  const auto places = cluster.sample.colwise();
  const auto num = static_cast<double>(std::count_if(places.begin(), places.end(), sight));
  return num >= seen_before * static_cast<double>(cluster.sample.cols());  // else it may have been there, and hidden
}

void CloudMotion::follow_jump(Cluster& cluster, const Eigen::Vector3d& shift, double error, double time) const {
  const double duration = time - sets_[0].time, way = shift.norm();
  cluster.motion = {.uncertainty = std::min(largest_speed_, (way + sure * error) / duration), .sets = 2};
  if (has_jumped(cluster, way, error, duration)) {
    const double most = largest_speed_ * duration;
    cluster.motion.velocity = -shift / duration * std::min(1.0, most / way);
    cluster.motion.uncertainty = std::min(most, sphere * few_positions(3) * error + jump_slip * way) / duration;
  }
}

void CloudMotion::learn_noise(const Set& set) {
  std::vector<std::pair<double, std::size_t>> scatters;
  std::size_t num = 0;
  for (const Cluster& cluster : set.clusters) {
    if (cluster.scatter >= 0.0) {
      scatters.emplace_back(cluster.scatter, cluster.points.size());
      num += cluster.points.size();
    }
  }
  std::sort(scatters.begin(), scatters.end());
  std::size_t below = 0;
  for (const auto& [scatter, points] : scatters) {
    below += points;
    if (2 * below >= num) {
      noise_ = noise_ == 0.0 ? scatter : std::hypot(std::sqrt(1.0 - learned) * noise_, std::sqrt(learned) * scatter);
      return;
    }
  }
}

void CloudMotion::spread_out(Set& set, const std::vector<RestMemory::Rest>& rests) {
  set.motions.resize(rests.size());
  for (std::size_t n = 0; n < rests.size(); ++n) {
    set.motions[n] = {.uncertainty = std::min(largest_speed_, drift(RestMemory::reach, std::max(rests[n].age, background_age))),
                      .sets = most_sets};
  }
  for (const Cluster& cluster : set.clusters) {
    const bool is_known = cluster.motion.sets > 1, moves = !cluster.motion.velocity.isZero(0.0);
    const double within = std::max(RestMemory::reach, cluster.noise);
    for (const int k : cluster.points) {
      const auto n = static_cast<std::size_t>(k);
      PointMotion& motion = set.motions[n];
      motion = cluster.motion;
      if (is_known && !moves && rests[n].sets > 0) {
        motion.uncertainty = std::min(motion.uncertainty, drift(within, rests[n].age));
      } else if (is_known && !moves && cluster.points.size() > stray_points) {
        motion = {.uncertainty = largest_speed_};  // a new part
      }
    }
  }
  for (std::size_t n = 0; n < rests.size(); ++n) {
    if (set.motions[n].velocity.isZero(0.0)) {
      memory_.rests(set.points.col(static_cast<Eigen::Index>(n)), set.motions[n].sets > 1);
    }
  }
  for (std::size_t n = 0; n < rests.size(); ++n) {
    if (!set.motions[n].velocity.isZero(0.0)) {
      memory_.moves(set.points.col(static_cast<Eigen::Index>(n)));
    }
  }
}

}  // namespace sidestep

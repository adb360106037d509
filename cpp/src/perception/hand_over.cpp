// What the map holds, as obstacles of the controller.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "image_sight.hpp"
#include "impl.hpp"
#include "nearby.hpp"

namespace sidestep {
namespace {

constexpr double ever = std::numeric_limits<double>::infinity();
constexpr double border_period = 0.2;    // Time between two searches for the border of unseen space [s].
constexpr double noise_explained = 3.0;  // Noise of a depth that a told shape explains, in standard deviations.
constexpr double pushed_back = 0.5;      // Distance by which balls stand behind what is seen, in edges of a cell.
constexpr double counts_beside = 0.35;   // Age up to which a motion counts for what another camera shows [s],
constexpr double beside = 0.1;           // so near to the box of what moves [m]: no camera sees its edges.
constexpr int few_cells = 3;             // Number of cells that can be noise,
constexpr double small_cell = 0.05;      // of that edge at most [m],
constexpr double sure_age = 0.13;        // and time for which they must move away from what rests to be none [s].
constexpr double unsure_speed = 0.5;     // Uncertainty of what appears apart from what rests, at most [m/s].
constexpr double moves_unseen = 0.4;     // Time for which what moved or may move goes on where no image shows it [s].
constexpr double least_shown = 0.01;     // Time for which an image counts until the next one, at least [s].
constexpr double grown = 0.002;          // Growth of a box since it was compared, from which on it is compared again [m].

/// Adds a cell that moves to what has its velocity.
void add_mover(std::vector<Mover>& movers, const Mover& cell) {
  const auto known =
      std::find_if(movers.begin(), movers.end(), [&](const Mover& mover) { return mover.velocity == cell.velocity; });
  if (known == movers.end()) {
    movers.push_back(cell);
  } else {
    known->box.extend(cell.box);
    known->cells += cell.cells;
    known->is_apart = known->is_apart || cell.is_apart;
  }
}

/// A voxel as it is when what is in it has moved on [m].
Voxel moved_by(Voxel voxel, const Eigen::Vector3d& way) {
  for (float* const corner : {voxel.low, voxel.high, voxel.frame_low, voxel.frame_high}) {
    Eigen::Map<Eigen::Vector3f> at(corner);
    at += way.cast<float>();
  }
  return voxel;
}

/// Drops few cells that can be the noise of what rests, where nothing larger moves: they come and go beside it, and line up now and then.
void drop_noise(std::vector<Mover>& movers) {
  const auto few = std::partition(movers.begin(), movers.end(), [](const Mover& mover) { return mover.cells > few_cells; });
  const auto is_noise = [&](const Mover& mover) {
    return (!mover.is_apart || !(mover.age >= sure_age)) && std::none_of(movers.begin(), few, [&](const Mover& larger) {
             return larger.box.exteriorDistance(mover.box) <= beside;
           });
  };
  movers.erase(std::remove_if(few, movers.end(), is_noise), movers.end());
}

}  // namespace

void Perception::Impl::add_unseen(const SeenImage& seen) {
  unseen->add(seen);
  for (const BodyEllipsoid& ellipsoid : views.front().mask.ellipsoids()) {
    const KinematicState::Link& link = link_or_world(now, ellipsoid.joint);
    unseen->add_arm(link.R_WL * ellipsoid.mean + link.p_WL, link.R_WL * ellipsoid.shape * link.R_WL.transpose(), seen.time);
  }
  if (std::abs(seen.time - unseen_time) >= border_period) {
    unseen_time = seen.time;
    border = unseen->border(seen.time);
    const Eigen::Index num = border.cols();
    controller.set_obstacles(
        num == 0 ? Obstacles::none()
                 : Obstacles(border, Eigen::VectorXd::Constant(num, unseen->radius()), Eigen::Matrix3Xd::Zero(3, num)),
        {unseen_source, SourceOptions::untold, ever, true});
  }
}

void Perception::Impl::find_told(double time) {
  told.clear();
  told_version = 0;
  for (SourceContent& source : controller.said()) {
    const bool is_own =
        source.name == memory_source || source.name == unseen_source ||
        std::any_of(views.begin(), views.end(), [&](const View& view) { return view.camera.name == source.name; });
    if (is_own || source.obstacles->size() == 0) {
      continue;
    }
    told_version += source.obstacles->version();
    if (source.obstacles->tree().moves() && std::isfinite(source.time)) {  // where it was when the image was captured
      auto then = std::make_shared<Obstacles>(*source.obstacles);
      then->advance(time - source.time);
      source.obstacles = std::move(then);
    }
    told.push_back(std::move(source.obstacles));
  }
}

bool Perception::Impl::is_explained(std::size_t number) {
  const Voxel& voxel = map.voxels()[number];
  Tested& last = tested[number];
  const bool has_grown = (voxel.low_corner() - Eigen::Vector3f(last.low).cast<double>()).minCoeff() < -grown ||
                         (voxel.high_corner() - Eigen::Vector3f(last.high).cast<double>()).maxCoeff() > grown;
  if (last.cell == voxel.cell && last.version == told_version && !has_grown) {
    return last.is_explained;
  }
  std::copy(voxel.low, voxel.low + 3, last.low);
  std::copy(voxel.high, voxel.high + 3, last.high);
  last.cell = voxel.cell;
  last.version = told_version;
  const View& view = views[voxel.camera];
  const Eigen::Vector3d centre = voxel.middle();
  const double depth = (centre - view.X_WC.translation()).norm();
  const double error = static_cast<double>(voxel.error) + noise_explained * view.camera.noise.sigma(depth);
  const double thin = 0.5 * (voxel.high_corner() - voxel.low_corner()).minCoeff();
  last.is_explained = std::any_of(told.begin(), told.end(), [&](const std::shared_ptr<const Obstacles>& shapes) {
    return distance_to(*shapes, centre, error + 1e-6) + thin <= error;
  });
  return last.is_explained;
}

bool Perception::Impl::is_left_out(const Voxel& voxel) const {
  for (const Region& region : regions) {
    const Eigen::Vector3d centre =
        region.frame < 0 ? voxel.middle()
                         : Eigen::Vector3d(frame_pose(arm->robot(), now, region.frame).inverse() * voxel.middle());
    if (distance_to(region.balls, centre, region.grow + 1e-6) <= region.grow) {
      return true;
    }
  }
  return false;
}

CellBall Perception::Impl::ball_of(const Voxel& voxel, bool moved) const {
  // The middle of what the last image shows moves with it; the ball holds what images before have shown, too.
  CellBall ball = ball_behind(moved ? voxel.frame_middle() : voxel.middle(), voxel.low_corner(), voxel.high_corner(),
                              views[voxel.camera].X_WC.translation(), pushed_back * map.edge(voxel));
  ball.radius += static_cast<double>(voxel.error);
  return in_single_precision(ball);
}

Obstacles Perception::Impl::balls(const std::vector<int>& chosen, bool moved) const {
  if (chosen.empty()) {
    return Obstacles::none();
  }
  const auto num = static_cast<Eigen::Index>(chosen.size());
  Eigen::Matrix3Xd points(3, num);
  Eigen::VectorXd radii(num);
  for (Eigen::Index n = 0; n < num; ++n) {
    const auto index = static_cast<std::size_t>(chosen[static_cast<std::size_t>(n)]);
    const CellBall ball = ball_of(map.voxels()[index], moved);
    points.col(n) = ball.centre;
    radii[n] = ball.radius;
  }
  return Obstacles(std::move(points), std::move(radii), Eigen::Matrix3Xd::Zero(3, num));
}

void Perception::Impl::find_velocities(View& view, double time) {
  fresh.clear();
  doubtful.clear();
  view.movers.clear();
  const auto sees = std::make_shared<const ImageSight>(view.camera, view.X_WC, view.image, view.mask.front());
  const Sight sight = [sees](const Eigen::Vector3d& place) { return sees->shows(place); };
  const bool is_first = time <= view.begin;
  for (const int index : shown) {
    const auto n = static_cast<std::size_t>(index);
    velocities[n].setZero();
    uncertainties[n] = 0.0f;
    map.set_moves(index, false);
    const Voxel& voxel = map.voxels()[n];
    // What the first image shows may rest, and is known to once others have shown it; what moves comes to other cells.
    if (is_first || voxel.first <= view.begin) {
      uncertainties[n] = view.stands_still && VoxelMap::may_move(voxel) ? static_cast<float>(unsure_speed) : 0.0f;
    } else if (!map.is_settled(voxel, view.X_WC.translation(), view.camera.noise)) {
      fresh.push_back(index);
    }
  }
  if (is_first) {
    view.motion.begin(balls(shown, true), time, sight);
    return;
  }
  if (fresh.empty()) {
    view.motion.forget();
    return;
  }
  const Obstacles candidates = balls(fresh, true);
  // Where the camera moves, the border of its image uncovers things, and their middles move with it.
  const Eigen::VectorXd noise = Eigen::VectorXd::NullaryExpr(candidates.size(), [&](Eigen::Index n) {
    return view.stands_still ? view.camera.noise.sigma((candidates.points().col(n) - view.X_WC.translation()).norm()) : 0.0;
  });
  const VelocityEstimate::Result found = view.motion.update(candidates, time, sight, noise);
  for (Eigen::Index n = 0; n < candidates.size(); ++n) {
    if (!found.velocities.col(n).isZero(0.0)) {
      const Voxel& voxel = map.voxels()[static_cast<std::size_t>(fresh[static_cast<std::size_t>(n)])];
      add_mover(view.movers, {.box = Eigen::AlignedBox3d(candidates.points().col(n).eval()),
                              .velocity = found.velocities.col(n),
                              .uncertainty = found.uncertainty[n],
                              .cells = map.edge(voxel) > small_cell ? few_cells + 1 : 1,
                              .age = (found.sets[n] - 1) * (time - view.before),
                              .is_apart = !map.is_beside_rest(voxel)});
    }
  }
  drop_noise(view.movers);
  for (Eigen::Index n = 0; n < candidates.size(); ++n) {
    const int index = fresh[static_cast<std::size_t>(n)];
    const auto at = static_cast<std::size_t>(index);
    const auto is_of = [&](const Mover& mover) { return mover.velocity == found.velocities.col(n); };
    if (std::any_of(view.movers.begin(), view.movers.end(), is_of)) {
      velocities[at] = found.velocities.col(n).cast<float>();
      uncertainties[at] = static_cast<float>(found.uncertainty[n]);
      map.set_moves(index, true);
      if (found.sets[n] == 2 || noise[n] > VelocityEstimate::noisy) {
        doubtful.push_back(index);
      }
    } else if (view.stands_still && !map.is_beside_rest(map.voxels()[at])) {
      // A velocity that is not believed is not known to be zero either.
      uncertainties[at] = static_cast<float>(std::min(unsure_speed, found.uncertainty[n] + found.velocities.col(n).norm()));
    }
  }
}

const Mover* Perception::Impl::mover_beside(std::size_t number, const Eigen::Vector3d& point, double time) const {
  const Mover* nearest = nullptr;
  double distance = beside;
  for (std::size_t k = 0; k < views.size(); ++k) {
    const double age = time - views[k].time;
    if (k == number || !(std::abs(age) <= counts_beside)) {  // NaN: it has shown nothing yet
      continue;
    }
    for (const Mover& mover : views[k].movers) {
      const double away = mover.box.exteriorDistance((point - age * mover.velocity).eval());
      if (away <= distance) {
        distance = away;
        nearest = &mover;
      }
    }
  }
  return nearest;
}

Obstacles Perception::Impl::moving_balls(const SeenImage& seen) {
  const std::size_t number = seen.number;
  find_velocities(views[number], seen.time);
  handed.clear();
  for (const int index : shown) {
    const auto n = static_cast<std::size_t>(index);
    handed.push_back({index, velocities[n].cast<double>(), static_cast<double>(uncertainties[n]), 0.0});
  }
  for (const int index : doubtful) {
    handed.push_back({index, Eigen::Vector3d::Zero(), unsure_speed, 0.0});
  }
  for (const int index : fresh) {
    const Voxel& voxel = map.voxels()[static_cast<std::size_t>(index)];
    if (const Mover* const mover = voxel.moves ? nullptr : mover_beside(number, voxel.frame_middle(), seen.time)) {
      handed.push_back({index, mover->velocity, mover->uncertainty, 0.0});
    }
  }
  // What is not shown any more goes on, and what its velocity may be wrong by counts for as long: T u' = (T + age) u.
  const double shown_for = std::max({controller.time() - seen.time, seen.time - views[number].before, least_shown});
  for (const int index : last_remembered) {
    const auto n = static_cast<std::size_t>(index);
    const Voxel& voxel = map.voxels()[n];
    const double age = seen.time - voxel.last;
    const bool rested = uncertainties[n] == 0.0f && velocities[n].isZero(0.0f);
    const bool was_seen_empty = voxel.free_images > 0 || voxel.missed_samples > 0;
    if (voxel.camera != number || rested || was_seen_empty || !(age > 0.0 && age <= moves_unseen)) {
      continue;
    }
    const Eigen::Vector3d velocity = velocities[n].cast<double>();
    const Voxel moved = moved_by(voxel, age * velocity);
    if (!map.sees_through(moved, seen) && !is_left_out(moved)) {
      handed.push_back({index, velocity, static_cast<double>(uncertainties[n]) * (1.0 + age / shown_for), age});
    }
  }
  if (handed.empty()) {
    return Obstacles::none();
  }
  const auto num = static_cast<Eigen::Index>(handed.size());
  Eigen::Matrix3Xd points(3, num), speeds(3, num);
  Eigen::VectorXd radii(num), uncertainty(num);
  for (Eigen::Index n = 0; n < num; ++n) {
    const Handed& one = handed[static_cast<std::size_t>(n)];
    CellBall ball = ball_of(map.voxels()[static_cast<std::size_t>(one.voxel)], true);
    if (one.age > 0.0) {
      ball.centre += one.age * one.velocity;
      ball = in_single_precision(ball);
    }
    points.col(n) = ball.centre;
    radii[n] = ball.radius;
    speeds.col(n) = one.velocity;
    uncertainty[n] = one.uncertainty;
  }
  const Obstacles all(std::move(points), std::move(radii), std::move(speeds));
  return uncertainty.isZero(0.0) ? all : all.moving(all.velocities(), std::move(uncertainty));
}

void Perception::Impl::hand_over(const SeenImage& seen, PerceptionReport& report) {
  find_told(seen.time);
  const std::vector<Voxel>& voxels = map.voxels();
  tested.resize(voxels.size());
  is_excluded.resize(voxels.size());
  velocities.resize(voxels.size(), Eigen::Vector3f::Zero());
  uncertainties.resize(voxels.size());
  shown.clear();
  remembered.clear();
  for (const int index : map.touched()) {
    const auto n = static_cast<std::size_t>(index);
    if (!voxels[n].counts || map.is_background(voxels[n])) {
      map.set_moves(index, false);
      continue;
    }
    is_excluded[n] = is_explained(n) || is_left_out(voxels[n]) ? 1 : 0;
    if (is_excluded[n] == 0) {
      shown.push_back(index);
    }
  }
  for (std::size_t n = 0; n < voxels.size(); ++n) {
    const Voxel& voxel = voxels[n];
    if (voxel.cell < 0 || !voxel.counts) {
      continue;
    }
    report.explained += is_excluded[n] != 0 ? 1 : 0;
    if (is_excluded[n] == 0 && voxel.shown_by == 0 && !map.is_background(voxel)) {
      remembered.push_back(static_cast<int>(n));
    }
  }
  if (remembered != last_remembered) {  // boxes of what is not seen do not change
    controller.set_obstacles(balls(remembered, false), {memory_source, SourceOptions::untold, ever, true});
    last_remembered.swap(remembered);
  }
  controller.set_obstacles(moving_balls(seen), {seen.camera.name, seen.time, settings.valid_for, true});
  report.seen = static_cast<int>(shown.size());
  report.remembered = static_cast<int>(last_remembered.size());
  report.unseen = static_cast<int>(border.cols());
}

bool Perception::Impl::drop_region(const std::string& name) {
  const auto found = std::find_if(regions.begin(), regions.end(), [&](const Region& region) { return region.name == name; });
  if (found == regions.end()) {
    return false;
  }
  regions.erase(found);
  return true;
}

std::vector<Perception::Cell> Perception::Impl::cells() const {
  double newest = -std::numeric_limits<double>::infinity();
  for (const View& view : views) {
    newest = std::isnan(view.time) ? newest : std::max(newest, view.time);
  }
  std::vector<Cell> all;
  for (std::size_t n = 0; n < is_excluded.size(); ++n) {
    const Voxel& voxel = map.voxels()[n];
    if (voxel.cell >= 0 && voxel.counts && is_excluded[n] == 0 && !map.is_background(voxel)) {
      const bool is_remembered = voxel.shown_by == 0;
      const CellBall ball = ball_of(voxel, !is_remembered);
      const Eigen::Vector3d velocity = is_remembered ? Eigen::Vector3d::Zero() : Eigen::Vector3d(velocities[n].cast<double>());
      all.push_back({ball.centre, ball.radius, voxel.camera, newest - voxel.last, is_remembered, velocity, voxel.is_hidden});
    }
  }
  return all;
}

std::vector<PixelLabel> Perception::Impl::labels(const View& view) const {
  std::vector<PixelLabel> labels(view.image.labels(), view.image.labels() + view.image.size());
  const Eigen::Matrix3f R = view.shown_X_WC.linear().cast<float>();
  const Eigen::Vector3f t = view.shown_X_WC.translation().cast<float>();
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] == PixelLabel::obstacle) {
      const float z = view.depth[i];
      const Eigen::Vector3f p = R * Eigen::Vector3f(view.rays.x()[i] * z, view.rays.y()[i] * z, z) + t;
      const int voxel = map.voxel_of(p.data());
      if (voxel >= 0 && static_cast<std::size_t>(voxel) < tested.size() && is_excluded[static_cast<std::size_t>(voxel)] != 0) {
        labels[i] = tested[static_cast<std::size_t>(voxel)].is_explained ? PixelLabel::explained : PixelLabel::left_out;
      }
    }
  }
  return labels;
}

}  // namespace sidestep

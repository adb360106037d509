#include "closing_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "../math/settings.hpp"

namespace sidestep {
namespace {

constexpr double reach = 0.15;  // [m] of clearance: three sets at 10 Hz see 0.3 m/s before it is 0.09 m; farther takes longer
constexpr double unchanged = 1e-9;        // Change of a clearance that is rounding: the same set again [m].
constexpr double least_spacing = 0.008;   // Least time between changes that are kept; faster sets are summed up [s].
constexpr double longest_spacing = 0.4;   // Largest time between two sets that make a motion [s].
constexpr double slowest_closing = 0.02;  // Least closing speed that is estimated; slower is for SafetySettings::margin [m/s].
constexpr double fastest = 5.0;           // Largest closing speed: faster is another obstacle [m/s].
constexpr double least_way = 0.003;       // Least loss of clearance in a window: more than good depth cameras' noise [m].
constexpr double times_noise = 5.0;       // The same in units of the noise: more than independent errors lose [-].
constexpr double while_closing = 0.5;     // Share of both that is enough once it closes [-].
constexpr double brisk =
    1.0;  // Closing speed beyond which three changes must agree: points that jump agree twice by chance [m/s].
constexpr double uneven = 0.5;          // Share of a steady closing by which one change may differ [-].
constexpr double first_noise = 0.002;   // Noise that is assumed until changes tell it: a depth camera's [m].
constexpr int remembered = 20;          // Number of changes that the noise is the mean of.
constexpr int assumed = 4;              // Number of changes for which the first noise counts at the start.
constexpr double lateness = 2.0;        // Spacings after which the next set is late [-].
constexpr double jump = 0.005;          // Change by one set that brings doubt; less may be noise [m].
constexpr int doubted_sets = 2;         // Sets after that one which must show the same: three in a row.
constexpr int most_doublings = 2;       // Doublings of that number where something flickered, at most.
constexpr double flicker_memory = 2.0;  // Time for which a flicker is remembered [s].
constexpr double longest_doubt = 0.3;   // Longest doubt: three sets at 10 Hz; twice and four times as long after flickers [s].

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

std::vector<std::string> links_of(const ClearanceField& field, const Body& body) {
  std::vector<std::string> links;
  for (int k = 0; k < field.size(); ++k) {
    links.push_back(body.links[static_cast<std::size_t>(field.component(k))]);
  }
  return links;
}

Eigen::Matrix3Xd middles_of(const ClearanceField& field, const Body& body) {
  Eigen::Matrix3Xd middles(3, field.size());
  for (int k = 0; k < field.size(); ++k) {
    middles.col(k) = body.means.col(field.component(k));
  }
  return middles;
}

}  // namespace

ClosingEstimate::ClosingEstimate(const Robot& robot, const Body& body, std::shared_ptr<const ClearanceField> field,
                                 double margin)
    : robot_(robot),
      field_(std::move(field)),
      margin_(margin),
      links_(links_of(*field_, body)),
      middles_(middles_of(*field_, body)),
      state_(robot),
      rest_(Eigen::VectorXd::Zero(robot.num_coordinates())),
      before_(robot.num_coordinates(), field_->size()),
      now_(before_),
      tracks_(static_cast<std::size_t>(field_->size()), Track{.noise = first_noise, .differences = assumed}),
      doubts_(tracks_.size()),
      speeds_(Eigen::VectorXd::Zero(field_->size())) {}

void ClosingEstimate::go_on_from(const ClosingEstimate& before) noexcept {
  begun_ = before.begun_;
  last_set_ = before.last_set_;
  last_kept_ = before.last_kept_;
  late_ = before.late_;
  time_ = before.time_;
  for (std::size_t k = 0; k < tracks_.size(); ++k) {
    double least = infinity;
    for (std::size_t i = 0; i < before.tracks_.size(); ++i) {
      if (links_[k] != before.links_[i]) {
        continue;
      }
      const auto at = static_cast<Eigen::Index>(k), from = static_cast<Eigen::Index>(i);
      const double apart = (middles_.col(at) - before.middles_.col(from)).norm();
      if (apart < least) {
        least = apart;
        tracks_[k] = before.tracks_[i];
        doubts_[k] = before.doubts_[i];
        speeds_[at] = before.speeds_[from];
        now_.values[at] = before.now_.values[from];
      }
    }
  }
  num_closing_ = static_cast<int>((speeds_.array() > 0.0).count());
  advance(time_);
}

void ClosingEstimate::evaluate(const Obstacles& obstacles, Clearances& out) noexcept {
  out.clear();
  if (obstacles.size() > 0) {
    field_->evaluate(state_, obstacles, reach, Horizon{}, out.view(0, field_->size()));
  }
}

void ClosingEstimate::leave(ConstVectorRef q, const Obstacles& before) noexcept {
  state_.update(robot_, q, rest_);
  if (begun_) {
    evaluate(before, before_);
  }
}

void ClosingEstimate::take(const Obstacles& now, double time) noexcept {
  if (!std::exchange(begun_, true)) {
    last_set_ = last_kept_ = time;
    return;
  }
  evaluate(now, now_);
  const double since_set = time - last_set_, since_kept = time - last_kept_;
  const bool keeps = since_kept >= least_spacing;
  last_set_ = time;
  bool other = false;
  for (Eigen::Index k = 0; k < speeds_.size(); ++k) {
    const double a = before_.values[k], b = now_.values[k];
    other = other || (a != b && !(std::abs(a - b) <= unchanged));
  }
  for (Eigen::Index k = 0; other && k < speeds_.size(); ++k) {
    Track& track = tracks_[static_cast<std::size_t>(k)];
    const double a = before_.values[k], b = now_.values[k];
    track.pending += a < infinity && b < infinity ? a - b : unknown;
    if (keeps) {
      keep(track, since_kept);
      speeds_[k] = agreed(track, speeds_[k] > 0.0);
    }
  }
  for (Eigen::Index k = 0; k < speeds_.size(); ++k) {
    doubt(k, before_.values[k], now_.values[k], since_set, time);
  }
  if (other && keeps) {
    last_kept_ = time;
    late_ = time + lateness * std::min(since_kept, longest_spacing);
  }
  num_closing_ = static_cast<int>((speeds_.array() > 0.0).count());
}

void ClosingEstimate::keep(Track& track, double duration) noexcept {
  const double change = track.pending;
  track.pending = 0.0;
  if (std::isnan(change) || duration > longest_spacing) {
    track.count = 0;
    return;
  }
  if (track.count > 0) {
    const double differs = std::abs(change - track.change[0] * duration / track.duration[0]);
    track.differences = std::min(track.differences + 1, remembered - 1);
    track.noise += (differs - track.noise) / (track.differences + 1);
  }
  std::move_backward(track.change.begin(), track.change.end() - 1, track.change.end());
  std::move_backward(track.duration.begin(), track.duration.end() - 1, track.duration.end());
  track.change[0] = change;
  track.duration[0] = duration;
  track.count = std::min(track.count + 1, most_changes);
}

double ClosingEstimate::agreed(const Track& track, bool closes) noexcept {
  const double least = std::max(least_way, (closes ? while_closing : 1.0) * times_noise * track.noise);
  double way = track.count > 0 ? track.change[0] : 0.0, time = track.count > 0 ? track.duration[0] : 0.0;
  for (int n = 2; n <= track.count; ++n) {
    way += track.change[static_cast<std::size_t>(n) - 1];
    time += track.duration[static_cast<std::size_t>(n) - 1];
    const double speed = way / time;
    if (way < least || speed < slowest_closing || speed > fastest || (speed > brisk && n < 3)) {
      continue;
    }
    bool steady = true;
    for (std::size_t i = 0; i < static_cast<std::size_t>(n) && steady; ++i) {
      const double share = speed * track.duration[i];
      steady = std::abs(track.change[i] - share) <= uneven * share + track.noise;
    }
    if (steady) {
      return speed;
    }
  }
  return 0.0;
}

void ClosingEstimate::doubt(Eigen::Index k, double before, double now, double duration, double time) noexcept {
  Doubt& doubt = doubts_[static_cast<std::size_t>(k)];
  if (speeds_[k] > 0.0) {
    doubt.sets = 0;
  } else if (!(now < margin_)) {
    if (doubt.sets > 0) {
      doubt.flickers = std::min(doubt.flickers + 1, most_doublings);
      doubt.last = time;
    }
    doubt.sets = 0;
  } else if (before >= margin_ && before - now > jump) {
    doubt.flickers = time - doubt.last > flicker_memory ? 0 : doubt.flickers;
    doubt.sets = doubted_sets << doubt.flickers;
    doubt.until = time + std::min((doubt.sets + 1) * duration, longest_doubt * (1 << doubt.flickers));
  } else {
    doubt.sets = std::max(0, doubt.sets - 1);
  }
}

void ClosingEstimate::advance(double time) noexcept {
  time_ = time;
  if (num_closing_ > 0 && time > late_) {
    speeds_.setZero();
    num_closing_ = 0;
  }
  num_doubted_ = 0;
  for (Doubt& doubt : doubts_) {
    if (doubt.sets > 0 && time > doubt.until) {
      doubt.sets = 0;
    }
    num_doubted_ += doubt.sets > 0;
  }
}

void ClosingEstimate::widen(const Obstacles* obstacles, const std::array<Widening, most_sources>& parts) noexcept {
  widened_ = obstacles;
  widenings_ = parts;
}

double ClosingEstimate::widening(Eigen::Index point) const noexcept {
  if (widened_ == nullptr) {
    return 0.0;
  }
  const Widening& part = widenings_[widened_->part_of(point)];
  return part.reach + widened_->uncertainty()[point] * part.age;
}

const Clearances& ClosingEstimate::corrected(const Clearances& seen, Clearances& out) const noexcept {
  if (!changes()) {
    return seen;
  }
  out = seen;
  ClearanceState& approach = out.approach;
  for (Eigen::Index k = 0; k < speeds_.size(); ++k) {
    if (out.nearest[k] < 0) {
      continue;
    }
    if (speeds_[k] > 0.0) {  // lost is only what is seen to be
      approach.values[k] -= std::min(speeds_[k] * (time_ - last_kept_), std::max(approach.values[k], 0.0));
      approach.rates[k] -= speeds_[k];
    } else if (is_doubted(k)) {
      approach.values[k] = std::max(approach.values[k], std::min(margin_, out.margins[k]));
      out.least[k] = std::max(out.least[k], 0.0);
    }
    if (const double reach = widening(out.nearest[k]); reach > 0.0) {
      const double margin = std::min(margin_, out.margins[k]);
      approach.values[k] = std::min(approach.values[k], std::max(approach.values[k] - reach, margin));
    }
  }
  return out;
}

double ClosingEstimate::nearest(double duration) const noexcept {
  const double since = time_ - last_kept_ + duration;
  return (speeds_.array() > 0.0).select(now_.values.array() - speeds_.array() * since, infinity).minCoeff();
}

}  // namespace sidestep

#include "sidestep/controller/recorded_run.hpp"

#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "../math/settings.hpp"
#include "clock.hpp"
#include "recorded_arm.hpp"
#include "recorded_worlds.hpp"
#include "recording_reader.hpp"
#include "words.hpp"

namespace sidestep {
namespace {

constexpr double first_link_period = 0.02;  // Time between two moments of link clearances [s]; it doubles with their number.
constexpr std::size_t most_link_moments = 2000;
constexpr std::uint64_t steps_between_looks = 1024;  // Steps between two looks at whether the reading is interrupted.
constexpr const char* arm_itself = "the arm itself";

std::string in_words(const recording::RequestRecord& request) {
  using Kind = recording::RequestRecord::Kind;
  switch (request.kind) {
    case Kind::none: return "no goal";
    case Kind::joint_goal: return "a joint goal";
    case Kind::pose_goal:
      return "a pose goal of '" + (request.poses.empty() ? std::string() : request.poses.front().frame) + "'";
    case Kind::velocity: return "a velocity";
    case Kind::twist: return "a twist of '" + request.frame + "'";
    case Kind::trajectory: return "a trajectory";
  }
  return "a request";
}

const char* in_words(SafetyStatus status) noexcept {
  switch (status) {
    case SafetyStatus::ok: return "as requested";
    case SafetyStatus::limited: return "changed by a limit or a clearance";
    case SafetyStatus::relaxed: return "limits of jerk, speed or acceleration gave way";
    case SafetyStatus::margin_lost: return "not every margin or position limit is kept";
    case SafetyStatus::tracking_lost: return "the arm does not follow the command";
    case SafetyStatus::stale: return "stopped: a source of obstacles is overdue, or none was set";
    case SafetyStatus::stopping: return "a damped stop: an unusable state, or a touch";
    case SafetyStatus::clearance_lost: return "the arm overlaps an obstacle or itself";
  }
  return "";
}

/// Throws std::invalid_argument where a command is of another arm than one with nv coordinates.
void check_size(const Command& c, std::size_t nv) {
  const auto check = [nv](const char* name, auto size) {
    if (static_cast<std::size_t>(size) != nv) {
      throw std::invalid_argument(std::string("a step's ") + name + " has " + std::to_string(size) + " entries, the arm " +
                                  std::to_string(nv) + " coordinates");
    }
  };
  check("position", c.position.size());
  check("velocity", c.velocity.size());
  check("acceleration", c.acceleration.size());
  check("wanted", c.wanted.size());
  check("torque", c.torque.size());
  check("torque_without_gravity", c.torque_without_gravity.size());
  check("limits", c.limits.size());
}

void append(std::vector<double>& rows, const Eigen::VectorXd& row) { rows.insert(rows.end(), row.begin(), row.end()); }

}  // namespace

/// Fills a run record by record.
class RunReader {
 public:
  RunReader(RecordedRun& run, bool scenes)
      : run_(run), keeps_scenes_(scenes), command_(static_cast<int>(run.nv)), clock_(period(run), synchronous(run)) {}

  void begin_file(const recording::HeadRecord& head) {
    commands_.emplace(head.fields);
    worlds_.begin_file(head.version);
    arms_.insert_or_assign(head.arm_number, head.arm_file);
  }
  void take(const recording::RecordingReader& record);
  void finish();

 private:
  static double period(const RecordedRun& run) { return run.header.settings.period; }
  static bool synchronous(const RecordedRun& run) { return run.header.settings.synchronous; }
  void take_step(const recording::RecordingReader& record);
  void use_arm(std::uint64_t number);
  void append_command(double time);
  void append_link_clearances(double time);
  void append_scene();
  void thin_out();
  std::int32_t parties_of(int coordinate, int point);
  std::int32_t request_of(std::uint64_t number);

  RecordedRun& run_;
  const bool keeps_scenes_;
  std::uint64_t scene_version_ = 0;  // of the obstacles of the last scene
  std::optional<recording::CommandReader> commands_;
  recording::StepInputs step_;
  Command command_;
  Clock clock_;
  std::map<std::uint64_t, std::string> arms_, requests_;  // by number: arm files, and requests in words
  RecordedWorlds worlds_;
  std::uint64_t arm_number_ = 0, world_ = 0, last_request_ = 0;
  std::unique_ptr<RecordedArm> arm_;
  Eigen::VectorXd q_;  // the last that is finite; empty: none
  std::map<std::string, std::int32_t> parties_;
  double link_period_ = first_link_period, next_link_time_ = -infinity;
  std::vector<std::vector<double>> of_links_;
  std::vector<double> of_itself_;
};

void RunReader::take(const recording::RecordingReader& record) {
  using recording::RecordKind;
  switch (record.kind) {
    case RecordKind::head: break;
    case RecordKind::arm: {
      auto arm = recording::read_record<recording::ArmRecord>(record.content);
      arms_.insert_or_assign(arm.number, std::move(arm.file));
      if (arm.lifted_number != 0) {
        arms_.insert_or_assign(arm.lifted_number, std::move(arm.lifted_file));
      }
      break;
    }
    case RecordKind::request: {
      const auto request = recording::read_record<recording::RequestRecord>(record.content);
      requests_.insert_or_assign(request.number, in_words(request));
      break;
    }
    case RecordKind::obstacles: worlds_.keep_set(record.content); break;
    case RecordKind::world: worlds_.keep_world(record.content); break;
    case RecordKind::step: take_step(record); break;
    case RecordKind::done: {
      recording::Decoder in(record.content);
      in.take<std::uint64_t>();  // steps
      run_.lost = in.take<std::uint64_t>();
      run_.complete = true;
      break;
    }
  }
}

void RunReader::take_step(const recording::RecordingReader& record) {
  recording::Decoder in(record.content);
  recording::read_step_inputs(in, step_);
  const auto nv = static_cast<Eigen::Index>(run_.nv);
  if (step_.q.size() != nv || step_.v.size() != nv) {
    throw std::invalid_argument("a step has " + std::to_string(step_.q.size()) + " coordinates, the arm " + std::to_string(nv));
  }
  // The time of the record is that of the step, also where it was not told: sources were captured on that clock.
  const Tick& tick = clock_.begin_step(std::isfinite(step_.time) ? step_.time : record.time);
  commands_->read(recording::command_of(record.content), command_);
  check_size(command_, run_.nv);
  use_arm(step_.arm);
  if (step_.obstacles != 0 && step_.obstacles != world_) {
    arm_->put(worlds_.take(step_.obstacles));
    world_ = step_.obstacles;
  }
  if (step_.q.allFinite()) {
    q_ = step_.q;
  }
  if (q_.size() > 0) {
    arm_->update(q_, tick);
    if (record.time >= next_link_time_) {
      append_link_clearances(record.time);
    }
  }
  append_command(record.time);
}

void RunReader::use_arm(std::uint64_t number) {
  const auto found = arms_.find(number);
  if (arm_ && (number == arm_number_ || found == arms_.end())) {
    return;  // the first steps of a black box may still be of the arm before
  }
  auto next = std::make_unique<RecordedArm>(found == arms_.end() ? run_.header.arm : recording::arm_of(found->second),
                                            run_.header.settings, run_.links);
  if (arm_) {
    next->put(arm_->world());
    next->go_on_from(*arm_);
  }
  arm_ = std::move(next);
  arm_number_ = number;
  arms_.erase(arms_.begin(), arms_.lower_bound(number));
}

void RunReader::append_command(double time) {
  const Command& c = command_;
  run_.time.push_back(time);
  append(run_.q, step_.q);
  append(run_.v, step_.v);
  append(run_.position, c.position);
  append(run_.velocity, c.velocity);
  append(run_.acceleration, c.acceleration);
  append(run_.wanted, c.wanted);
  append(run_.torque, c.torque);
  append(run_.torque_without_gravity, c.torque_without_gravity);
  run_.limits.insert(run_.limits.end(), c.limits.begin(), c.limits.end());
  run_.status.push_back(c.status);
  run_.activity.push_back(c.activity);
  run_.clearance.push_back(c.clearance);
  run_.distance.push_back(c.distance);
  run_.speed.push_back(c.speed);
  run_.speed_limit.push_back(c.speed_limit);
  run_.tracking_error.push_back(c.tracking_error);
  run_.nearest.push_back(parties_of(c.coordinate, c.point));
  run_.bound_by.push_back(parties_of(c.bound_by, c.bound_by == c.coordinate ? c.point : -1));
  run_.request.push_back(request_of(step_.request));
  ++run_.steps;
}

void RunReader::append_link_clearances(double time) {
  arm_->write_clearances(q_, RecordedRun::largest_link_clearance, of_links_.emplace_back(), of_itself_.emplace_back());
  run_.link_time.push_back(time);
  if (keeps_scenes_) {
    append_scene();
  }
  next_link_time_ = time + link_period_;
  if (run_.link_time.size() > most_link_moments) {
    thin_out();
  }
}

void RunReader::append_scene() {
  const Obstacles& obstacles = arm_->obstacles();
  if (!run_.scenes.empty() && obstacles.version() == scene_version_) {
    run_.scenes.push_back(run_.scenes.back());
    return;
  }
  scene_version_ = obstacles.version();
  const auto scene = std::make_shared<RecordedRun::Scene>();
  scene->points = obstacles.points().cast<float>();
  scene->radii = obstacles.radii().cast<float>();
  run_.scenes.push_back(scene);
}

void RunReader::thin_out() {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < run_.link_time.size(); k += 2, ++kept) {
    run_.link_time[kept] = run_.link_time[k];
    of_itself_[kept] = of_itself_[k];
    of_links_[kept].swap(of_links_[k]);
    if (keeps_scenes_) {
      run_.scenes[kept] = run_.scenes[k];
    }
  }
  run_.scenes.resize(keeps_scenes_ ? kept : 0);
  run_.link_time.resize(kept);
  of_itself_.resize(kept);
  of_links_.resize(kept);
  link_period_ *= 2.0;
}

std::int32_t RunReader::parties_of(int coordinate, int point) {
  const CoordinateLabel* const label = arm_->label(coordinate);
  if (label == nullptr) {  // nothing, or of an arm before the first that a black box holds
    return -1;
  }
  std::string words = parties(*label, arm_->words_for(point));
  const auto [found, is_new] = parties_.emplace(words, static_cast<std::int32_t>(run_.parties.size()));
  if (is_new) {
    run_.parties.push_back({label->name, std::move(words)});
  }
  return found->second;
}

std::int32_t RunReader::request_of(std::uint64_t number) {
  const auto found = requests_.find(number);
  if (found != requests_.end() && number != last_request_) {
    last_request_ = number;
    run_.requests.push_back(found->second);
    requests_.erase(requests_.begin(), found);
  }
  return number == last_request_ ? static_cast<std::int32_t>(run_.requests.size()) - 1 : -1;
}

void RunReader::finish() {
  const std::size_t num_links = run_.links.size();
  for (std::size_t k = 0; k < of_links_.size(); ++k) {
    of_links_[k].resize(num_links, std::numeric_limits<double>::quiet_NaN());
    run_.link_clearance.insert(run_.link_clearance.end(), of_links_[k].begin(), of_links_[k].end());
    run_.link_clearance.push_back(of_itself_[k]);
  }
  run_.links.emplace_back(arm_itself);
}

std::string RecordedRun::explain(std::size_t k) const {
  std::string text = std::string(to_string(status.at(k))) + ": " + in_words(status[k]);
  if (status[k] == SafetyStatus::tracking_lost) {
    text += ", farthest joint by " + in_digits(tracking_error[k], 3);
  }
  if (bound_by[k] >= 0) {
    text += "; changed by the clearance of " + parties[static_cast<std::size_t>(bound_by[k])].words;
  }
  if (nearest[k] >= 0 && std::isfinite(clearance[k])) {
    const std::string& words = parties[static_cast<std::size_t>(nearest[k])].words;
    text += clearance[k] < 0.0 ? "; " + words + " overlap by " + millimetres(clearance[k])
                               : "; nearest: " + words + ", " + millimetres(clearance[k]);
  }
  std::map<std::string, std::string> limited;  // joints by the limit that restricts them
  for (std::size_t j = 0; j < nv; ++j) {
    if (const Limit set = limits[k * nv + j]; set != Limit::none) {
      std::string& joints = limited[limit_in_words(set)];
      joints += (joints.empty() ? "'" : ", '") + header.arm.robot().coordinate_names()[j] + "'";
    }
  }
  for (const auto& [limit, joints] : limited) {
    text += "; " + limit + " of " + joints;
  }
  return text;
}

namespace {

/// Throws std::system_error, std::invalid_argument that names the file.
std::unique_ptr<recording::RecordingReader> open_of_now(const std::filesystem::path& path) {
  auto records = std::make_unique<recording::RecordingReader>(path);
  if (records->head.version == recording::step_file_format) {
    throw std::invalid_argument("recording '" + path.string() +
                                "': it is of Sidestep 0.2, and can only be replayed; record the motion again");
  }
  return records;
}

/// Throws std::invalid_argument that says what is wrong with a record.
void read_all(recording::RecordingReader& records, RunReader& reader, const Interrupted& interrupted) {
  reader.begin_file(records.head);
  for (std::uint64_t k = 0; records.next(); ++k) {
    if (k % steps_between_looks == 0 && interrupted()) {
      throw Interruption();
    }
    reader.take(records);
  }
  if (const std::string where = records.damage(); !where.empty()) {
    throw std::invalid_argument(where + " are not those that were written");
  }
}

}  // namespace

RecordedRun read_recorded_run(const std::vector<std::filesystem::path>& paths, bool scenes, const Interrupted& interrupted) {
  if (paths.empty()) {
    throw std::invalid_argument("no recording is named");
  }
  auto records = open_of_now(paths.front());
  RecordedRun run(recording::to_header(records->head));
  RunReader reader(run, scenes);
  const std::string first_arm = records->head.arm_file;
  for (std::size_t n = 0; n < paths.size(); ++n) {
    run.complete = false;
    std::string wrong;
    try {
      if (n > 0) {
        records = open_of_now(paths[n]);
      }
    } catch (const std::invalid_argument& error) {
      if (run.header.whole) {
        throw;
      }
      wrong = error.what();
    }
    const std::string what = "recording '" + paths[n].string() + "'";
    if (wrong.empty() && records->head.arm_file != first_arm &&
        recording::arm_of(records->head.arm_file).robot().coordinate_names() != run.header.arm.robot().coordinate_names()) {
      throw std::invalid_argument(what + ": it is of another arm than '" + paths.front().string() + "'");
    }
    try {
      if (wrong.empty()) {
        read_all(*records, reader, interrupted);
      }
    } catch (const std::invalid_argument& error) {
      wrong = what + ": after step " + std::to_string(run.steps) + ": " + error.what();
    }
    run.damage = run.damage.empty() ? wrong : run.damage;
    if (run.header.whole && !wrong.empty()) {
      break;  // the files of a black box stand alone
    }
  }
  reader.finish();
  return run;
}

}  // namespace sidestep

#include "black_box.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "recording_paths.hpp"
#include "recording_reader.hpp"

namespace sidestep {
namespace {

constexpr int files_per_box = 3;         // Number of whole files that hold the time to keep; one more is written.
constexpr std::size_t most_unused = 64;  // Number of worlds, and of requests, that stay where nobody steps.

/// Forgets all before the last with a number up to `used`.
template <class Map>
void forget_before(Map& map, std::uint64_t used) {
  auto last = map.upper_bound(used);
  if (last != map.begin()) {
    map.erase(map.begin(), std::prev(last));
  }
}

/// Forgets, down to that number, what no step has taken: neither the one in use nor what came after `settled`, which a step that is
/// still to be written may have taken. Whether there was any.
template <class Map>
bool forget_unused(Map& map, std::uint64_t settled) {
  const std::size_t before = map.size();
  while (map.size() > most_unused && std::next(map.begin())->first < settled) {
    map.erase(std::next(map.begin()));
  }
  return map.size() < before;
}

bool is_of_a_box(const std::filesystem::path& path) {
  return path.filename().string().starts_with(black_box_begin) && path.extension() == recording_suffix;
}

}  // namespace

BlackBox::BlackBox(std::filesystem::path folder, const std::string& arm, int num_coordinates, double seconds,
                   std::uint64_t most_bytes)
    : folder_(std::move(folder)), num_coordinates_(num_coordinates), seconds_(seconds), most_bytes_(most_bytes) {
  if (!(seconds > 0.0) || !std::isfinite(seconds)) {
    throw std::invalid_argument("black box: seconds is " + std::to_string(seconds) + ", allowed: positive and finite");
  }
  constexpr std::uint64_t least_bytes = std::uint64_t{1} << 20;
  if (most_bytes < least_bytes) {
    throw std::invalid_argument("black box: most_bytes is " + std::to_string(most_bytes) +
                                ", allowed: " + std::to_string(least_bytes) + " and more");
  }
  std::filesystem::create_directories(folder_);
  stem_ = std::string(black_box_begin) + date_and_time() + "-" + file_stem(arm);
}

void BlackBox::write(recording::RecordKind kind, double time, std::span<const std::byte> content) {
  if (kind == recording::RecordKind::head) {
    head_ = recording::read_record<recording::HeadRecord>(content);
    return begin_file();
  }
  const bool step = kind == recording::RecordKind::step;
  if (step) {
    recording::Decoder in(content);
    recording::read_step_inputs(in, step_);
    use(step_, time);
  }
  make_room(step, time);
  if (step) {
    begun_ = has_steps_ ? begun_ : time;
    has_steps_ = true;
  } else {
    keep(kind, content);
  }
  file_->write(kind, time, content);
}

void BlackBox::write_set(double time, const RecordedSet& set) {
  make_room(false, time);
  sets_.insert_or_assign(set.number, PointSet{set});
  file_->write_set(time, set);
}

void BlackBox::make_room(bool for_step, double time) {
  time_ = time;
  const bool is_over = for_step && has_steps_ && (time - begun_ >= seconds_ / files_per_box || time < begun_);
  if (is_over || file_->bytes() - present_bytes_ >= most_bytes_ / (files_per_box + 1)) {
    begin_file();
    write_present();
    present_bytes_ = file_->bytes();
  }
}

void BlackBox::keep(recording::RecordKind kind, std::span<const std::byte> content) {
  recording::Decoder in(content);
  const auto number = in.take<std::uint64_t>();
  const Content bytes(content.begin(), content.end());
  switch (kind) {
    case recording::RecordKind::arm: arms_.insert_or_assign(number, bytes); break;
    case recording::RecordKind::request: requests_.insert_or_assign(number, bytes); break;
    case recording::RecordKind::world:
      worlds_.insert_or_assign(number, recording::read_record<recording::WorldRecord>(content));
      break;
    case recording::RecordKind::head:
    case recording::RecordKind::obstacles:  // see write_set
    case recording::RecordKind::step:
    case recording::RecordKind::done: break;
  }
}

void BlackBox::use(const recording::StepInputs& step, double time) {
  forget_before(arms_, step.arm);
  forget_before(requests_, step.request);
  const auto world = worlds_.find(step.obstacles);
  if (world == worlds_.end()) {
    return;
  }
  for (const recording::SourceRecord& source : world->second.sources) {
    if (const auto set = sets_.find(source.number); set != sets_.end() && std::isnan(set->second.used)) {
      set->second.used = time;
    }
  }
  if (world != worlds_.begin()) {
    forget_before(worlds_, step.obstacles);
    forget_unneeded_sets();
  }
}

void BlackBox::forget_unneeded_sets() {
  std::set<std::uint64_t> needed;
  for (const auto& [number, record] : worlds_) {
    for (const recording::SourceRecord& source : record.sources) {
      needed.insert(source.number);
    }
  }
  const std::uint64_t newest = worlds_.rbegin()->first;
  std::erase_if(sets_, [&](const auto& one) { return one.first <= newest && !needed.contains(one.first); });
}

double BlackBox::first_use(std::uint64_t set) const {
  const auto found = sets_.find(set);
  return found == sets_.end() ? PointSet{}.used : found->second.used;
}

void BlackBox::begin_file() {
  if (file_) {
    file_->close();
    if (file_->error() != 0) {
      throw std::system_error(file_->error(), std::generic_category(),
                              "black box: cannot write '" + files_.back().string() + "'");
    }
  }
  for (int again = 0; true; ++again) {  // a box that began at the same moment has the name
    char number[32];
    std::snprintf(number, sizeof number, "-%06llu", static_cast<unsigned long long>(count_ + 1));
    const std::filesystem::path path = folder_ / (stem_ + number + std::string(recording_suffix));
    try {
      file_ = std::make_unique<RecordingFile>(path, num_coordinates_, true);
      files_.push_back(path);
      break;
    } catch (const std::system_error& error) {
      constexpr int most_again = 100;
      if (error.code() != std::errc::file_exists || count_ > 0 || again == most_again) {
        throw;
      }
      stem_ += "~";
    }
  }
  ++count_;
  has_steps_ = false;
  if (const auto arm = arms_.upper_bound(step_.arm); arm != arms_.begin()) {
    const auto record = recording::read_record<recording::ArmRecord>(std::prev(arm)->second);
    head_.arm_number = step_.arm;
    head_.arm_file = step_.arm == record.lifted_number ? record.lifted_file : record.file;
  }
  write_record(recording::RecordKind::head, head_);
  delete_old();
}

void BlackBox::write_present() {
  for (const auto& [number, content] : arms_) {
    file_->write(recording::RecordKind::arm, time_, content);
  }
  for (const auto& [number, set] : sets_) {
    file_->write_set(time_, set.set);  // whole where it is the first of its source in the file
  }
  for (auto [number, world] : worlds_) {
    for (recording::SourceRecord& source : world.sources) {
      const double used = first_use(source.number);
      source.time = std::isnan(source.time) ? used : source.time;
      source.heard = std::isnan(source.heard) ? used : source.heard;
    }
    write_record(recording::RecordKind::world, world);
  }
  for (const auto& [number, content] : requests_) {
    file_->write(recording::RecordKind::request, time_, content);
  }
}

template <class Record>
void BlackBox::write_record(recording::RecordKind kind, const Record& record) {
  recording::Bytes content;
  recording::Encoder<recording::Bytes> out(content);
  describe(out, record);
  file_->write(kind, time_, content.bytes);
}

void BlackBox::delete_old() {
  std::error_code ignored;  // what cannot be deleted stays
  while (files_.size() > files_per_box + 1) {
    std::filesystem::remove(files_.front(), ignored);
    files_.pop_front();
  }
  // By the time of the last write: boxes that began before others may be running still.
  std::map<std::pair<std::filesystem::file_time_type, std::filesystem::path>, std::uint64_t> all;
  std::uint64_t total = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder_, ignored)) {
    if (std::error_code gone; is_of_a_box(entry.path())) {
      const auto written = entry.last_write_time(gone);
      const std::uint64_t size = gone ? 0 : entry.file_size(gone);
      if (!gone) {
        all.emplace(std::pair(written, entry.path()), size);
        total += size;
      }
    }
  }
  for (const auto& [one, size] : all) {
    const std::filesystem::path& path = one.second;
    if (total <= most_bytes_ - most_bytes_ / (files_per_box + 1)) {
      return;
    }
    if (path == files_.back()) {
      continue;
    }
    total -= size;
    std::filesystem::remove(path, ignored);
    std::erase(files_, path);
  }
}

void BlackBox::flush() {
  if (forget_unused(worlds_, settled_world_)) {
    forget_unneeded_sets();
  }
  forget_unused(requests_, settled_request_);
  settled_world_ = worlds_.empty() ? 0 : worlds_.rbegin()->first;
  settled_request_ = requests_.empty() ? 0 : requests_.rbegin()->first;
  if (file_) {
    file_->flush();
  }
}

void BlackBox::close() {
  if (file_) {
    file_->close();
  }
}

std::uint64_t BlackBox::bytes() const noexcept {
  std::uint64_t total = 0;
  for (const std::filesystem::path& path : files_) {
    std::error_code failed;
    const std::uint64_t size = std::filesystem::file_size(path, failed);
    total += failed ? 0 : size;
  }
  return total;
}

}  // namespace sidestep

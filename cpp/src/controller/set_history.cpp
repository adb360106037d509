#include "set_history.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "compact_columns.hpp"
#include "world.hpp"

namespace sidestep {

RecordedSet to_set(const recording::ObstaclesRecord& record) {
  RecordedSet set{record.number, 0, std::make_shared<const Obstacles>(Obstacles::none())};
  if (record.points.cols() == 0) {
    return set;
  }
  Obstacles made = record.order.empty()
                       ? Obstacles(record.points, record.radii, record.velocities).moving(record.velocities, record.uncertainty)
                       : Obstacles::in_order(record.points, record.radii, record.velocities, record.uncertainty,
                                             {record.order.begin(), record.order.end()});
  const bool is_nameless = record.names.size() == 1 && record.names.front().empty();
  set.points = std::make_shared<const Obstacles>(
      is_nameless ? std::move(made) : made.named(record.names, {record.counts.begin(), record.counts.end()}));
  return set;
}

void SetHistory::write(const RecordedSet& set, recording::Bytes& out) {
  const Obstacles& obstacles = *set.points;
  Columns now{set.number, Eigen::MatrixXd(4, obstacles.size()), Eigen::MatrixXd(4, obstacles.size())};
  now.places.topRows(3) = obstacles.points();
  now.places.row(3) = obstacles.radii().transpose();
  now.motions.topRows(3) = obstacles.velocities();
  now.motions.row(3) = obstacles.uncertainty().transpose();
  const Columns base = take(set.source);
  recording::Encoder<recording::Bytes> to(out);
  to(set.number, set.source, base.number);
  recording::CompactColumns::write(now.places, base.places, out);
  recording::CompactColumns::write(now.motions, base.motions, out);
  std::vector<std::int32_t> order;
  if (!obstacles.tree().is_in_usual_order()) {
    order.assign(obstacles.tree().order().begin(), obstacles.tree().order().end());
  }
  std::vector<std::string> names;
  std::vector<std::int64_t> counts;
  for (const auto& [name, count] : obstacles.groups()) {
    names.push_back(name);
    counts.push_back(count);
  }
  to(order, names, counts);
  keep(set.source, std::move(now));
}

RecordedSet SetHistory::read(std::span<const std::byte> content) {
  recording::Decoder in(content);
  recording::ObstaclesRecord record;
  std::uint64_t source = 0, base_number = 0;
  in(record.number, source, base_number);
  Columns base = take(source);
  if (base_number == 0) {
    base = {};
  } else if (base.number != base_number) {
    throw std::invalid_argument("set " + std::to_string(base_number) + " of its obstacles is missing, to which set " +
                                std::to_string(record.number) + " refers");
  }
  Columns now{record.number, recording::CompactColumns::read(in, 4, base.places),
              recording::CompactColumns::read(in, 4, base.motions)};
  if (now.places.cols() != now.motions.cols()) {
    throw std::invalid_argument("a set of its obstacles has " + std::to_string(now.places.cols()) + " points and " +
                                std::to_string(now.motions.cols()) + " velocities");
  }
  record.points = now.places.topRows(3);
  record.radii = now.places.row(3).transpose();
  record.velocities = now.motions.topRows(3);
  record.uncertainty = now.motions.row(3).transpose();
  in(record.order, record.names, record.counts);
  RecordedSet set = to_set(record);
  set.source = source;
  keep(source, std::move(now));
  return set;
}

SetHistory::Columns SetHistory::take(std::uint64_t source) {
  auto node = last_.extract(source);
  return node.empty() ? Columns{} : std::move(node.mapped());
}

void SetHistory::keep(std::uint64_t source, Columns columns) {
  last_.insert_or_assign(source, std::move(columns));
  if (last_.size() > most_sources) {  // a source that was removed, most likely; if not, its next set is written whole
    last_.erase(std::min_element(last_.begin(), last_.end(),
                                 [](const auto& a, const auto& b) { return a.second.number < b.second.number; }));
  }
}

}  // namespace sidestep

#include "recording_content.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <utility>

#include "../arm/arm_file.hpp"

namespace sidestep::recording {
namespace {

std::string in_full(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

bool same(double a, double b) noexcept {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) || (std::isnan(a) && std::isnan(b));
}

/// The number of an enum, and its name where it has one.
template <class Enum>
std::string in_words(std::int32_t value) {
  const std::string number = std::to_string(value);
  if constexpr (requires(Enum e) { to_string(e); }) {
    return std::string(to_string(static_cast<Enum>(value))) + " (" + number + ")";
  } else if constexpr (requires(Enum e) { name(e); }) {
    return std::string(name(static_cast<Enum>(value))) + " (" + number + ")";
  }
  return number;
}

/// Passes a value of that kind over.
void pass_over(Decoder& in, FieldKind kind) {
  switch (kind) {
    case FieldKind::number: in.raw(sizeof(double)); return;
    case FieldKind::whole: in.raw(sizeof(std::int32_t)); return;
    case FieldKind::numbers: in.raw(sizeof(double) * in.take<std::uint32_t>()); return;
    case FieldKind::limits: in.raw(sizeof(Limit) * in.take<std::uint32_t>()); return;
  }
  throw std::invalid_argument("a field of a command has an unknown kind");
}

template <class T>
constexpr FieldKind kind_of() {
  if constexpr (std::is_same_v<T, double>) {
    return FieldKind::number;
  } else if constexpr (std::is_same_v<T, Eigen::VectorXd>) {
    return FieldKind::numbers;
  } else if constexpr (std::is_same_v<T, std::vector<Limit>>) {
    return FieldKind::limits;
  } else {
    static_assert(std::is_enum_v<T> || std::is_same_v<T, int> || std::is_same_v<T, bool>, "give this field a FieldKind");
    return FieldKind::whole;
  }
}

template <class T>
T value_of(std::span<const std::byte> bytes) {
  Decoder in(bytes);
  if constexpr (kind_of<T>() == FieldKind::whole) {
    return static_cast<T>(in.take<std::int32_t>());
  } else {
    return in.take<T>();
  }
}

/// How a field that was recorded differs from what it is; empty: not.
template <class T>
std::optional<ReplayDifference> difference(const std::string& name, const T& was, const T& is) {
  const auto differs = [](std::string field, std::string before, std::string now) {
    return ReplayDifference{0, std::move(field), std::move(before), std::move(now)};
  };
  if constexpr (kind_of<T>() == FieldKind::number) {
    if (!same(was, is)) {
      return differs(name, in_full(was), in_full(is));
    }
  } else if constexpr (kind_of<T>() == FieldKind::whole) {
    if (was != is) {
      return differs(name, in_words<T>(static_cast<std::int32_t>(was)), in_words<T>(static_cast<std::int32_t>(is)));
    }
  } else if constexpr (kind_of<T>() == FieldKind::numbers) {
    if (was.size() != is.size()) {
      return differs(name, std::to_string(was.size()) + " entries", std::to_string(is.size()) + " entries");
    }
    for (Eigen::Index j = 0; j < is.size(); ++j) {
      if (!same(was[j], is[j])) {
        return differs(name + "[" + std::to_string(j) + "]", in_full(was[j]), in_full(is[j]));
      }
    }
  } else if (was != is) {
    const auto j = static_cast<std::size_t>(std::mismatch(was.begin(), was.end(), is.begin(), is.end()).first - was.begin());
    const auto bits = [j](const std::vector<Limit>& limits) {
      return j < limits.size() ? std::to_string(static_cast<unsigned>(limits[j])) : std::string("none");
    };
    return differs(name + "[" + std::to_string(j) + "]", bits(was), bits(is));
  }
  return std::nullopt;
}

/// The settings of each part with the beginning of their names, and those that may be left out.
template <class Settings, class Part, class Optional>
void each_part(Settings& s, Part&& part, Optional&& optional) {
  part("", s);
  part("barriers.", s.barriers);
  part("safety.", s.safety);
  part("arrival.", s.arrival);
  part("tracking.", s.tracking);
  part("contact.", s.contact);
  part("inputs.", s.inputs);
  part("sources.", s.sources);
  if (optional("speed_limits", s.speed_limits)) {
    part("speed_limits.", *s.speed_limits);
  }
  if (optional("planner", s.planner)) {
    part("planner.", *s.planner);
    part("planner.search.", s.planner->search);
    part("planner.route.", s.planner->route);
  }
  if (optional("look_ahead", s.look_ahead)) {
    part("look_ahead.", *s.look_ahead);
  }
  if (optional("local_minimum", s.local_minimum)) {
    part("local_minimum.", *s.local_minimum);
  }
}

}  // namespace

std::vector<FieldRecord> fields_of_commands() {
  std::vector<FieldRecord> fields;
  const Command command(0);
  each_field(command, [&](const char* name, const auto& value) {
    fields.push_back({name, kind_of<std::remove_cvref_t<decltype(value)>>()});
  });
  return fields;
}

void read_step_inputs(Decoder& in, StepInputs& s) {
  in(s.number, s.time, s.q, s.v, s.dynamics);
  if (s.dynamics) {
    in(s.mass_matrix, s.bias);
  }
  in(s.arm, s.request, s.obstacles, s.request_before, s.obstacles_before);
}

std::span<const std::byte> command_of(std::span<const std::byte> step) {
  if (step.size() < sizeof(CommandPlace)) {
    throw std::invalid_argument("a part of it ends where more must follow");
  }
  const std::size_t end = step.size() - sizeof(CommandPlace);
  const auto begin = Decoder(step.subspan(end)).take<CommandPlace>();
  if (begin > end) {
    throw std::invalid_argument("the command of a step begins after its end");
  }
  return step.subspan(begin, end - begin);
}

CommandReader::CommandReader(const std::vector<FieldRecord>& fields) {
  const std::vector<FieldRecord> now = fields_of_commands();
  num_fields_ = now.size();
  for (const FieldRecord& field : fields) {
    const auto same_field =
        std::find_if(now.begin(), now.end(), [&](const auto& one) { return one.name == field.name && one.kind == field.kind; });
    recorded_.push_back({field.kind, static_cast<std::size_t>(same_field - now.begin())});
  }
}

std::vector<std::span<const std::byte>> CommandReader::split(std::span<const std::byte> recorded) const {
  std::vector<std::span<const std::byte>> values(num_fields_ + 1);  // the last for what is none of them now
  Decoder in(recorded);
  for (const Recorded& one : recorded_) {
    const std::span<const std::byte> begin = in.rest();
    pass_over(in, one.kind);
    values[one.field] = begin.first(begin.size() - in.rest().size());
  }
  return values;
}

void CommandReader::read(std::span<const std::byte> recorded, Command& command) const {
  const auto values = split(recorded);
  auto next = values.begin();
  each_field(command, [&](const char*, auto& value) {
    if (const auto bytes = *next++; !bytes.empty()) {
      value = value_of<std::remove_cvref_t<decltype(value)>>(bytes);
    }
  });
}

std::optional<ReplayDifference> CommandReader::first_difference(std::span<const std::byte> recorded,
                                                                const Command& replayed) const {
  Bytes again;
  Encoder<Bytes> out(again);
  write_command(out, replayed);
  if (std::equal(again.bytes.begin(), again.bytes.end(), recorded.begin(), recorded.end())) {
    return std::nullopt;
  }
  const auto values = split(recorded);
  auto next = values.begin();
  std::optional<ReplayDifference> found;
  each_field(replayed, [&](const char* name, const auto& value) {
    using T = std::remove_cvref_t<decltype(value)>;
    if (const auto bytes = *next++; !found && !bytes.empty()) {
      found = difference(name, value_of<T>(bytes), value);
    }
  });
  return found;
}

std::vector<SettingRecord> to_records(const ControllerSettings& settings) {
  std::vector<SettingRecord> records{
      {"output", static_cast<double>(settings.output), static_cast<std::uint64_t>(settings.output)}};
  each_part(
      settings,
      [&](const std::string& prefix, const auto& part) {
        for (const auto& field : fields<std::remove_cvref_t<decltype(part)>>()) {
          std::visit(
              [&](auto member) {
                const auto value = part.*member;
                const bool whole = !std::is_same_v<std::remove_cvref_t<decltype(value)>, double>;
                records.push_back(
                    {prefix + field.name, static_cast<double>(value), whole ? static_cast<std::uint64_t>(value) : 0});
              },
              field.member);
        }
      },
      [&](const std::string& name, const auto& part) {
        records.push_back({name, part ? 1.0 : 0.0, part ? 1u : 0u});
        return part.has_value();
      });
  return records;
}

ControllerSettings to_settings(const std::vector<SettingRecord>& records, std::vector<std::string>& notes) {
  std::map<std::string, SettingRecord> left;
  for (const SettingRecord& record : records) {
    left.emplace(record.name, record);
  }
  const auto take = [&](const std::string& name) -> std::optional<SettingRecord> {
    auto node = left.extract(name);
    if (node.empty()) {
      notes.push_back("setting " + name + " is not in the recording: its default is taken");
      return std::nullopt;
    }
    return node.mapped();
  };
  ControllerSettings settings;
  if (const auto output = take("output")) {
    settings.output = static_cast<ControllerSettings::Output>(output->whole);
  }
  each_part(
      settings,
      [&](const std::string& prefix, auto& part) {
        for (const auto& field : fields<std::remove_cvref_t<decltype(part)>>()) {
          const auto found = take(prefix + field.name);
          if (!found) {
            continue;
          }
          std::visit(
              [&](auto member) {
                using T = std::remove_cvref_t<decltype(part.*member)>;
                if constexpr (std::is_same_v<T, double>) {
                  part.*member = found->value;
                } else {
                  part.*member = static_cast<T>(found->whole);
                }
              },
              field.member);
        }
      },
      [&](const std::string& name, auto& part) {
        const auto found = take(name);
        if (found && found->whole == 0) {
          part.reset();
        } else if (!part) {
          part.emplace();
        }
        return part.has_value();
      });
  for (const auto& [name, record] : left) {
    notes.push_back("setting " + name + ", recorded as " + in_full(record.value) + ", is unknown here");
  }
  return settings;
}

const char* sidestep_version() noexcept { return SIDESTEP_VERSION; }

std::string arm_bytes(const Arm& arm) {
  const ArmDetails details{arm.proof(), arm.allowed_pairs(), arm.provenance()};
  const std::vector<std::byte> bytes =
      encode_arm({arm.robot(), arm.body(), arm.pairs(), arm.tables(), arm.inertials(), details});
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

Arm arm_of(const std::string& bytes) { return decode_arm(std::as_bytes(std::span<const char>(bytes))); }

}  // namespace sidestep::recording

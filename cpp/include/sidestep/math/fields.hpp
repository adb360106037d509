#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace sidestep {

/// Description of one field of a settings struct.
template <class Settings>
struct Field {
  const char* name;
  std::variant<double Settings::*, int Settings::*, bool Settings::*, std::uint64_t Settings::*> member;
  const char* unit;    ///< Unit, for example "m"; "-" for none.
  double least, most;  ///< Allowed range, both ends included; infinity where there is no bound.
  const char* trades;  ///< One sentence: what the setting is, and what larger and smaller values trade.
};

/// The fields of a settings struct, in the order of its documentation: the only place that states unit, range and meaning.
/// `validate`, the Python classes, the schema of scenario files and the reference are made from it. Defaults are those of
/// the struct.
template <class Settings>
const std::vector<Field<Settings>>& fields();

/// The value of a field as a number.
template <class Settings>
double value_of(const Field<Settings>& field, const Settings& settings) {
  return std::visit([&](auto member) { return static_cast<double>(settings.*member); }, field.member);
}

/// Throws std::invalid_argument "<setting> is <value>, allowed: <least> to <most>" unless the value is in the range.
void check_range(const std::string& setting, double value, double least, double most, const char* unit);

/// Checks every field; `group` precedes its name in messages, such as "safety: ".
template <class Settings>
void check_fields(const char* group, const Settings& settings) {
  for (const Field<Settings>& field : fields<Settings>()) {
    check_range(std::string(group) + field.name, value_of(field, settings), field.least, field.most, field.unit);
  }
}

}  // namespace sidestep

#include "words.hpp"

#include <cmath>
#include <cstdio>

namespace sidestep {

std::string millimetres(double metres) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0f mm", 1e3 * std::abs(metres));
  return text;
}

std::string age_in_words(double seconds, const char* setting, double timeout) {
  char old[32], most[32];
  std::snprintf(old, sizeof old, "%.3g", seconds);
  std::snprintf(most, sizeof most, "%g s", timeout);
  return old + std::string(" s old, more than ") + setting + " (" + most + ")";
}

std::string parties(const CoordinateLabel& label, const std::string& obstacle) {
  switch (label.kind) {
    case CoordinateLabel::Kind::obstacle: return "link '" + label.name + "' and " + obstacle;
    case CoordinateLabel::Kind::self: return "links '" + label.name + "' and '" + label.other + "'";
    case CoordinateLabel::Kind::plane: return "link '" + label.name + "' and a plane";
    case CoordinateLabel::Kind::joint_limit: return "joint '" + label.name + "' and its " + label.other + " limit";
    case CoordinateLabel::Kind::effort: return "joint '" + label.name + "' and its effort limit (gravity torque)";
    case CoordinateLabel::Kind::potential: break;
  }
  return "a potential";
}

std::string in_digits(double value, int digits) {
  const double scale = std::pow(10.0, digits);
  char text[48];
  std::snprintf(text, sizeof text, "%.*f", digits, std::round(value * scale) / scale + 0.0);
  return text;
}

std::string rates_in_words(double got, double asked, const char* unit) {
  const int digits = std::abs(asked) < 0.1 && asked != 0.0 ? 4 : unit[0] == 'r' ? 2 : 3;
  return in_digits(got, digits) + " of " + in_digits(asked, digits) + " " + unit;
}

const char* limit_in_words(Limit set) noexcept {
  const auto one_of = [&](Limit lower, Limit upper) { return contains(set, lower) || contains(set, upper); };
  return one_of(Limit::position_lower, Limit::position_upper)           ? "position limit"
         : one_of(Limit::velocity_lower, Limit::velocity_upper)         ? "velocity limit"
         : one_of(Limit::acceleration_lower, Limit::acceleration_upper) ? "acceleration limit"
         : one_of(Limit::torque_lower, Limit::torque_upper)             ? "effort limit"
         : one_of(Limit::jerk_lower, Limit::jerk_upper)                 ? "jerk limit"
                                                                        : "torque rate limit";
}

}  // namespace sidestep

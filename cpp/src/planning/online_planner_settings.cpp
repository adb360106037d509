#include "sidestep/planning/online_planner_settings.hpp"

#include "../math/settings.hpp"

namespace sidestep {

template <>
const std::vector<Field<OnlinePlannerSettings>>& fields() {
  using S = OnlinePlannerSettings;
  static const std::vector<Field<S>> all{
      {"period", &S::period, "s", 0.001, 10.0, "time between two checks of the path: shorter reacts earlier"},
      {"patience", &S::patience, "s", 0.05, 60.0, "time without progress after which another path is searched"},
      {"retry", &S::retry, "s", 0.05, 600.0, "time after which a failed search is repeated in the same scene"},
  };
  return all;
}

void OnlinePlannerConfig::validate() const {
  planner.search.validate();
  planner.route.validate();
  const auto positive = [](double value, const char* what) { require(value > 0.0, what, value, "positive"); };
  positive(planner.period, "online planner: period");
  positive(planner.patience, "online planner: patience");
  positive(planner.retry, "online planner: retry");
  positive(tolerance, "online planner: tolerance");
  positive(duration, "online planner: duration");
}

}  // namespace sidestep

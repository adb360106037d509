#pragma once

#include <Eigen/Core>
#include <vector>

namespace sidestep {

/// How far every item (see ClearanceQuery) must keep off at a configuration.
///
/// The margin is asked for at every configuration that is looked at, margin − slack is kept everywhere between them.
/// Near an end of the motion where an item is nearer than the margin, by the deficit δ, it may be as near:
///
///     margin(q) = margin − max over ends of δ_end · max(0, 1 − motion(q − q_end) / fade),
///
/// with motion() the bound of how far the item moves, see ClearanceQuery::motions().
struct Margins {
  struct End {
    Eigen::VectorXd q;         ///< (nv)
    Eigen::VectorXd deficits;  ///< δ of every item [m], zero where the margin holds
  };

  double margin = 0.02;       ///< [m]
  double slack = 0.002;       ///< [m], positive: smaller costs more
  double fade = 0.3;          ///< [m], positive
  std::vector<End> ends;      ///< those with a deficit
  double pair_margin = 0.02;  ///< of two links at most [m]: neighbours are never far apart
};

}  // namespace sidestep

#pragma once

#include <Eigen/Core>
#include <vector>

namespace sidestep {

/// Clearance that every item (see ClearanceQuery) must keep at a configuration.
///
/// The margin holds at every checked configuration, margin − slack everywhere in between. Near an end of the motion where an
/// item is closer than the margin by the deficit δ, it may stay that close:
///
///     margin(q) = margin − max over ends of δ_end · max(0, 1 − motion(q − q_end) / fade),
///
/// with motion() the bound of how far the item moves, see ClearanceQuery::motions().
struct Margins {
  struct End {
    Eigen::VectorXd q;         ///< Configuration (nv).
    Eigen::VectorXd deficits;  ///< Deficit δ of every item [m], zero where the margin holds.
  };

  double margin = 0.02;       ///< Clearance kept [m].
  double slack = 0.002;       ///< Part of the margin that may be missing between checks [m], positive: smaller costs more.
  double fade = 0.3;          ///< Distance from an end over which its deficit fades [m], positive.
  std::vector<End> ends;      ///< Ends with a deficit.
  double pair_margin = 0.02;  ///< Largest margin of two links [m]: neighbours are never far apart.
};

}  // namespace sidestep

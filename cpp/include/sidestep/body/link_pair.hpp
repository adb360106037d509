#pragma once

#include <string>

namespace sidestep {

/// Two links that must not touch.
///
/// Covering ellipsoids are larger than their links: those of two links may meet, or overlap by −contact, before the
/// links do. The clearance of the pair is the gap between their ellipsoids less `contact`.
struct LinkPair {
  std::string first, second;
  double contact = 0.0;  ///< Largest gap between the ellipsoids at which the links may touch [m].
};

}  // namespace sidestep

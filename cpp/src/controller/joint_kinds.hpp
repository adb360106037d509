#pragma once

#include <Eigen/Core>
#include <vector>

#include "sidestep/robot/robot.hpp"

namespace sidestep {

/// Which joints are prismatic, and which turn without limits.
class JointKinds {
 public:
  explicit JointKinds(const Robot& robot);

  bool slides(Eigen::Index j) const noexcept { return slides_[static_cast<std::size_t>(j)]; }
  bool is_unlimited(Eigen::Index j) const noexcept { return unlimited_[static_cast<std::size_t>(j)]; }

 private:
  std::vector<bool> slides_, unlimited_;
};

}  // namespace sidestep

#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace sidestep {

/// Times of the last cycles; adding allocates nothing.
class CycleTimes {
 public:
  explicit CycleTimes(int kept) : late_(Eigen::VectorXd::Zero(kept)), taken_(late_) {}

  void add(double late, double taken) noexcept {
    const auto k = static_cast<Eigen::Index>(number_++ % static_cast<std::uint64_t>(late_.size()));
    late_[k] = late;
    taken_[k] = taken;
  }
  std::uint64_t number() const noexcept { return number_; }
  /// In the order of the cycles.
  Eigen::VectorXd late() const { return in_order(late_); }
  Eigen::VectorXd taken() const { return in_order(taken_); }

 private:
  Eigen::VectorXd in_order(const Eigen::VectorXd& ring) const {
    if (number_ <= static_cast<std::uint64_t>(ring.size())) {
      return ring.head(static_cast<Eigen::Index>(number_));
    }
    const auto oldest = static_cast<Eigen::Index>(number_ % static_cast<std::uint64_t>(ring.size()));
    Eigen::VectorXd all(ring.size());
    all << ring.tail(ring.size() - oldest), ring.head(oldest);
    return all;
  }

  Eigen::VectorXd late_, taken_;
  std::uint64_t number_ = 0;
};

}  // namespace sidestep

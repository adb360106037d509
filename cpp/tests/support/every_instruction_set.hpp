#pragma once

#include <vector>

#include "sidestep/math/instruction_set.hpp"

namespace sidestep::test {

/// To loop over: each instruction set is in use in its turn, and the one before again at the end.
class EveryInstructionSet {
 public:
  EveryInstructionSet() = default;
  EveryInstructionSet(const EveryInstructionSet&) = delete;
  EveryInstructionSet& operator=(const EveryInstructionSet&) = delete;
  ~EveryInstructionSet() { use(before_); }

  class Iterator {
   public:
    explicit Iterator(std::vector<InstructionSet>::const_iterator at) : at_(at) {}
    InstructionSet operator*() const {
      use(*at_);
      return *at_;
    }
    Iterator& operator++() {
      ++at_;
      return *this;
    }
    bool operator!=(const Iterator& other) const { return at_ != other.at_; }

   private:
    std::vector<InstructionSet>::const_iterator at_;
  };
  Iterator begin() const { return Iterator(sets_.begin()); }
  Iterator end() const { return Iterator(sets_.end()); }

 private:
  InstructionSet before_ = instruction_set();
  std::vector<InstructionSet> sets_ = instruction_sets();
};

}  // namespace sidestep::test

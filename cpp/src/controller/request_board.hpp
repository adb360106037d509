#pragma once

#include <array>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "request.hpp"
#include "sidestep/controller/plausibility.hpp"
#include "sidestep/controller/posture_search.hpp"
#include "sidestep/math/triple_buffer.hpp"
#include "world.hpp"

namespace sidestep {

/// What was set last, for any thread: requests and obstacles on their way to the step, copies of them for the worker and for
/// `explain`, and what the worker found. The step itself never waits for it unless it is synchronous.
class RequestBoard {
 public:
  explicit RequestBoard(Eigen::Index nv);

  /// Hands a request over to the step; `question`: what is hard to believe in it, empty where nothing is.
  void put(Request request, std::string question);
  /// Hands all obstacles over to the step. `share` gets a copy before any others can be put: the planner's.
  template <class Share>
  void put(std::shared_ptr<const World> world, std::string question, Share&& share) {
    World moving = *world;
    const std::lock_guard lock(mutex_);  // also of the planner's obstacles: the worker must not bring back older ones
    share(world->obstacles);
    show_world(std::move(world), std::move(question), std::move(moving));
  }
  /// Calls share() unless newer obstacles than these have been put: who gets those knows them already.
  template <class Share>
  void share_if_newest(std::uint64_t world_number, Share&& share) {
    const std::lock_guard lock(mutex_);
    if (shown_world_->number == world_number) {
      share();
    }
  }
  /// Takes over what stands on another board, and hands it over to the step. `share` as above.
  template <class Share>
  void take_over(const RequestBoard& before, Share&& share) {
    const Newest newest = before.newest();
    const std::lock_guard lock(mutex_);
    share(newest.world->obstacles);
    show(newest);
  }
  /// The next request put has this number: that of a recording.
  void number_next_request(std::uint64_t number) noexcept;

  /// The posture that was found for the request of that number.
  void show_posture(std::uint64_t request_number, const Posture& posture);
  /// Calls action(); what it throws costs its result, is kept for `explain`, and ends neither the thread nor the process.
  template <class Action>
  void guarded(Action&& action) noexcept {
    try {
      action();
    } catch (const std::exception& error) {
      note_fault(error.what());
    } catch (...) {
      note_fault("an unknown exception");
    }
  }

  /// All that was set last and found for it, as it belongs together.
  struct Newest {
    Request request;
    std::shared_ptr<const World> world;
    std::optional<Posture> posture;
    Questions questions;
    std::uint64_t request_number = 0;
  };
  Newest newest() const;
  std::uint64_t request_number() const;
  /// The request of that number; none where there is a newer one.
  Request request(std::uint64_t number) const;
  /// The obstacles that were set last, as they were given.
  std::shared_ptr<const World> newest_world() const;
  Questions questions() const;
  /// What the background work failed with; empty: nothing.
  std::string fault() const;

  TripleBuffer<NumberedRequest>& requests() noexcept { return requests_; }
  TripleBuffer<World>& worlds() noexcept { return worlds_; }
  /// For the step: where the arm is measured (nv). No allocation.
  void show_measured(const Eigen::VectorXd& q) noexcept {
    measured_.draft() = q;
    measured_.submit();
  }
  /// Where it was in the last step; empty before the first. For one thread at a time.
  Eigen::VectorXd last_measured() {
    const Eigen::VectorXd& q = measured_.get();
    return q.allFinite() ? q : Eigen::VectorXd();
  }

 private:
  // With the mutex locked.
  void show(const Newest& newest);
  void show_world(std::shared_ptr<const World> world, std::string question, World moving);
  void note_fault(const char* what) noexcept;

  TripleBuffer<NumberedRequest> requests_;
  TripleBuffer<World> worlds_;
  TripleBuffer<Eigen::VectorXd> measured_;  // NaN before the first step
  mutable std::mutex mutex_;                // Guards what follows.
  Request request_;
  std::uint64_t request_count_ = 0;
  std::shared_ptr<const World> shown_world_;
  std::optional<Posture> posture_;
  Questions questions_;
  std::array<char, 160> fault_{};
};

}  // namespace sidestep

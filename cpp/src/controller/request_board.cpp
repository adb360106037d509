#include "request_board.hpp"

#include <cstdio>
#include <limits>

namespace sidestep {

RequestBoard::RequestBoard(Eigen::Index nv)
    : requests_(NumberedRequest{}),
      worlds_(World{}),
      measured_(Eigen::VectorXd::Constant(nv, std::numeric_limits<double>::quiet_NaN())),
      shown_world_(std::make_shared<const World>()) {}

void RequestBoard::put(Request request, std::string question) {
  const std::lock_guard lock(mutex_);
  questions_.order_is_newer = !question.empty();
  questions_.order = std::move(question);
  request_ = request;
  posture_.reset();
  requests_.put({++request_count_, std::move(request)});
}

void RequestBoard::show_world(std::shared_ptr<const World> world, std::string question, World moving) {
  shown_world_ = std::move(world);
  questions_.order_is_newer = questions_.order_is_newer && question.empty();
  questions_.obstacles = std::move(question);
  worlds_.put(std::move(moving));
}

RequestBoard::Newest RequestBoard::newest() const {
  const std::lock_guard lock(mutex_);
  return {request_, shown_world_, posture_, questions_, request_count_};
}

void RequestBoard::show(const Newest& newest) {
  request_ = newest.request;
  shown_world_ = newest.world;
  questions_ = newest.questions;
  request_count_ = newest.request_number;
  requests_.put({request_count_, newest.request});
  worlds_.put(*newest.world);
}

void RequestBoard::number_next_request(std::uint64_t number) noexcept {
  const std::lock_guard lock(mutex_);
  request_count_ = number - 1;
}

void RequestBoard::show_posture(std::uint64_t request_number, const Posture& posture) {
  const std::lock_guard lock(mutex_);
  if (request_count_ == request_number) {
    posture_ = posture;
  }
}

void RequestBoard::note_fault(const char* what) noexcept {
  try {
    const std::lock_guard lock(mutex_);
    std::snprintf(fault_.data(), fault_.size(), "%s", what);
  } catch (...) {  // a mutex that fails: nothing is noted
  }
}

std::uint64_t RequestBoard::request_number() const {
  const std::lock_guard lock(mutex_);
  return request_count_;
}

std::shared_ptr<const World> RequestBoard::newest_world() const {
  const std::lock_guard lock(mutex_);
  return shown_world_;
}

Request RequestBoard::request(std::uint64_t number) const {
  const std::lock_guard lock(mutex_);
  return request_count_ == number ? request_ : Request();
}

Questions RequestBoard::questions() const {
  const std::lock_guard lock(mutex_);
  return questions_;
}

std::string RequestBoard::fault() const {
  const std::lock_guard lock(mutex_);
  return fault_.data();
}

}  // namespace sidestep

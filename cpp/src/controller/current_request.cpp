#include "current_request.hpp"

#include <utility>

namespace sidestep {

bool CurrentRequest::update(double elapsed) noexcept {
  buffer_.update();
  if (buffer_.current().number == number_) {
    age_ += elapsed;
    if (goal() != nullptr && moves_) {
      advance(*goal(), elapsed);
    }
    return false;
  }
  number_ = buffer_.current().number;
  age_ = 0.0;
  begins_input_ = is_any() && goal() == nullptr;
  moves_ = begins_input_ || (goal() != nullptr && is_moving(*goal()));
  return true;
}

void CurrentRequest::go_on_from(CurrentRequest& before) noexcept {
  number_ = before.number_;
  age_ = before.age_;
  moves_ = before.moves_;
  begins_input_ = before.begins_input_;
  buffer_.update();
  if (buffer_.current().number == number_) {
    std::swap(request(), before.request());
  }
}

}  // namespace sidestep

#include "interruptible.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <unordered_set>

namespace sidestep::python {
namespace {

std::unordered_set<const void*>& held() {  // under the GIL
  static std::unordered_set<const void*> objects;
  return objects;
}

}  // namespace

SignalPoll::SignalPoll() {
  const nb::module_ threading = nb::module_::import_("threading");
  is_main_ = threading.attr("current_thread")().is(threading.attr("main_thread")());
}

bool SignalPoll::operator()() noexcept {
  if (!is_main_ || raised_ || --left_ > 0) {
    return raised_;
  }
  const Clock::time_point now = Clock::now();
  calls_ = now - looked_ > slow ? 1 : std::min(2 * calls_, most_calls);
  left_ = calls_;
  looked_ = now;
  if (now - asked_ > pause) {
    {
      const nb::gil_scoped_acquire acquire;
      raised_ = PyErr_CheckSignals() != 0;
    }
    asked_ = Clock::now();
  }
  return raised_;
}

Exclusive::Exclusive(const void* object, const char* what) : object_(object) {
  if (!held().insert(object).second) {
    throw std::runtime_error(std::string(what) + " is in use by another thread; one at a time may use it");
  }
}

Exclusive::~Exclusive() { held().erase(object_); }

}  // namespace sidestep::python

#pragma once

#include <atomic>
#include <utility>

namespace sidestep {

/// Hands the newest value from writers to one reader that must not wait, allocate or free.
///
/// `put` may be called from any thread, `get` from one. What the reader has done with is freed by the next `put`.
template <class T>
class Handover {
 public:
  explicit Handover(T value) : current_(new Node{std::move(value), nullptr}) {}
  ~Handover() {
    delete current_;
    delete unseen_.load();
    free_retired();
  }
  Handover(const Handover&) = delete;
  Handover& operator=(const Handover&) = delete;

  /// Replaces what `get` gives from its next call on.
  void put(T value) {
    delete unseen_.exchange(new Node{std::move(value), nullptr});
    free_retired();
  }

  /// The newest value; valid until the next call.
  const T& get() noexcept {
    if (Node* fresh = unseen_.exchange(nullptr)) {
      // Fails only where a writer has just emptied the list: once per `put`.
      current_->next = retired_.load();
      while (!retired_.compare_exchange_weak(current_->next, current_)) {
      }
      current_ = fresh;
    }
    return current_->value;
  }

 private:
  struct Node {
    T value;
    Node* next;
  };

  void free_retired() {
    for (Node* node = retired_.exchange(nullptr); node != nullptr;) {
      delete std::exchange(node, node->next);
    }
  }

  Node* current_;                       // of the reader
  std::atomic<Node*> unseen_{nullptr};  // put, but not yet got
  std::atomic<Node*> retired_{nullptr};
};

}  // namespace sidestep

#pragma once

#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>

#include "sidestep/link/obstacle_messages.hpp"
#include "sidestep/perception/perception.hpp"

namespace sidestep::link {

/// Gives images to a perception, in a thread of its own: one takes some milliseconds. Of each camera only the newest image waits.
class ImageWorker {
 public:
  /// `told`: is told in the worker's thread of images that were refused, not used or hard to believe, by client and words; not twice of
  /// the same.
  using Told = std::function<void(std::uint32_t client, const std::string& words)>;
  ImageWorker(Perception& perception, Told told);
  ~ImageWorker();
  ImageWorker(const ImageWorker&) = delete;
  ImageWorker& operator=(const ImageWorker&) = delete;

  /// Throws std::invalid_argument where there is no such camera, or its images have another size.
  void put(DepthImageMessage image, std::uint32_t client);

 private:
  struct Waiting {
    DepthImageMessage image;
    std::uint32_t client = 0;
  };
  void run();
  std::string take(const Waiting& waiting);

  Perception& perception_;
  Told told_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, Waiting> waiting_;
  std::map<std::string, std::string> said_;  // Of the thread: last words about each camera.
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace sidestep::link

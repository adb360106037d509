#include "image_worker.hpp"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace sidestep::link {
namespace {

/// The pixels of a message as numbers; little-endian on both sides.
template <class Pixel>
std::vector<Pixel> numbers_of(const std::string& pixels) {
  std::vector<Pixel> numbers(pixels.size() / sizeof(Pixel));
  std::memcpy(numbers.data(), pixels.data(), numbers.size() * sizeof(Pixel));
  std::transform(numbers.begin(), numbers.end(), numbers.begin(), [](Pixel value) { return binary::little_endian(value); });
  return numbers;
}

}  // namespace

ImageWorker::ImageWorker(Perception& perception, Told told)
    : perception_(perception), told_(std::move(told)), thread_([this] { run(); }) {}

ImageWorker::~ImageWorker() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void ImageWorker::put(DepthImageMessage image, std::uint32_t client) {
  const DepthCamera& camera = perception_.camera(image.camera);
  if (static_cast<int>(image.width) != camera.width || static_cast<int>(image.height) != camera.height) {
    throw std::invalid_argument("an image of camera '" + image.camera + "' has " + std::to_string(camera.width) + " × " +
                                std::to_string(camera.height) + " pixels, not " + std::to_string(image.width) + " × " +
                                std::to_string(image.height));
  }
  {
    const std::lock_guard lock(mutex_);
    std::string name = image.camera;
    waiting_.insert_or_assign(std::move(name), Waiting{std::move(image), client});
  }
  changed_.notify_one();
}

void ImageWorker::run() {
  for (;;) {
    Waiting next;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
      if (stopping_) {
        return;
      }
      next = std::move(waiting_.extract(waiting_.begin()).mapped());
    }
    std::string words;
    try {
      words = take(next);
    } catch (const std::exception& error) {
      words = error.what();
    }
    if (std::string& said = said_[next.image.camera]; said != words) {
      said = words;
      if (!words.empty()) {
        told_(next.client, words);
      }
    }
  }
}

/// What is hard to believe in an image; empty: nothing.
std::string ImageWorker::take(const Waiting& waiting) {
  const DepthImageMessage& image = waiting.image;
  Capture capture{image.time};
  if (!image.pose.empty()) {
    capture.pose = Eigen::Isometry3d(Eigen::Map<const Eigen::Matrix4d>(image.pose.data()));
  }
  RawDepth raw;
  raw.unit = image.unit;
  PerceptionReport report;
  if (image.pixel == DepthImageMessage::Pixel::uint16) {
    const std::vector<std::uint16_t> pixels = numbers_of<std::uint16_t>(image.pixels);
    raw.pixels = std::span<const std::uint16_t>(pixels);
    report = perception_.update(image.camera, raw, capture);
  } else {
    const std::vector<float> pixels = numbers_of<float>(image.pixels);
    raw.pixels = std::span<const float>(pixels);
    report = perception_.update(image.camera, raw, capture);
  }
  return report.used ? report.question : "an image was not used: " + report.question;
}

}  // namespace sidestep::link

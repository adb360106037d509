#pragma once

#include <filesystem>
#include <random>
#include <string>

namespace sidestep::test {

/// An address that no other program has; what is left of it is removed at the end.
class LinkAddress {
 public:
  LinkAddress()
      : path_(std::filesystem::temp_directory_path() / ("sidestep-" + std::to_string(std::random_device{}()) + ".sock")) {}
  LinkAddress(const LinkAddress&) = delete;
  LinkAddress& operator=(const LinkAddress&) = delete;
  ~LinkAddress() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }

  std::string text() const { return "unix:" + path_.string(); }
  const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace sidestep::test

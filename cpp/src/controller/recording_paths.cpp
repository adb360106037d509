// Names of files that nobody has named.
#include "recording_paths.hpp"

#include <cctype>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <system_error>

#include "sidestep/controller/recording.hpp"

namespace sidestep {
namespace {

constexpr int most_recordings = 1'000'000;  // Number of recordings of one arm in one folder, at most.

}  // namespace

std::string file_stem(const std::string& name) {
  std::string stem;
  for (const char c : name) {
    stem += std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '.' ? c : '_';
  }
  return stem;
}

std::string date_and_time() {
  const auto now = std::chrono::floor<std::chrono::milliseconds>(std::chrono::system_clock::now());
  const auto day = std::chrono::floor<std::chrono::days>(now);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss time(now - day);
  char text[64];
  std::snprintf(text, sizeof text, "%04d%02u%02u-%02d%02d%02d-%03d", static_cast<int>(date.year()),
                static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()), static_cast<int>(time.hours().count()),
                static_cast<int>(time.minutes().count()), static_cast<int>(time.seconds().count()),
                static_cast<int>(time.subseconds().count()));
  return text;
}

std::filesystem::path next_of_folder(const std::string& name) {
  const char* const folder = std::getenv("SIDESTEP_RECORD");
  if (folder == nullptr || *folder == '\0') {
    return {};
  }
  std::filesystem::create_directories(folder);
  const std::string stem = file_stem(name);
  for (int n = 1; n <= most_recordings; ++n) {
    char number[32];
    std::snprintf(number, sizeof number, "-%03d", n);
    const std::filesystem::path path = std::filesystem::path(folder) / (stem + number + std::string(recording_suffix));
    if (std::FILE* const made = std::fopen(path.string().c_str(), "wbx")) {  // no other program takes this name
      std::fclose(made);
      return path;
    }
    if (const int refused = errno; !std::filesystem::exists(path)) {
      throw std::system_error(refused, std::generic_category(), "cannot write recording '" + path.string() + "'");
    }
  }
  throw std::runtime_error("there are too many recordings in '" + std::string(folder) + "'");
}

}  // namespace sidestep

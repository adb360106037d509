#include "settings.hpp"

#include <deque>
#include <sstream>

namespace sidestep::python {

const char* kept(std::string text) {
  static std::deque<std::string> texts;
  texts.push_back(std::move(text));
  return texts.back().c_str();
}

std::string described(const std::string& name, const char* unit, const std::string& by_default, double least, double most,
                      const char* trades) {
  std::ostringstream text;
  text << "    " << name;
  if (std::string(unit) != "-") {
    text << " [" << unit << "]";
  }
  text << ", default " << by_default << ", allowed " << least << " to " << most << ": " << trades;
  return text.str();
}

}  // namespace sidestep::python

#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "sidestep/controller/settings.hpp"

// Python classes of settings structs: their keywords, properties, signature and documentation are made from `fields`.
namespace sidestep::python {

namespace nb = nanobind;

/// A text that Python keeps for as long as the module.
const char* kept(std::string text);

/// "name [unit], default 0.1, 0.01 to 1: what it trades".
std::string described(const std::string& name, const char* unit, const std::string& by_default, double least, double most,
                      const char* trades);

template <class Settings>
nb::object get_field(const Settings& settings, const Field<Settings>& field) {
  return std::visit([&](auto member) { return nb::cast(settings.*member); }, field.member);
}

/// Sets a field from Python; refuses what is no number of its kind.
template <class Settings>
void set_field(Settings& settings, const Field<Settings>& field, nb::handle value) {
  std::visit(
      [&](auto member) {
        using Value = std::remove_reference_t<decltype(settings.*member)>;
        if (!nb::try_cast<Value>(value, settings.*member)) {
          throw nb::type_error((std::string(field.name) + " is " + nb::repr(value).c_str() + ", must be a number [" +
                                field.unit + "]").c_str());
        }
      },
      field.member);
}

/// The Python type of a field.
template <class Settings>
std::string type_of(const Field<Settings>& field) {
  return std::array{"float", "int", "bool", "int"}[field.member.index()];
}

/// A member that is no number: settings of their own, or a choice.
template <class Settings>
struct Part {
  std::string name, type;
  std::function<void(Settings&, nb::handle)> set;
  std::function<nb::object(const Settings&)> get;
};

template <class Value>
struct Inner {
  using type = Value;
};
template <class Value>
struct Inner<std::optional<Value>> {
  using type = Value;
};

/// A part that is a class of its own, perhaps one that may be left out, or a dict of its settings; type: of Python.
template <class Settings, class Value>
Part<Settings> part(const char* name, const std::string& type, Value Settings::*member) {
  return {name, type, [name, type, member](Settings& settings, nb::handle given) {
            nb::object value = nb::borrow(given);
            if (nb::isinstance<nb::dict>(given)) {
              value = nb::type<typename Inner<Value>::type>()(**nb::borrow<nb::kwargs>(given));
            }
            if (!nb::try_cast<Value>(value, settings.*member)) {
              throw nb::type_error((std::string(name) + " is " + nb::repr(value).c_str() + ", must be " + type).c_str());
            }
          },
          [member](const Settings& settings) { return nb::cast(settings.*member); }};
}

/// The dict of all fields and parts; parts that are settings of their own are dicts in it.
template <class Settings>
nb::dict to_dict(const Settings& settings, const std::vector<Part<Settings>>& parts) {
  nb::dict all;
  for (const Field<Settings>& field : fields<Settings>()) {
    all[field.name] = get_field(settings, field);
  }
  for (const Part<Settings>& each : parts) {
    const nb::object value = each.get(settings);
    all[each.name.c_str()] = nb::hasattr(value, "to_dict") ? value.attr("to_dict")() : value;
  }
  return all;
}

/// Sets fields and parts by their names; refuses others.
template <class Settings>
void set_all(Settings& settings, const char* name, const std::vector<Part<Settings>>& parts, const nb::dict& values) {
  for (const auto& [key, value] : values) {
    const auto wanted = nb::cast<std::string>(key);
    std::string known;
    bool found = false;
    for (const Field<Settings>& field : fields<Settings>()) {
      known += (known.empty() ? "" : ", ") + std::string(field.name);
      if (wanted == field.name) {
        set_field(settings, field, value);
        found = true;
      }
    }
    for (const Part<Settings>& each : parts) {
      known += ", " + each.name;
      if (wanted == each.name) {
        each.set(settings, value);
        found = true;
      }
    }
    if (!found) {
      throw nb::type_error((std::string(name) + " has no setting '" + wanted + "'; it has: " + known).c_str());
    }
  }
}

/// A class with a keyword and a property for every field, and a keyword for every part. It is equal, copied and pickled by
/// the values of all.
template <class Settings>
nb::class_<Settings> bind_settings(nb::module_& m, const char* name, const std::string& summary,
                                   std::vector<Part<Settings>> parts = {}) {
  std::string keywords, text = summary + "\n";
  const Settings defaults{};
  for (const Field<Settings>& field : fields<Settings>()) {
    const std::string by_default = nb::repr(get_field(defaults, field)).c_str();
    const bool literal = std::isfinite(value_of(field, defaults));
    keywords += std::string(", ") + field.name + ": " + type_of(field) + " = " + (literal ? by_default : "...");
    text += "\n" + described(field.name, field.unit, by_default, field.least, field.most, field.trades);
  }
  for (const Part<Settings>& each : parts) {
    keywords += ", " + each.name + ": " + each.type + " = ...";
  }
  constexpr bool checked = requires(const Settings& settings) { settings.validate(); };
  text += checked ? "\n\nRaises ValueError that names the setting, its value and what is allowed."
                  : "\n\nA Controller refuses what is not allowed.";
  nb::class_<Settings> c(m, name, kept(text));
  c.def("__init__", [name, parts](Settings* self, const nb::kwargs& values) {
    new (self) Settings();
    set_all(*self, name, parts, values);
    if constexpr (checked) {
      self->validate();
    }
  }, nb::sig(kept("def __init__(self, *" + keywords + ") -> None")));
  c.def(
      "__repr__",
      [name, parts](const Settings& self) {
        const Settings defaults{};
        std::string text;
        const auto add = [&text](const std::string& key, const nb::object& value, const nb::object& by_default) {
          const std::string told = nb::repr(value).c_str();
          if (told != nb::repr(by_default).c_str()) {
            text += (text.empty() ? "" : ", ") + key + "=" + told;
          }
        };
        for (const Field<Settings>& field : fields<Settings>()) {
          add(field.name, get_field(self, field), get_field(defaults, field));
        }
        for (const Part<Settings>& each : parts) {
          add(each.name, each.get(self), each.get(defaults));
        }
        return std::string(name) + "(" + text + ")";
      },
      "What differs from the defaults.");
  c.def(
       "to_dict", [parts](const Settings& self) { return to_dict(self, parts); }, nb::sig("def to_dict(self) -> dict[str, typing.Any]"),
       kept(std::string("All settings as a dict of numbers, texts and dicts, for YAML or JSON: ") + name + "(**d) gives them again."))
      .def("__getstate__", [parts](const Settings& self) { return to_dict(self, parts); },
           nb::sig("def __getstate__(self) -> dict[str, typing.Any]"))
      .def("__setstate__",
           [name, parts](Settings& self, const nb::dict& values) {
             new (&self) Settings();
             set_all(self, name, parts, values);
             if constexpr (checked) {
               self.validate();
             }
           },
           nb::sig("def __setstate__(self, values: dict[str, typing.Any], /) -> None"))
      .def("__copy__", [](const Settings& self) { return Settings(self); })
      .def(
          "__eq__",
          [parts](const Settings& self, nb::handle other) {
            return nb::isinstance<Settings>(other) &&
                   to_dict(self, parts).equal(to_dict(nb::cast<const Settings&>(other), parts));
          },
          nb::arg("other").none(), nb::sig("def __eq__(self, other: object, /) -> bool"));
  c.def("__hash__", [name](const Settings&) -> Py_hash_t {
    throw nb::type_error((std::string("unhashable type: '") + name + "', which can be changed").c_str());
  });
  for (const Field<Settings>& field : fields<Settings>()) {
    const std::string own = field.name;
    c.def_prop_rw(
        field.name, [field](const Settings& s) { return get_field(s, field); },
        [field](Settings& s, nb::handle value) { set_field(s, field, value); },
        nb::for_getter(nb::sig(kept("def " + own + "(self) -> " + type_of(field)))),
        nb::for_setter(nb::sig(kept("def " + own + "(self, value: " + type_of(field) + ", /) -> None"))));
  }
  return c;
}

/// Adds a row for each field: name, unit, default, allowed range and what it trades.
template <class Settings>
void describe_fields(nb::list& rows, const std::string& group, bool optional = false) {
  const Settings defaults{};
  for (const Field<Settings>& field : fields<Settings>()) {
    nb::dict row;
    row["name"] = group + field.name;
    row["unit"] = field.unit;
    row["default"] = get_field(defaults, field);
    row["least"] = field.least;
    row["most"] = field.most;
    row["trades"] = field.trades;
    row["optional"] = optional;
    rows.append(row);
  }
}

}  // namespace sidestep::python

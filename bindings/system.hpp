#pragma once

#include <nanobind/nanobind.h>

#include <string>

#include "arguments.hpp"
#include "sidestep/attractor/geometric_system.hpp"

namespace sidestep::python {

// What the files of system/ share.
void bind_goals(nanobind::module_& m);
void bind_look_ahead(nanobind::module_& m);

/// An enumerator, or its name; raises ValueError that lists the allowed names.
template <class Enum>
Enum as_enum(nb::handle value, const char* name) {
  Enum result{};
  if (nb::try_cast<Enum>(value, result)) {
    return result;
  }
  const nb::object members = nb::type<Enum>().attr("__members__");
  if (nb::isinstance<nb::str>(value) && nb::cast<bool>(members.attr("__contains__")(value))) {
    return nb::cast<Enum>(members[value]);
  }
  const std::string allowed = nb::cast<std::string>(nb::str(", ").attr("join")(members));
  throw nb::value_error((std::string(name) + " is " + nb::repr(value).c_str() + ", must be one of: " + allowed).c_str());
}

/// A diagnosis with the label of the coordinate that dominates, and its sentence.
struct Explanation {
  Diagnosis diagnosis;
  CoordinateLabel label;
  std::string words;

  Explanation(const GeometricSystem& system, const Diagnosis& d, const Obstacles& obstacles)
      : diagnosis(d),
        label(d.coordinate < 0 ? CoordinateLabel{} : system.labels()[static_cast<std::size_t>(d.coordinate)]),
        words(d.describe(label, obstacles)) {}
};

/// What Python gets from a step: the workspace as it was when the step ended.
struct Step {
  StepStatus status;
  GeometricSystem::Workspace result;
  Explanation explanation;
};

/// A goal, or a configuration as an array.
Goal as_goal(nb::handle value, Eigen::Index nv);

template <class Class, class Member>
void matrix_property(nb::class_<Class>& c, const char* name, Member member, const char* doc) {
  c.def_prop_ro(name, [member](const Class& r) { return to_numpy_matrix(r.*member); }, doc);
}

}  // namespace sidestep::python

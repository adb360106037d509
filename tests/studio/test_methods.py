"""The methods of the studio and their parameters."""

import dataclasses
from operator import attrgetter
from types import SimpleNamespace
from typing import Any

import pytest

from sidestep import Scenario
from sidestep.bench.method import Method as BenchMethod
from sidestep.controller import controller_settings_fields
from sidestep.scenario.config import ADDED
from sidestep.scenario.scenario import (
    BodyConfig,
    EmbeddingConfig,
    JointLimitConfig,
    SystemConfig,
)
from sidestep.studio.methods import METHODS, check_numbers
from sidestep.studio.page.tuning import add_control, show_value, unit_for, value_of
from sidestep.studio.parameters import Parameter
from sidestep.studio.systems import as_file, settings_of
from sidestep.thesis import ThesisNumbers


def test_every_method_of_the_benchmark_is_there() -> None:
    assert {method.value for method in BenchMethod} <= set(METHODS)
    for method in BenchMethod:
        assert METHODS[method.value].controlled == method.safe


def test_the_recommended_numbers_are_those_of_the_controller_and_the_thesis(scenario: Scenario) -> None:
    method = METHODS["controller"]
    settings = settings_of(as_file(method, method.defaults, scenario))
    for entry in controller_settings_fields():
        if str(entry["name"]).partition(".")[0] in ADDED:
            continue
        assert attrgetter(str(entry["name"]))(settings) == entry["default"], entry["name"]
    thesis = METHODS["thesis"].defaults
    own = {field.name: thesis[field.name] for field in dataclasses.fields(ThesisNumbers)}
    assert ThesisNumbers(**own) == ThesisNumbers()


def every_parameter() -> dict[str, Parameter]:
    return {f"{p.place}.{p.field}": p for method in METHODS.values() for p in method.parameters}


@pytest.mark.parametrize(
    ("kind", "place"),
    [
        (SystemConfig, "system"),
        (EmbeddingConfig, "embedding"),
        (JointLimitConfig, "embedding.joint_limits"),
        (BodyConfig, "body"),
    ],
)
def test_every_number_of_a_scenario_file_can_be_set(kind: type, place: str) -> None:
    parts = {"switch", "joint_limits"}  # with numbers of their own
    constant = {"seed", "draft"}  # as docs/how-to/studio.md says
    for field in dataclasses.fields(kind):
        if field.name not in parts | constant:
            assert f"{place}.{field.name}" in every_parameter()


def test_every_setting_of_the_controller_can_be_set() -> None:
    constant = {"period", "synchronous", "seed", "obstacle_timeout", "planner.search.max_seconds"}
    stated = {
        f"controller.{field['name']}": field
        for field in controller_settings_fields()
        if str(field["name"]).partition(".")[0] not in ADDED  # as docs/how-to/studio.md says
    }
    found = {name: p for name, p in every_parameter().items() if name.startswith("controller.")}
    assert set(found) == set(stated) - {f"controller.{name}" for name in constant}
    for name, parameter in found.items():
        assert parameter.default == stated[name]["default"]
        assert (parameter.lower, parameter.upper) == (stated[name]["least"], stated[name]["most"])
        assert parameter.sentence.lower() == f"{stated[name]['trades']}.".lower()


def test_another_value_of_a_parameter_is_of_its_kind() -> None:
    known = every_parameter()
    nodes, count, kind = (
        known["controller.planner.search.max_nodes"],
        known["body.ellipsoids"],
        known["system.damping_form"],
    )
    assert (nodes.allows(500), nodes.allows(500.5), nodes.allows(True), nodes.allows("500")) == (1, 0, 0, 0)
    assert (count.allows(None), count.allows(2), count.allows(5), count.allows(True)) == (1, 1, 0, 0)
    assert (kind.allows("metric"), kind.allows("flat")) == (True, False)
    assert not known["controller.barriers.stiffness"].allows(float("nan"))


@pytest.mark.parametrize("name", list(METHODS))
def test_every_parameter_has_a_range_around_its_default_and_a_sentence(name: str) -> None:
    parameters = METHODS[name].parameters
    assert len({p.name for p in parameters}) == len({p.sentence for p in parameters}) == len(parameters)
    for parameter in parameters:
        assert parameter.allows(parameter.default)
        assert parameter.sentence.endswith(".")
        if not parameter.options:
            lower, upper = parameter.slider
            assert parameter.lower <= lower < upper <= parameter.upper
            assert lower <= parameter.default <= upper  # type: ignore[operator]


def test_an_unknown_parameter_is_refused() -> None:
    with pytest.raises(ValueError, match="unswitched has no parameter 'magic'; it has stiffness, damping, "):
        check_numbers(METHODS["unswitched"], {"magic": 1.0})
    with pytest.raises(ValueError, match=r"density is flat, allowed: \['sum', 'average'\]"):
        check_numbers(METHODS["unswitched"], {"density": "flat"})


@pytest.mark.parametrize(
    ("unit", "joints", "shown"),
    [
        ("rad/s²", {"rad"}, "rad/s²"),
        ("rad/s²", {"m"}, "m/s²"),
        ("1/rad", {"m", "rad"}, "1/rad | 1/m"),
        ("s", {"m"}, "s"),
    ],
)
def test_units_are_those_of_the_joints(unit: str, joints: set[str], shown: str) -> None:
    assert unit_for(unit, joints) == shown


@pytest.mark.parametrize("parameter", every_parameter().values(), ids=every_parameter().keys())
def test_a_control_gives_back_the_value_it_shows(parameter: Parameter) -> None:
    """Also one that a file has and the page's range does not."""
    gui = SimpleNamespace(
        add_slider=lambda _, **it: SimpleNamespace(value=it["initial_value"], **it),
        add_dropdown=lambda _, options, initial_value: SimpleNamespace(value=initial_value, options=options),
    )
    values: list[Any] = [*(parameter.options or (parameter.lower, parameter.upper)), parameter.default]
    values += [7 if parameter.options else 2 * parameter.upper]  # type: ignore[list-item]
    for value in values:
        control = add_control(gui, parameter, value)
        assert value_of(control, parameter) == (
            value if parameter.options else pytest.approx(value, rel=1e-12)
        )
        show_value(control, parameter, parameter.default)
        back = value_of(control, parameter)
        assert back == parameter.default
        assert type(back) is type(parameter.default)

"""The methods of the studio and their parameters."""

import pytest

from sidestep import presets
from sidestep.bench.method import Method as BenchMethod
from sidestep.studio.methods import METHODS, check_numbers


def test_every_method_of_the_benchmark_is_there() -> None:
    assert {method.value for method in BenchMethod} <= set(METHODS)
    for method in BenchMethod:
        assert METHODS[method.value].safe == method.safe
        assert METHODS[method.value].escapes == method.escapes
        assert METHODS[method.value].guided == (method is BenchMethod.guided)


def test_the_recommended_numbers_are_the_presets() -> None:
    assert presets.Barriers(**METHODS["barrier"].defaults) == presets.Barriers()
    thesis = METHODS["thesis"].defaults
    assert presets.Thesis(**thesis) == presets.Thesis()  # type: ignore[arg-type]


@pytest.mark.parametrize("name", list(METHODS))
def test_every_parameter_has_a_range_around_its_default_and_a_sentence(name: str) -> None:
    for parameter in METHODS[name].parameters:
        assert parameter.lower <= parameter.default <= parameter.upper
        assert parameter.sentence.endswith(".")


def test_an_unknown_parameter_is_refused() -> None:
    with pytest.raises(ValueError, match="unswitched has no parameter 'magic'; it has stiffness, damping"):
        check_numbers(METHODS["unswitched"], {"magic": 1.0})

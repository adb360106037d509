"""Reading and checking scenario files: one error that names file, place, value and what is allowed."""

from __future__ import annotations

import math
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

import yaml

from sidestep.schema import mismatch

if TYPE_CHECKING:
    import jsonschema


class ScenarioError(ValueError):
    """A scenario file is malformed, or asks for something impossible."""


@cache
def schema_text() -> str:
    """The published JSON schema of scenario files."""
    return (resources.files("sidestep.scenario") / "schema.json").read_text(encoding="utf-8")


def parse_yaml(text: str, *, file: str) -> dict[str, Any]:
    """The mapping in a YAML text.

    Raises:
        ScenarioError: not YAML, not a mapping, or a key given twice.
    """
    try:
        document = yaml.load(text, Loader=_UniqueKeyLoader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = f", line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        problem = getattr(error, "problem", None) or str(error).splitlines()[0]
        raise ScenarioError(f"{file}{place}: not valid YAML: {problem}") from error
    if not isinstance(document, dict):
        raise ScenarioError(
            f"{file}: a scenario is a mapping of keys to values, got {type(document).__name__}"
        )
    return document


def check_document(document: dict[str, Any], *, file: str) -> None:
    """Check a parsed scenario against the schema.

    Raises:
        ScenarioError: names the file, the place in it, the value and what is allowed.
    """
    for place, value in _leaves(document, ()):
        if isinstance(value, float) and not math.isfinite(value):
            raise ScenarioError(f"{file}: {_dotted(place)} is {value}; it must be a finite number")
    error = mismatch(document, schema_text())
    if error is not None:
        raise ScenarioError(f"{file}: {_explain(error)}")


class _UniqueKeyLoader(yaml.SafeLoader):  # type: ignore[misc]
    """YAML's usual loader keeps the last of two equal keys in silence; this one refuses them."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if key in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key {key!r} is given twice", key_node.start_mark
                )
            seen.add(key)
        return dict(super().construct_mapping(node, deep=deep))


def _leaves(value: Any, place: tuple[str | int, ...]) -> list[tuple[tuple[str | int, ...], Any]]:
    if isinstance(value, dict):
        return [leaf for key, item in value.items() for leaf in _leaves(item, (*place, key))]
    if isinstance(value, list):
        return [leaf for index, item in enumerate(value) for leaf in _leaves(item, (*place, index))]
    return [(place, value)]


def _dotted(place: Any) -> str:
    """("obstacles", 0, "shape") as obstacles[0].shape."""
    text = ""
    for part in place:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else str(part)
    return text or "the top level"


def _explain(error: jsonschema.ValidationError) -> str:
    place, value = _dotted(error.absolute_path), error.instance
    allowed: Any = error.validator_value
    match error.validator:
        case "required":
            missing = next(key for key in allowed if key not in value)
            return f"{place}: the key '{missing}' is missing; required: {', '.join(allowed)}"
        case "additionalProperties":
            known = error.schema["properties"]
            unknown = next(key for key in value if key not in known)
            pose = ", or of a pose frame, position, rotation_deg, posture"
            other = pose if place == "goal" and "frame" not in known else ""
            return f"{place}: unknown key {unknown!r} (value {value[unknown]!r}); allowed: {', '.join(known)}{other}"
        case "enum":
            return f"{place} is {value!r}; allowed: {', '.join(map(str, allowed))}"
        case "const":
            return f"{place} is {value!r}; allowed: {allowed!r}"
        case "type":
            kinds = " or ".join([allowed] if isinstance(allowed, str) else allowed)
            hint = ""
            if "number" in kinds and isinstance(value, str) and _is_number(value):
                hint = " (YAML reads it as text; write it as 1.0e-3 or 0.001)"
            return f"{place} is {value!r}; it must be of type {kinds}{hint}"
        case "minItems" | "maxItems":
            bound = "at least" if error.validator == "minItems" else "at most"
            return f"{place} is {value!r} with {len(value)} values; it must have {bound} {allowed}"
        case "exclusiveMinimum":
            return f"{place} is {value!r}; it must be greater than {allowed}"
        case "minimum":
            return f"{place} is {value!r}; it must be at least {allowed}"
        case "maximum":
            return f"{place} is {value!r}; it must be at most {allowed}"
        case "pattern":
            return f"{place} is {value!r}; it must match {allowed}"
        case "oneOf" if place == "robot":
            return f"{place} is {value!r}; it needs either 'name' or 'urdf'"
        case "anyOf" if place == "body.components":
            return f"{place} is {value!r}; allowed: an integer from 1, one per link name, 'aic', 'bic'"
        case _:
            return f"{place} is {value!r}: {error.message}"


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True

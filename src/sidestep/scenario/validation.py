"""Reading and checking scenario files: one error that names file, place, value and what is allowed."""

from __future__ import annotations

import json
import math
from collections.abc import Hashable
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

import yaml

from sidestep.body.schema import mismatch
from sidestep.scenario.config import section_schema
from sidestep.scenario.shape import shape_schema
from sidestep.shapes import KINDS

if TYPE_CHECKING:
    import jsonschema


MAX_DEPTH = 32  # of values in each other; a scenario has 8
MAX_VALUES = 50_000  # aliases written out; ten per obstacle, of which no physics takes thousands
MAX_CHARACTERS = 4_000_000
MAX_NUMBER = 1e30  # in size: its square and cube are still numbers
SHOWN = 100  # characters of a value in an error
MOVED = {  # keys of release 0.1.0, and what is in their place
    "barriers": "controller.barriers",
    "barriers.ellipsoids": "body.ellipsoids",
    "escape": "controller.local_minimum",
    "evasion": "controller.look_ahead",
    "guide": "controller.planner",
    "guide.planner": "controller.planner.search",
    "guide.route": "controller.planner.route",
    "torque": "controller",
    "torque.safety": "controller.safety",
}
RENAMED = {"guided": "controller", "written": "custom"}  # methods of release 0.1.0
_BASE: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # the same in C where PyYAML has it


class ScenarioError(ValueError):
    """A scenario file is malformed, or asks for something impossible."""


def schema_text() -> str:
    """The published JSON schema of scenario files, with the section `controller` as the core states its settings, and
    shapes as their classes do."""
    return _schema_text(tuple(KINDS))


@cache
def _schema_text(kinds: tuple[str, ...]) -> str:
    text = (resources.files("sidestep.scenario") / "schema.json").read_text(encoding="utf-8")
    schema = json.loads(text)
    schema["$defs"]["controller"] = section_schema()
    schema["$defs"]["shape"] = shape_schema(schema["$defs"]["shape"])
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


def parse_yaml(text: str, *, file: str) -> dict[str, Any]:
    """The mapping in a YAML text.

    Raises:
        ScenarioError: not YAML, not a mapping, a key given twice or no text, an alias inside the value that it
            repeats, or more than anybody writes (`MAX_DEPTH`, `MAX_VALUES`, `MAX_CHARACTERS`).
    """
    if len(text) > MAX_CHARACTERS:
        raise ScenarioError(f"{file}: has {len(text)} characters; at most {MAX_CHARACTERS} are allowed")
    try:
        _check_size(text)
        document = yaml.load(text, Loader=_UniqueKeyLoader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = f", line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        problem = getattr(error, "problem", None) or str(error).splitlines()[0]
        if "nesting depth" in problem:  # of libyaml, which looks ahead
            problem += f"; at most {MAX_DEPTH} is allowed"
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
        if isinstance(value, int | float) and abs(value) > MAX_NUMBER:
            raise ScenarioError(
                f"{file}: {_dotted(place)} is {shown(value)}; at most {MAX_NUMBER:g} in size is allowed"
            )
    moved = [f"{old} as {new}" for old, new in MOVED.items() if _has(document, old)]
    if document.get("method") in RENAMED:
        moved.append(f"method: {document['method']} as method: {RENAMED[document['method']]}")
    if moved:
        raise ScenarioError(f"{file}: has keys of release 0.1.0; write {', '.join(moved)}")
    error = mismatch(document, schema_text())
    if error is not None:
        raise ScenarioError(f"{file}: {_explain(error)}")


def _has(document: Any, name: str) -> bool:
    """Whether there is something at a place, keys with dots between them."""
    key, _, rest = name.partition(".")
    return isinstance(document, dict) and key in document and (not rest or _has(document[key], rest))


def shown(value: Any) -> str:
    """A value as errors print it: in one line, and not longer than anybody reads."""
    try:
        text = repr(value)
    except ValueError:  # Python does not write out integers of thousands of digits
        text = f"an integer of {value.bit_length()} bits"
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}…"


def _check_size(text: str) -> None:
    """Refuses what would take for ever to build, from the parser's events alone: these take no recursion."""
    count, open_nodes, sizes = 0, list[tuple[str | None, int]](), dict[str, int | None]()
    for event in yaml.parse(text, Loader=_BASE):
        anchor: str | None = getattr(event, "anchor", None)
        match event:
            case yaml.AliasEvent():
                size = sizes.get(str(anchor), 1)  # one that is not defined the loader refuses
                if size is None:
                    raise _Refused(f"the alias '*{anchor}' stands inside the value that it repeats", event)
                count += size
            case yaml.ScalarEvent():
                count += 1
                if anchor is not None:
                    sizes[anchor] = 1
            case yaml.MappingStartEvent() | yaml.SequenceStartEvent():
                open_nodes.append((anchor, count))
                count += 1
                if anchor is not None:
                    sizes[anchor] = None
                if len(open_nodes) > MAX_DEPTH:
                    raise _Refused(
                        f"values are nested more than {MAX_DEPTH} deep; at most {MAX_DEPTH} is allowed", event
                    )
            case yaml.MappingEndEvent() | yaml.SequenceEndEvent():
                name, before = open_nodes.pop()
                if name is not None:
                    sizes[name] = count - before
        if count > MAX_VALUES:
            alias = f"the alias '*{anchor}' makes" if isinstance(event, yaml.AliasEvent) else "there are"
            raise _Refused(f"{alias} more than {MAX_VALUES} values; at most {MAX_VALUES} are allowed", event)


class _Refused(yaml.MarkedYAMLError):  # type: ignore[misc]
    def __init__(self, problem: str, at: yaml.Event | yaml.Node) -> None:
        super().__init__(None, None, problem, at.start_mark)


class _UniqueKeyLoader(_BASE):  # type: ignore[misc]
    """YAML's usual loader keeps the last of two equal keys in silence; this one refuses them."""

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        try:
            return super().construct_object(node, deep=deep)
        except yaml.YAMLError:
            raise
        except Exception as error:  # the constructors of tags raise anything: `!!bool x` a KeyError
            kind = node.tag.rpartition(":")[2]
            reason = f": {error}" if isinstance(error, ValueError) else ""
            raise _Refused(f"{shown(node.value)} is no {kind}{reason}", node) from error

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, Hashable):
                raise _Refused(f"a key is {shown(key)}; it must be text", key_node)
            if key in seen:
                raise _Refused(f"the key {shown(key)} is given twice", key_node)
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
            given = f"unknown key {shown(unknown)} (value {shown(value[unknown])})"
            return f"{place}: {given}; allowed: {', '.join(known)}{other}"
        case "enum":
            return f"{place} is {shown(value)}; allowed: {', '.join(map(str, allowed))}"
        case "const":
            return f"{place} is {shown(value)}; allowed: {allowed!r}"
        case "type":
            kinds = " or ".join([allowed] if isinstance(allowed, str) else allowed)
            hint = ""
            if "number" in kinds and isinstance(value, str) and _is_number(value):
                hint = " (YAML reads it as text; write it as 1.0e-3 or 0.001)"
            return f"{place} is {shown(value)}; it must be of type {kinds}{hint}"
        case "minItems" | "maxItems":
            bound = "at least" if error.validator == "minItems" else "at most"
            return f"{place} is {shown(value)} with {len(value)} values; it must have {bound} {allowed}"
        case "exclusiveMinimum":
            return f"{place} is {shown(value)}; it must be greater than {allowed}"
        case "minimum":
            return f"{place} is {shown(value)}; it must be at least {allowed}"
        case "maximum":
            return f"{place} is {shown(value)}; it must be at most {allowed}"
        case "pattern":
            return f"{place} is {shown(value)}; it must match {allowed}"
        case "oneOf" if place == "robot":
            return f"{place} is {shown(value)}; it needs either 'name' or 'urdf'"
        case "anyOf" if place == "body.components":
            return f"{place} is {shown(value)}; allowed: an integer from 1, one per link name, 'aic', 'bic'"
        case _:
            return f"{place} is {shown(value)}; it does not match {error.validator}: {shown(allowed)}"


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True

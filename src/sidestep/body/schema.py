"""Documents against JSON schemas: what is valid passes at once, what is not is told where and why."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import jsonschema_rs

if TYPE_CHECKING:
    import jsonschema


MAX_DEPTH = 32  # of lists and objects in each other; no file of Sidestep has ten
MAX_NUMBER = 1e30  # in size: its square and cube are still numbers
SHOWN = 200  # characters of a part in an error


def parse_json(text: str) -> Any:
    """The document in a JSON text.

    Raises:
        ValueError: not JSON, nested deeper than `MAX_DEPTH`, or a number that is not finite or beyond `MAX_NUMBER`.
    """

    def number(digits: str) -> float:
        value = float(digits)
        if not abs(value) <= MAX_NUMBER:
            what = "is too large" if digits.lstrip("-")[:1].isdigit() else "is not a finite number"
            raise ValueError(
                f"{shortened(digits)} {what}; what is not finite or beyond {MAX_NUMBER:g} is refused"
            )
        return value

    def integer(digits: str) -> int:
        number(digits)
        return int(digits)

    too_deep = f"values are nested more than {MAX_DEPTH} deep; at most {MAX_DEPTH} is allowed"
    try:
        document = json.loads(text, parse_constant=number, parse_float=number, parse_int=integer)
    except RecursionError as error:
        raise ValueError(too_deep) from error
    level = [document]
    for _ in range(MAX_DEPTH + 1):
        level = [
            inner
            for value in level
            if isinstance(value, (list, dict))
            for inner in (value.values() if isinstance(value, dict) else value)
        ]
        if not level:
            return document
    raise ValueError(too_deep)


def shortened(text: str) -> str:
    """A text as errors print it, not longer than anybody reads."""
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}…"


def mismatch(document: Any, schema_text: str) -> jsonschema.ValidationError | None:
    """The most telling of the places where a document does not match a schema (Draft 2020-12), None if it matches."""
    schema = json.loads(schema_text)
    try:
        if jsonschema_rs.Draft202012Validator(schema).is_valid(document):
            return None
    except Exception:  # what JSON does not have, such as keys that are no text or dates, the other judges
        pass
    import jsonschema  # here: beside JupyterLab its import takes seconds, for checks of formats that no schema asks for

    return jsonschema.exceptions.best_match(jsonschema.Draft202012Validator(schema).iter_errors(document))

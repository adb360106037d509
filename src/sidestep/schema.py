"""Documents against JSON schemas: what is valid passes at once, what is not is told where and why."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import jsonschema_rs

if TYPE_CHECKING:
    import jsonschema


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

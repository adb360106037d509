"""What a reader left out of a description or found implausible: one warning of each kind."""

from __future__ import annotations

import warnings

SHOWN = 12  # items named in one warning: every joint of an arm, and most of its links


class Remarks:
    """Collects remarks while a description is read, and gives them as warnings at its end.

    A kind is the sentence that follows the items: "joint 'a', joint 'b': no effort limit is given …".
    """

    def __init__(self) -> None:
        self._items: dict[str, list[str]] = {}

    def add(self, kind: str, item: str) -> None:
        """One more `item` of a `kind`; the same item is named once."""
        items = self._items.setdefault(kind, [])
        if item not in items:
            items.append(item)

    def warn(self, label: str, *, stacklevel: int) -> None:
        """One RuntimeWarning of each kind, which begins with `label`; `stacklevel` counts from the caller."""
        for kind, items in self._items.items():
            more = f" and {len(items) - SHOWN} more" if len(items) > SHOWN else ""
            warnings.warn(
                f"{label}: {', '.join(items[:SHOWN])}{more}: {kind}",
                RuntimeWarning,
                stacklevel=stacklevel + 1,
            )
        self._items.clear()

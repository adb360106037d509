"""Which links may touch, from an SRDF: the semantic description that MoveIt's setup assistant writes."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from pathlib import Path

from sidestep.robot.source import parse_xml, read_xml

Pair = tuple[str, str]


def read_srdf(source: str | Path, links: Iterable[str]) -> tuple[Pair, ...]:
    """The pairs among `links` that an SRDF lets touch, in the order of the links.

    These are the pairs of `<disable_collisions>`, and all of a link of `<disable_default_collisions>`, without
    those of `<enable_collisions>`. Links of the file that are not asked for are left out.

    Args:
        source: a path, or the XML text itself (starts with `<`).
        links: names.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: it is not an SRDF, or an element lacks a link.
    """
    if isinstance(source, str) and source.lstrip().startswith("<"):
        label, text = "SRDF string", source.lstrip()
    else:
        label = str(source)
        if not Path(source).is_file():
            raise FileNotFoundError(f"SRDF {label} does not exist or is not a file")
        text = read_xml(Path(source))
    root = parse_xml(text, label)

    def named(tag: str, *keys: str) -> set[frozenset[str]]:
        found = set()
        for element in root.findall(tag):
            names = [element.get(key) for key in keys]
            if not all(names):
                raise ValueError(f"{label}: a <{tag}> has {element.attrib}, must name {' and '.join(keys)}")
            found.add(frozenset(name for name in names if name))
        return found

    off = named("disable_collisions", "link1", "link2")
    on = named("enable_collisions", "link1", "link2")
    loose = {name for single in named("disable_default_collisions", "link") for name in single}
    return tuple(
        (a, b)
        for a, b in itertools.combinations(links, 2)
        if frozenset((a, b)) not in on and (frozenset((a, b)) in off or loose.intersection((a, b)))
    )

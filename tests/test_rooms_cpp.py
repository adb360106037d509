"""The rooms of the C++ core: each folder includes only those before it, and no includes run in a circle."""

import re
from pathlib import Path

import pytest

CPP = Path(__file__).parents[1] / "cpp"
ROOTS = {"src": CPP / "src", "include": CPP / "include"}
ROOMS = (
    "math robot scene body clearance arm attractor constraints guard planning controller perception loop link thesis"
).split()


def included(file: Path, text: str) -> list[Path]:
    """The files of the core that `text`, of `file`, includes."""
    found = []
    for mark, name in re.findall(r'^\s*#\s*include\s*(["<])([^">]+)[">]', text, re.MULTILINE):
        places = [(file.parent / name).resolve(), ROOTS["include"] / name]
        target = next((place for place in places if place.is_file()), None)
        assert target is not None or mark == "<", f"{file}: there is no {name}"
        if target is not None:  # others are of the compiler, the system or Eigen
            found.append(target)
    return found


def room(file: Path) -> str:
    """The room of a file: `src/ROOM/...` or `include/sidestep/ROOM/...`."""
    parts = file.relative_to(CPP).parts
    return parts[2] if parts[0] == "include" else parts[1]


def upward(edges: dict[Path, list[Path]]) -> list[str]:
    """Includes of a later room."""
    rank = {name: number for number, name in enumerate(ROOMS)}
    return [
        f"{file} includes {target}"
        for file, targets in edges.items()
        for target in targets
        if rank[room(target)] > rank[room(file)]
    ]


def circle(edges: dict[Path, list[Path]]) -> list[Path]:
    """Files that include each other in a circle; empty if there is none."""
    done: set[Path] = set()
    way: list[Path] = []

    def visit(file: Path) -> list[Path]:
        if file in way:
            return way[way.index(file) :]
        if file in done:
            return []
        way.append(file)
        for target in edges.get(file, []):
            if found := visit(target):
                return found
        way.pop()
        done.add(file)
        return []

    return next((found for file in edges if (found := visit(file))), [])


@pytest.fixture(scope="module")
def edges() -> dict[Path, list[Path]]:
    files = [
        file
        for root in ROOTS.values()
        for file in sorted(root.rglob("*"))
        if file.suffix in {".hpp", ".cpp", ".inl"} and file != ROOTS["include"] / "sidestep" / "sidestep.hpp"
    ]
    return {file: included(file, file.read_text(encoding="utf-8")) for file in files}


def test_every_folder_is_a_room(edges: dict[Path, list[Path]]) -> None:
    assert {room(file) for file in edges} == set(ROOMS)


def test_rooms_include_only_those_before_them(edges: dict[Path, list[Path]]) -> None:
    assert not upward(edges)


def test_no_includes_run_in_a_circle(edges: dict[Path, list[Path]]) -> None:
    assert not circle(edges)


def test_the_checks_find_what_they_look_for(edges: dict[Path, list[Path]]) -> None:
    early = ROOTS["include"] / "sidestep" / "robot" / "robot.hpp"
    late = ROOTS["include"] / "sidestep" / "arm" / "arm.hpp"
    wrong = edges | {early: [late]}
    assert upward(wrong) == [f"{early} includes {late}"]
    assert {early, late} <= set(circle(wrong))

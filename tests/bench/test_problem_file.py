"""Problems that are written come back the same."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from sidestep.bench import ProblemGenerator, read_problems, write_problems


def test_round_trip(generator: ProblemGenerator, tmp_path: Path) -> None:
    written = [generator.problem(index) for index in (0, 7)]
    write_problems(tmp_path / "p.json", written)
    for before, after in zip(written, read_problems(tmp_path / "p.json"), strict=True):
        assert (before.robot, before.seed, before.index) == (after.robot, after.seed, after.index)
        for name in ("start", "goal", "centers", "velocities", "radii"):
            np.testing.assert_array_equal(getattr(before, name), getattr(after, name))
        assert before.straight_line_blocked == after.straight_line_blocked


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "not JSON"),
        ("{}", "format"),
        ("[" * 100_000, "not JSON: values are nested more than 32 deep"),
        ('{"format": 1e999}', "1e999 is too large"),
        ('{"format": "sidestep-reach-problems", "version": 9}', "version"),
        ('{"format": "sidestep-reach-problems", "version": 1, "robot": "fr3"}', "problems"),
        (
            '{"format": "sidestep-reach-problems", "version": 1, "robot": "fr3", "problems": []}',
            "no problems",
        ),
    ],
)
def test_a_file_that_is_none_is_refused(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.json"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        read_problems(path)


def test_a_number_that_is_not_finite_is_refused(generator: ProblemGenerator, tmp_path: Path) -> None:
    path = tmp_path / "p.json"
    write_problems(path, [generator.problem(0)])
    document = json.loads(path.read_text())
    document["problems"][0]["goal"][0] = float("nan")
    path.write_text(json.dumps(document))
    with pytest.raises(ValueError, match="not finite"):
        read_problems(path)

"""Reach problems as a JSON file, for other software to run on exactly the same ones."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sidestep.bench.problems import ReachProblem
from sidestep.body.schema import parse_json

FORMAT = "sidestep-reach-problems"
VERSION = 1


def to_document(problems: Sequence[ReachProblem]) -> dict[str, Any]:
    """The problems as JSON: numbers are written in full, so that reading them back gives the same ones.

    Raises:
        ValueError: no problems, or of several robots.
    """
    robots = sorted({problem.robot for problem in problems})
    if len(robots) != 1:
        raise ValueError(f"a problem file holds problems of one robot, got {robots or 'none'}")
    return {
        "format": FORMAT,
        "version": VERSION,
        "robot": robots[0],
        "units": "rad and m for joints, m, s; obstacle k is a ball whose centre is center + t * velocity",
        "problems": [
            {
                "seed": problem.seed,
                "index": problem.index,
                "start": problem.start.tolist(),
                "goal": problem.goal.tolist(),
                "obstacles": [
                    {"center": center.tolist(), "radius": float(radius), "velocity": velocity.tolist()}
                    for center, radius, velocity in zip(
                        problem.centers, problem.radii, problem.velocities, strict=True
                    )
                ],
                "straight_line_blocked": problem.straight_line_blocked,
            }
            for problem in problems
        ],
    }


def write_problems(path: str | Path, problems: Sequence[ReachProblem]) -> None:
    """Writes problems to a JSON file, see `to_document`."""
    Path(path).write_text(json.dumps(to_document(problems), indent=1) + "\n", encoding="utf-8")


def read_problems(path: str | Path) -> tuple[ReachProblem, ...]:
    """Reads a file of `write_problems`.

    Raises:
        FileNotFoundError: no such file. ValueError: it is no such file; says where it is malformed.
    """
    try:
        document = parse_json(Path(path).read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"{path} is not JSON: {error}") from None
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise ValueError(f"{path} is not a file of reach problems: 'format' must be {FORMAT!r}")
    if document.get("version") != VERSION:
        raise ValueError(f"{path} has version {document.get('version')!r}, this program reads {VERSION}")
    try:
        problems = tuple(_problem(document["robot"], item) for item in document["problems"])
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{path} is malformed: {type(error).__name__} {error}") from None
    if not problems:
        raise ValueError(f"{path} holds no problems")
    return problems


def _problem(robot: str, item: dict[str, Any]) -> ReachProblem:
    obstacles = item["obstacles"]
    problem = ReachProblem(
        robot=str(robot),
        seed=int(item["seed"]),
        index=int(item["index"]),
        start=np.array(item["start"], dtype=float),
        goal=np.array(item["goal"], dtype=float),
        centers=np.array([ball["center"] for ball in obstacles], dtype=float).reshape(-1, 3),
        velocities=np.array([ball["velocity"] for ball in obstacles], dtype=float).reshape(-1, 3),
        radii=np.array([ball["radius"] for ball in obstacles], dtype=float),
        straight_line_blocked=bool(item["straight_line_blocked"]),
    )
    numbers = (problem.start, problem.goal, problem.centers, problem.velocities, problem.radii)
    if not all(np.all(np.isfinite(values)) for values in numbers):
        raise ValueError(f"problem {problem.index} has a number that is not finite")
    return problem

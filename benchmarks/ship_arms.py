"""Makes the arms that come with Sidestep, src/sidestep/shipped_arms/NAME.arm, of every robot that is installed.

    python benchmarks/ship_arms.py [NAME ...] [--again]

An arm whose robot has the meshes that it was made from keeps its cover, tables and pairs of links. With --again all is
made again, for instance by an algorithm that has changed: copies of the user's cache are taken where there are any, the
rest takes minutes a robot.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import sidestep as ss
from sidestep import shipped_arms
from sidestep.arm import prepare


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help="of `sidestep robots`; all by default")
    parser.add_argument("--again", action="store_true", help="keep nothing of the arms there are")
    arguments = parser.parse_args()
    folder = shipped_arms.FOLDER
    folder.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as nothing:
        if arguments.again:
            shipped_arms.FOLDER = Path(nothing)
        for name in arguments.names or [entry.name for entry in ss.robots()]:
            robot = ss.Robot.named(name)
            body = ss.Body.cover(
                robot, effort="best", progress=lambda link, done, in_all: show("cover", link, done, in_all)
            )
            arm = prepare(robot, body=body, progress=show)
            path = folder / f"{name}{shipped_arms.SUFFIX}"
            arm.save(path)
            print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB, {arm.content_hash[:12]}", flush=True)


def show(stage: str, item: str, done: int, in_all: int) -> None:
    print(f"  {stage}: {item} ({done} of {in_all})", flush=True)


if __name__ == "__main__":
    main()

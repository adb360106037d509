"""Makes what comes with Sidestep in src/sidestep/body/covers: bodies, pairs of links, clearance tables; minutes each.

    python benchmarks/ship_covers.py

Those of the same robots made by an older algorithm, or of older meshes, are removed. Copies of the user's cache are
taken where there are any: a fit is determined by robot, settings and algorithm, which name its file.
"""

from __future__ import annotations

import shutil

from sidestep import Body, Robot, clearance_tables
from sidestep.body import cache
from sidestep.body.cover import CoverSettings
from sidestep.link_pairs import barrier_pairs, stored_at

ROBOTS = ("fr3", "fr3_arm", "panda", "ur10", "xarm7", "iiwa", "planar3")


def main() -> None:
    shutil.rmtree(cache.SHIPPED, ignore_errors=True)
    cache.SHIPPED.mkdir()
    for name in ROBOTS:
        robot = Robot.named(name)
        body = Body.cover(robot)
        barrier_pairs(robot, body)
        clearance_tables.clearance_tables(robot)
        stored = (
            cache.cache_path(robot, CoverSettings()),
            stored_at(robot, body),
            clearance_tables.stored_at(robot),
        )
        for path in stored:
            shutil.copy(path, cache.SHIPPED / path.name)
            print(f"{name}: {path.name}")


if __name__ == "__main__":
    main()

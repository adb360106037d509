"""Covers a robot and states how closely.

python benchmarks/cover.py --robot fr3 --json -
python benchmarks/cover.py --robot fr3 --components fr3_hand=20 fr3_leftfinger=20 --max-components 100 --json -
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
import time
from dataclasses import asdict
from pathlib import Path

import sidestep
from sidestep.body import cover_table, plot_cover


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robot", default="fr3")
    parser.add_argument("--max-components", type=int, default=80)
    parser.add_argument(
        "--components", nargs="+", default=[], metavar="LINK=NUMBER", help="links with numbers of their own"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", default="-", help="file for the result, - for the terminal")
    parser.add_argument("--plots", type=Path, help="folder for figures")
    arguments = parser.parse_args()

    robot = sidestep.Robot.named(arguments.robot)
    components = {link: int(number) for link, number in (asked.split("=") for asked in arguments.components)}
    wall, cpu = time.perf_counter(), time.process_time()
    body = sidestep.Body.cover(
        robot,
        components=components or None,
        max_components=arguments.max_components,
        seed=arguments.seed,
        cache=False,
    )
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    result = {
        "robot": arguments.robot,
        "seed": arguments.seed,
        "max_components": arguments.max_components,
        "components": components,
        "num_components": body.num_components,
        "wall_s": round(wall, 1),
        "cpu_s": round(cpu, 1),
        "machine": platform.processor() or platform.machine(),
        "links": [asdict(row) for row in cover_table(body)],
        "trade_off": {cover.link: [asdict(point) for point in cover.trade_off] for cover in body.link_covers},
    }
    text = json.dumps(result, indent=1) + "\n"
    if arguments.json == "-":
        sys.stdout.write(text)
    else:
        Path(arguments.json).write_text(text, encoding="utf-8")
    if arguments.plots is not None:
        plot_cover(body, robot, arguments.plots)


if __name__ == "__main__":
    main()

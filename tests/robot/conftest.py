import sys

import pytest


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Without a wheel of pybullet for this Python there is no iiwa; every other robot must be installed."""
    if sys.version_info < (3, 12) and sys.platform == "linux":
        return
    for item in items:
        if "[iiwa]" in item.name:
            item.add_marker(
                pytest.mark.skip(reason="pybullet has wheels for Linux and CPython up to 3.11 only")
            )

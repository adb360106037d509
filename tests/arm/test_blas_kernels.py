"""What is prepared is the same under every kernel of the linear algebra that NumPy was built with."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

# Kernels with and without fused multiply-add, which round differently; every x86-64 processor of today loads both.
KERNELS = ("Haswell", "Prescott")
CODE = """
import sys, threadpoolctl, numpy, scipy.linalg
from pathlib import Path
from sidestep import Robot
from sidestep import shipped_arms
from sidestep.arm.preparation import prepare
shipped_arms.FOLDER = Path(sys.argv[1])  # which is empty: nothing is taken from a shipped arm
kernels = {pool.get("architecture") for pool in threadpoolctl.threadpool_info() if pool["user_api"] == "blas"}
robot = Robot.named("planar2")
print(*sorted(map(str, kernels)), prepare(robot, draft=True, cached=False).content_hash)
"""


@pytest.mark.slow
def test_an_arm_is_prepared_bit_for_bit_alike_under_two_kernels(tmp_path: Path) -> None:
    pytest.importorskip("threadpoolctl")
    hashes, kernels = set(), set()
    for name in KERNELS:
        environment = {**os.environ, "OPENBLAS_CORETYPE": name, "SOURCE_DATE_EPOCH": "0"}
        run = subprocess.run(
            [sys.executable, "-c", CODE, str(tmp_path)],
            env=environment, capture_output=True, text=True, check=True,
        )  # fmt: skip
        *kernel, content = run.stdout.split()
        kernels.add(tuple(kernel))
        hashes.add(content)
    if len(kernels) == 1:
        pytest.skip(f"OPENBLAS_CORETYPE has no effect here: BLAS is {kernels}")
    assert len(hashes) == 1

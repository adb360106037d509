"""Importing and leaving are silent."""

import subprocess
import sys


def test_nothing_is_leaked_at_exit() -> None:
    # nanobind reports leaked instances on stderr when the interpreter ends, for example a default argument that is an
    # instance of a bound class.
    code = (
        "import sidestep\nfor name in sidestep.__all__: getattr(sidestep, name)\nprint(sidestep.__version__)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.count(".") == 2
    assert done.stderr == ""

"""Runs the README's example in Python against what is installed: the test of a wheel, without extras or a checkout."""

import contextlib
import io
import re
from pathlib import Path

import sidestep

README = Path(__file__).parents[1] / "README.md"
[example] = re.findall(
    r"^```python\n(.*?)^```$", README.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL
)
printed = io.StringIO()
with contextlib.redirect_stdout(printed):
    exec(compile(example, str(README), "exec"), {})
if printed.getvalue() != "arrived ok arrived\n":
    raise SystemExit(f"the README's example printed {printed.getvalue()!r}")
print(f"sidestep {sidestep.__version__}, {sidestep.__file__}: {printed.getvalue()}", end="")

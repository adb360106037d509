"""The counts of .ci/structure on small samples, where they can be counted by hand."""

import json
import subprocess
import sys
from pathlib import Path
from textwrap import dedent

import pytest

SCRIPT = Path(__file__).parents[1] / ".ci" / "structure"
sys.path.insert(0, str(SCRIPT))

import cpp_code  # noqa: E402
import cpp_tokens  # noqa: E402
import python_code  # noqa: E402
from graph import between, circles  # noqa: E402

HEADER = """
#pragma once
namespace ours {
enum class Status { ok, lost };
/// Has { a bracket in its comment.
template <class T, int n = (3 < 4)>
class Stage final : public Base<T>, private other::Part {
 public:
  explicit Stage(int size) : rows_{size}, text_("}") { begin(); }
  ~Stage();
  Stage(const Stage&) = delete;
  static int made() { return count; }
  int size() const noexcept { return rows_; }
  void begin() noexcept;
  double worst() const;
  [[nodiscard]] bool solve(const Vector& v, Settings settings = {}) noexcept(true);
  template <class Action>
  void guarded(Action&& action);
  bool operator==(const Stage&) const = default;
  const char* operator()() const;
  friend class Recorder;
  using Row = std::array<double, 3>;
  struct Clock {
    double time = 0.0, rate{1.0};
  } clock_, before_;
  std::function<void(int, int)> call = [](int a, int b) { use(a < b); };

 private:
  int rows_, last_ = most<int, 3>();
  alignas(64) double buffer_[8];
  std::map<int, std::vector<std::pair<int, int>>> table_{{1, {}}};
  static constexpr double reason = 1.0;
  const std::string text_;
};
struct alignas(32) Small { int a : 3, b : 5; };
}  // namespace ours
"""
SOURCE = """
#include "stage.hpp"
namespace ours {
namespace {
constexpr double limit = 3.0;  // {
const auto table = make({1, 2});
double half(double x) {
  return x / 2;
}
}  // namespace
template <class T, int n>
void Stage<T, n>::begin() noexcept {
  rows_ = 1'000;
  for (int i = 0; i < rows_; ++i) {
    use(R"x(})x", '}');
  }
}
Other::Other(int a) : Base(a), b_{a} {}
}  // namespace ours
"""


def test_classes_are_read():
    file = cpp_code.read_text(HEADER)
    members = {c.name: c.members for c in file.classes}
    assert members == {
        "Stage": ["clock_", "before_", "call", "rows_", "last_", "buffer_", "table_", "text_"],
        "Stage::Clock": ["time", "rate"],
        "Small": ["a", "b"],
    }
    [stage, *_] = file.classes
    assert stage.bases == ["Base", "other", "Part"]
    assert [(m.name, m.has_parameters, m.is_const, m.is_static) for m in stage.methods] == [
        ("made", False, False, True),
        ("size", False, True, False),
        ("begin", False, False, False),
        ("worst", False, True, False),
        ("solve", True, False, False),
        ("guarded", True, False, False),
    ]
    assert stage.methods[1].body == ["return", "rows_", ";"]
    assert file.enums == ["Status"]


def test_functions_are_read():
    file = cpp_code.read_text(SOURCE)
    assert [(f.name, f.lines) for f in file.functions] == [
        ("half", 3),
        ("Stage::begin", 7),
        ("Other::Other", 1),
    ]


def test_an_unclosed_bracket_is_refused():
    with pytest.raises(ValueError, match=r"line 2: \{ is not closed"):
        cpp_code.read_text("int a;\nstruct B {")


def test_includes_are_found_beside_the_file_and_in_the_include_folder(tmp_path):
    for name, text in {
        "src/a/a.cpp": '#include "a/a.hpp"\n#include "detail.hpp"\n#include <vector>\n',
        "src/a/detail.hpp": "// #include nothing\n",
        "include/a/a.hpp": '#include "b/b.hpp"\n',
        "include/b/b.hpp": '  #include "a/a.hpp"\n',
    }.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    edges = cpp_tokens.include_edges([tmp_path / "src", tmp_path / "include"])
    names = {
        p.relative_to(tmp_path).as_posix(): {t.relative_to(tmp_path).as_posix() for t in e}
        for p, e in edges.items()
    }
    assert names == {
        "src/a/a.cpp": {"include/a/a.hpp", "src/a/detail.hpp"},
        "src/a/detail.hpp": set(),
        "include/a/a.hpp": {"include/b/b.hpp"},
        "include/b/b.hpp": {"include/a/a.hpp"},
    }
    assert circles(names) == [["include/a/a.hpp", "include/b/b.hpp"]]


def test_circles():
    edges = {"a": {"b"}, "b": {"c"}, "c": {"a", "d"}, "d": {"e"}, "e": {"d"}, "f": {"f", "a"}}
    assert circles(edges) == [["a", "b", "c"], ["d", "e"]]
    assert between(edges, {"a": "1", "b": "1", "c": "2", "d": "2", "e": "3", "f": "3"}) == {
        "1": {"2"},
        "2": {"1", "3"},
        "3": {"1", "2"},
    }


def test_lines_of_code(tmp_path):
    path = tmp_path / "a.cpp"
    path.write_text('int a;  // one\n\n/* none\n\n*/\n// none\nconst char* b = "// two";\n')
    assert cpp_tokens.code_lines(path) == 2
    path = tmp_path / "a.py"
    path.write_text(
        '"""None.\n\nNone."""\n\n# none\ndef f():\n    """None."""\n    return """\n\nfive\n"""\n'
    )
    assert python_code.code_lines(path) == 4


def python_package(folder, files):
    for name, text in files.items():
        path = folder / "sidestep" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(dedent(text))
    return python_code.Imports(folder).edges()


def test_an_import_counts_for_the_file_that_defines_the_name(tmp_path):
    edges = python_package(
        tmp_path,
        {
            "__init__.py": "",
            "__init__.pyi": "from .robot import Robot as Robot\n",
            "robot/__init__.py": "from sidestep.robot.model import Robot\n",
            "robot/model.py": """
                from typing import TYPE_CHECKING

                if TYPE_CHECKING:
                    from sidestep.body import cover

                def body():
                    from sidestep.body import cover_of
                    import numpy
                """,
            "body/__init__.py": "",
            "body/__init__.pyi": "from .cover import cover_of as cover_of\n",
            "body/cover.py": "import sidestep as ss\nrobot = ss.Robot\n",
            "body/late.py": "from importlib import import_module\nmodel = import_module('sidestep.robot.model')\n",
            "body/beside.py": "from . import cover\nfrom .late import model\nfrom ..robot import model\n",
        },
    )
    assert edges["sidestep.robot.model"] == {"sidestep.body.cover"}
    assert edges["sidestep.body.cover"] == {"sidestep.robot.model"}
    assert edges["sidestep.body.late"] == {"sidestep.robot.model"}
    assert edges["sidestep.body.beside"] == {
        "sidestep.body.cover",
        "sidestep.body.late",
        "sidestep.robot.model",
    }
    assert circles(edges) == [["sidestep.body.cover", "sidestep.robot.model"]]


def test_attributes_and_long_functions(tmp_path):
    path = tmp_path / "a.py"
    path.write_text(
        dedent(
            """
            class Page:
                kind: ClassVar[str] = "page"
                width: int
                height: int = 3

                def draw(self):
                    '''What
                    it does.'''
                    self.width = 1
                    self.lines, other.name = [], 2

                def clear(self):
                    self.drawn += 1
            """
        )
    )
    assert python_code.attributes(path) == {"Page": 4}
    assert python_code.long_functions(path, 2) == [("draw", 3)]


def test_the_script_counts_this_checkout(tmp_path):
    file = tmp_path / "counts.json"
    done = subprocess.run(
        [sys.executable, SCRIPT, "--json", file], capture_output=True, text=True, check=True, timeout=120
    )
    assert "members of the largest struct" in done.stdout
    counts = json.loads(file.read_text())
    assert "methods without parameters that may write" in counts
    assert counts["enums of results in public modules"] == ["Activity", "SafetyStatus"]
    assert counts["enums of results in the C++ reference"] == ["Activity", "PlanStatus", "SafetyStatus"]

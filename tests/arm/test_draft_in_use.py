"""Commands take an arm that is not prepared as a draft, and say how far they are where the output is no terminal."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import sidestep as ss
from sidestep.arm import Refinement
from sidestep.cli import app
from sidestep.robot import planar_arm
from sidestep.scenario import Scenario
from sidestep.scenario.assembly import assemble

SCENARIO = """
format: 1
name: mine
robot: {{urdf: {urdf}}}
method: controller
start: {{unit: rad, position: [0.0, 0.3]}}
goal: {{unit: rad, position: [0.4, 0.5]}}
body: {{draft: {draft}}}
simulation: {{mode: kinematic, duration: 5.0}}
"""


@pytest.fixture(autouse=True)
def cache_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr("sidestep.cli.output.LINE_EVERY", 0.0)
    return tmp_path / "cache"


@pytest.fixture
def urdf(tmp_path: Path) -> Path:
    """Thinner than the shipped arm, so that it has to be prepared."""
    path = tmp_path / "mine.urdf"
    path.write_text(planar_arm(2).replace('size="0.5 0.08 ', 'size="0.5 0.07 '))
    return path


def test_a_scenario_may_ask_for_a_draft(urdf: Path, tmp_path: Path) -> None:
    path = tmp_path / "scenario.yaml"
    path.write_text(SCENARIO.format(urdf=urdf, draft="true"))
    told: list[str] = []
    body = assemble(Scenario.load(str(path)), progress=lambda item, done, in_all: told.append(item)).body
    assert body.settings is not None
    assert body.settings.effort == "draft"  # type: ignore[union-attr]
    assert told
    path.write_text(SCENARIO.format(urdf=urdf, draft="2"))
    with pytest.raises(ValueError, match=r"body\.draft is 2"):
        Scenario.load(str(path))


def test_run_takes_a_draft_and_says_how_far_it_is(urdf: Path, tmp_path: Path) -> None:
    path = tmp_path / "scenario.yaml"
    path.write_text(SCENARIO.format(urdf=urdf, draft="false"))
    out = tmp_path / "figures.json"
    done = CliRunner().invoke(app, ["run", str(path), "--draft", "--no-report", "--json", str(out)])
    assert done.exit_code == 0, done.output
    assert "preparing link" in done.output
    assert json.loads(out.read_text())["success"] is True
    settings = [
        json.loads(file.read_text())["settings"] for file in (tmp_path / "cache" / "bodies").iterdir()
    ]
    assert [each["effort"] for each in settings] == ["draft"]
    refused = CliRunner().invoke(app, ["run", "thesis-6.2.3", "--draft", "--no-report"])
    assert "--draft goes with the controller" in str(refused.exception)


def test_reach_takes_a_file_and_a_draft(urdf: Path, tmp_path: Path) -> None:
    out = tmp_path / "figures.json"
    options = [
        "--problems",
        "2",
        "--obstacles",
        "0",
        "--jobs",
        "1",
        "--duration",
        "10",
        "--draft",
        "--json",
        str(out),
    ]
    done = CliRunner().invoke(app, ["bench", "reach", "--robot", str(urdf), *options])
    assert done.exit_code == 0, done.output
    found = json.loads(out.read_text())
    assert (found["draft"], found["problems"], found["success"]) == (True, 2, 2)
    assert "2 of 2, arrived" in done.output
    assert "preparing link" in done.output


def test_prepare_without_the_cache_leaves_none(urdf: Path, tmp_path: Path, cache_folder: Path) -> None:
    arguments = ["prepare", str(urdf), "--draft", "--out", str(tmp_path / "a.arm")]
    done = CliRunner().invoke(app, [*arguments, "--no-cache"])
    assert done.exit_code == 0, done.output
    assert not cache_folder.exists()
    assert CliRunner().invoke(app, arguments).exit_code == 0
    assert {folder.name for folder in cache_folder.iterdir()} >= {"arms", "links"}


@pytest.mark.slow
def test_prepare_gives_links_the_ellipsoids_asked_for(urdf: Path, tmp_path: Path) -> None:
    arguments = ["prepare", str(urdf), "--out", str(tmp_path / "a.arm"), "--components"]
    for wrong in ("link1=2.5", "link1", "link1=0"):
        refused = CliRunner().invoke(app, [*arguments, wrong])
        assert refused.exit_code != 0
        assert "link1" in str(refused.exception)
    done = CliRunner().invoke(app, [*arguments, "link1=3"])
    assert done.exit_code == 0, done.output
    assert list(ss.Arm.load(tmp_path / "a.arm").body.links).count("link1") == 3


def test_a_refinement_serves_without_a_cache_and_says_how_far_it_is(
    urdf: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("not a folder")
    monkeypatch.setenv("SIDESTEP_CACHE_DIR", str(tmp_path / "file"))
    with pytest.warns(RuntimeWarning, match="not cached"):
        draft = ss.Arm.load(urdf, draft=True)
    told: list[tuple[str, str, int, int]] = []
    fine = Refinement(draft, progress=lambda *each: told.append(each)).wait(300.0)
    assert not fine.is_draft
    assert fine.content_hash != draft.content_hash
    assert {stage for stage, *_ in told} >= {"cover"}
    assert fine.body.num_components >= 2
    np.testing.assert_array_equal(
        fine.robot.neutral, draft.robot.neutral
    )  # with meshes, of the same description

"""The baseline of recordings: short motions of every kind, and their replays."""

from pathlib import Path

import pytest

from sidestep.bench.recorded_cases import cases
from sidestep.bench.recordings import FOLDER_VARIABLE, record_all, replay_all


def test_cases_are_recorded_and_replayed_equal(tmp_path, monkeypatch):
    monkeypatch.delenv(FOLDER_VARIABLE, raising=False)
    folder = tmp_path / "before"
    told = []
    paths, left_out = record_all(
        folder, only=["twist", "trajectory"], progress=lambda *args: told.append(args)
    )
    assert left_out == []
    assert [path.relative_to(folder) for path in paths] == [
        Path("trajectory/fr3-001.mcap"),
        Path("trajectory/fr3-002.mcap"),
        Path("twist/fr3-001.mcap"),
    ]
    assert told[-1] == (2, 2, "done")
    results = replay_all([folder], jobs=2)
    assert [(path, result.equal, result.steps) for path, result in results] == [
        (path, True, 1500) for path in paths
    ]
    with pytest.raises(ValueError, match="has recordings already"):
        record_all(folder)


def test_black_boxes_in_a_folder_are_passed_over(tmp_path):
    (tmp_path / "blackbox-20261127-120000-fr3-000001.mcap").write_bytes(b"")
    with pytest.raises(ValueError, match=r"there is no recording \(\*\.mcap\)"):
        replay_all([tmp_path], jobs=1)


def test_an_unknown_case_is_refused_with_those_that_there_are(tmp_path):
    with pytest.raises(ValueError, match=r"no case 'dance'; there are: reach-fr3, .*, real-time-attach"):
        record_all(tmp_path, only=["dance"])
    assert len({case.name for case in cases()}) == len(cases())


@pytest.mark.slow
def test_every_case_is_replayed_equal(tmp_path):
    paths, left_out = record_all(tmp_path / "all")
    assert left_out == []
    results = replay_all([tmp_path / "all"], jobs=2)
    assert len(results) == len(paths) > len(cases())
    assert [str(path) for path, result in results if not result.equal] == []

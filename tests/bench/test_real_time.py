"""`sidestep bench realtime`."""

import json
import time

import pytest

from sidestep.bench import RealTimeBenchSettings, run_real_time_bench
from sidestep.bench.real_time import BESIDE, CLOCK, RECORDER
from sidestep.cli import main


def test_every_row_is_of_what_was_asked_for():
    told, begun = [], []

    def note(*news):
        told.append(news)
        begun.append(time.monotonic())

    settings = RealTimeBenchSettings(robot="planar2", points=50, seconds=0.4, refresh=50.0, camera=False)
    document = run_real_time_bench(settings, progress=note)
    assert [row["beside"] for row in document["results"]] == [*BESIDE, RECORDER]
    assert [news[:2] for news in told] == [(0, 4), (1, 4), (2, 4), (3, 4)]
    for row in document["results"]:
        assert row["steps"] == sum(row["late_histogram"]["counts"]) == 400
        in_time = row["late_us"]["max"] + row["step_us"]["max"] <= 1000.0
        assert row["missed"] == 0 if in_time else row["missed"] <= 400
        if row["beside"] != CLOCK:
            assert row["searches"] >= 0
            assert 0.0 < row["step_us"]["median"] <= row["step_us"]["p99.9"] <= row["step_us"]["max"]
        assert 0.0 < row["late_us"]["median"] <= row["late_us"]["max"]
    _, goals, clouds, recorded = document["results"]
    assert goals["clouds"] == 0
    taken = begun[3] - begun[2]  # [s]: 0.4, longer on a busy machine
    assert 2 <= clouds["clouds"] <= 1 + settings.refresh * taken
    record = recorded["record"]
    assert record["replay_equal"]
    assert record["steps"] >= 400
    assert record["lost"] == 0
    assert 1e6 < record["bytes_a_minute"] < 1e9


def test_rows_are_chosen_by_name():
    settings = RealTimeBenchSettings(
        robot="planar2", points=20, seconds=0.1, camera=False, rows=("recorder", "clock")
    )
    document = run_real_time_bench(settings)
    assert [row["beside"] for row in document["results"]] == [CLOCK, RECORDER]
    with pytest.raises(ValueError, match="row is 'tea'; there are clock, goals, clouds, recorder"):
        RealTimeBenchSettings(rows=("tea",))
    with pytest.raises(ValueError, match="size is '1x1'; there are 848x480, 424x240"):
        RealTimeBenchSettings(size="1x1")


def test_the_command_writes_the_same(capsys, monkeypatch):
    monkeypatch.setattr(
        "sys.argv",
        [
            "sidestep",
            "bench",
            "realtime",
            "--robot",
            "planar2",
            "--points",
            "20",
            "--seconds",
            "0.1",
            "--no-camera",
            "--json",
            "-",
        ],
    )
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code in (0, None)
    document = json.loads(capsys.readouterr().out)
    assert document["benchmark"] == "realtime"
    assert document["points"] == 20
    assert [row["steps"] for row in document["results"]] == [100] * 4


@pytest.mark.parametrize("name", ["points", "seconds", "refresh"])
def test_what_is_not_positive_is_named(name):
    with pytest.raises(ValueError, match=f"{name} is 0, must be positive and finite"):
        RealTimeBenchSettings(**{name: 0})

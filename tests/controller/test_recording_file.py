"""The files of recordings are MCAP: the package `mcap` reads them, and what they say in JSON is what was done."""

import json
import struct
import subprocess
import sys
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader, SeekingReader
from mcap.stream_reader import StreamReader

import sidestep as ss

STEPS = 300
OLD, OLD_STEPS = Path(__file__).parent / "recordings" / "planar2.step", 20  # of Sidestep 0.2
TOPICS = {f"/sidestep/{kind}" for kind in ("head", "arm", "world", "request", "obstacles", "step", "done")}


@pytest.fixture(scope="module")
def commands_and_path(tmp_path_factory):
    path = tmp_path_factory.mktemp("recordings") / "run.mcap"
    arm = ss.Arm.load("planar3")
    controller = ss.Controller(arm, ss.ControllerSettings(synchronous=True))
    commands = []
    with controller.record(path):
        controller.set_obstacles(ss.Obstacles([[1.2, 0.6, 0.0]], radii=0.1))
        controller.set_goal(arm.neutral + 0.4)
        q, v = arm.neutral, np.zeros(3)
        for k in range(STEPS):
            command = controller.step(q, v, time=5.0 + 0.001 * k)
            commands.append((q, v, command))
            q, v = command.position, command.velocity
    return commands, path


def test_every_record_is_read_with_its_time_and_without_a_wrong_checksum(commands_and_path):
    _, path = commands_and_path
    with path.open("rb") as stream:
        found = list(NonSeekingReader(stream, validate_crcs=True).iter_messages(log_time_order=False))
    counts = {}
    for _, channel, message in found:
        assert channel.message_encoding == ("json" if channel.topic == "/summary" else "sidestep")
        assert message.sequence == counts.get(channel.topic, 0)
        counts[channel.topic] = message.sequence + 1
    assert counts["/sidestep/step"] == STEPS
    assert counts["/sidestep/head"] == counts["/sidestep/done"] == 1
    assert set(counts) == TOPICS - {"/sidestep/arm"} | {"/summary"}
    times = [message.log_time for _, channel, message in found if channel.topic == "/sidestep/step"]
    assert times == [5_000_000_000 + 1_000_000 * k for k in range(STEPS)]


def test_the_seeking_reader_reads_it_too_and_all_channels_are_announced(commands_and_path):
    _, path = commands_and_path
    with path.open("rb") as stream:
        reader = SeekingReader(stream, validate_crcs=True)
        assert reader.get_header().library == f"sidestep {ss.__version__}"
        assert len(list(reader.iter_messages(topics=["/sidestep/step"]))) == STEPS
    with path.open("rb") as stream:
        names = [type(record).__name__ for record in StreamReader(stream, validate_crcs=True).records]
    assert names[0] == "Header"
    assert names[-2:] == ["DataEnd", "Footer"]
    assert names.count("Channel") == len(TOPICS) + 1
    assert names.index("Message") > max(k for k, name in enumerate(names) if name in ("Schema", "Channel"))


def test_the_summary_keeps_its_schema_and_says_what_was_done(commands_and_path):
    commands, path = commands_and_path
    with path.open("rb") as stream:
        found = [
            (schema, message)
            for schema, channel, message in NonSeekingReader(stream).iter_messages(topics=["/summary"])
        ]
    assert len(found) == STEPS // 20
    for k, (schema, message) in enumerate(found):
        assert (schema.name, schema.encoding) == ("sidestep.Summary", "jsonschema")
        said = json.loads(message.data)
        jsonschema.validate(said, json.loads(schema.data))
        q, v, command = commands[20 * k]
        assert said["t"] == pytest.approx(5.0 + 0.02 * k, abs=1e-9)  # 9 digits are written
        assert (said["status"], said["activity"]) == (command.status.name, command.activity.name)
        np.testing.assert_allclose(said["q"], q, rtol=1e-8, atol=1e-12)
        np.testing.assert_allclose(said["v"], v, rtol=1e-8, atol=1e-12)
        expected = command.clearance if np.isfinite(command.clearance) else None
        assert said["clearance"] == (expected if expected is None else pytest.approx(expected, rel=1e-8))


def test_a_program_that_is_killed_leaves_a_file_that_both_read(tmp_path):
    path = tmp_path / "killed.mcap"
    program = f"""
import os, time
import numpy as np
import sidestep as ss
controller = ss.Controller(ss.Arm.load("planar2"), ss.ControllerSettings(synchronous=True))
recording = controller.record({str(path)!r})
for _ in range(50):
    controller.step(np.zeros(2), np.zeros(2))
time.sleep(0.5)  # the writer looks every 2 ms
os.kill(os.getpid(), 9)
"""
    assert subprocess.run([sys.executable, "-c", program]).returncode == -9
    with path.open("rb") as stream:
        reader = NonSeekingReader(stream, validate_crcs=True)
        assert len(_until_the_end(reader, "/sidestep/step")) == 50
    result = ss.replay(path)
    assert result.equal
    assert not result.complete
    assert result.steps == 50
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(path.read_bytes()[:-30])  # in the middle of a record
    with cut.open("rb") as stream:
        assert len(_until_the_end(NonSeekingReader(stream), "/sidestep/step")) == 49
    assert ss.replay(cut).steps == 49


def _until_the_end(reader, topic):
    """The messages of a topic up to where the file was cut off."""
    found = []
    with pytest.raises((EndOfFile, struct.error)):  # whichever the package meets
        found.extend(message for _, _, message in reader.iter_messages(topics=[topic], log_time_order=False))
    return found


def test_what_other_programs_add_is_passed_over(commands_and_path, tmp_path):
    """A channel of another program and records that we do not know."""
    from mcap.writer import CompressionType, Writer

    _, path = commands_and_path
    mixed = tmp_path / "mixed.mcap"
    with path.open("rb") as source, mixed.open("wb") as target:
        writer = Writer(target, compression=CompressionType.NONE, use_chunking=False)
        writer.start()
        foreign = writer.register_channel("/camera", "raw", 0)
        channels = {}
        for _, channel, message in NonSeekingReader(source).iter_messages(log_time_order=False):
            if channel.id not in channels:
                channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, 0)
            writer.add_message(foreign, 0, b"an image", 0)
            writer.add_message(channels[channel.id], message.log_time, message.data, message.publish_time)
        writer.add_metadata("notes", {"who": "me"})
        writer.finish()
    result = ss.replay(mixed)
    assert (result.equal, result.complete, result.steps) == (True, True, STEPS)


def test_chunks_of_other_programs_are_refused_with_the_reason(commands_and_path, tmp_path):
    from mcap.writer import Writer

    chunked = tmp_path / "chunked.mcap"
    with chunked.open("wb") as target:
        writer = Writer(target)
        writer.start()
        channel = writer.register_channel("/sidestep/head", "sidestep", 0)
        writer.add_message(channel, 0, b"12345678", 0)
        writer.finish()
    with pytest.raises(ValueError, match="it has chunks, as other programs write them"):
        ss.replay(chunked)


def test_a_recording_of_0_2_is_replayed_and_not_read(tmp_path):
    """The first steps of a motion, cut off as by a kill."""
    result = ss.replay(OLD)
    assert (result.arm, result.damage, result.complete) == ("planar2", "", False)
    made_elsewhere = [note for note in result.notes if note.startswith(("compiler", "instruction set"))]
    if not made_elsewhere:  # else a last bit may differ, and the replay ends there
        assert (result.equal, result.steps) == (True, OLD_STEPS)
    with pytest.raises(ValueError, match=r"planar2\.step': it is of Sidestep 0\.2, and can only be replayed"):
        ss.load_recording(OLD)
    headless = tmp_path / "old.step"
    headless.write_bytes(OLD.read_bytes()[:8])  # its magic alone opens its reader
    with pytest.raises(ValueError, match="its head is damaged or missing"):
        ss.replay(headless)


def test_numbers_that_are_not_finite_are_null_in_the_summary(tmp_path):
    path = tmp_path / "run.mcap"
    controller = ss.Controller(ss.Arm.load("planar2"), ss.ControllerSettings(synchronous=True))
    with controller.record(path):
        controller.step([np.nan, 0.0], [0.0, 0.0])
    with path.open("rb") as stream:
        (said,) = [
            json.loads(m.data) for _, _, m in NonSeekingReader(stream).iter_messages(topics=["/summary"])
        ]
    assert said["q"] == [None, 0.0]
    assert said["clearance"] is None
    assert said["status"] == "stopping"

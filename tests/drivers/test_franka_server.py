"""The server's process, by programs in its place."""

from __future__ import annotations

import gc
import socket
import subprocess
from pathlib import Path
from typing import Any

import pytest

from sidestep.drivers import FrankaServer, franka_server

SERVES = "#!/bin/sh\necho INFO serves\nexec /bin/sleep 60\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An environment that is there already, whose server does not answer."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        monkeypatch.setattr(franka_server, "PORT", free.getsockname()[1])
    programs = tmp_path / "server" / "bin"
    programs.mkdir(parents=True)
    for name, text in (("python", SERVES), ("franka-sim-check", "#!/bin/sh\nexit 1\n")):
        (programs / name).write_text(text, encoding="utf-8")
        (programs / name).chmod(0o755)
    (tmp_path / "fr3.xml").touch()
    return tmp_path


def ended(server: FrankaServer) -> bool:
    """Whether its process was started, and has ended."""
    return server._process is not None and server._process.returncode is not None


def test_a_server_that_does_not_answer_is_ended(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(franka_server, "LONGEST_START", 0.3)
    server = FrankaServer(folder)
    with pytest.raises(RuntimeError, match=r"does not answer within 0\.3 s: INFO serves"), server:
        pass
    assert ended(server)


def test_a_check_that_waits_is_no_answer(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "server" / "bin" / "franka-sim-check").write_text("#!/bin/sh\nexec /bin/sleep 60\n")
    monkeypatch.setattr(franka_server, "LONGEST_START", 0.3)
    monkeypatch.setattr(franka_server, "LONGEST_CHECK", 0.2)
    with pytest.raises(RuntimeError, match="does not answer"), FrankaServer(folder):
        pass


def test_an_interruption_while_it_starts_ends_it(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    server = FrankaServer(folder)

    def interrupt(*arguments: Any, **options: Any) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(subprocess, "run", interrupt)
        with pytest.raises(KeyboardInterrupt), server:
            pass
    assert ended(server)


def test_a_temporary_log_goes_with_the_object(folder: Path, tmp_path: Path) -> None:
    server = FrankaServer(folder)
    temporary = server.log.parent
    assert temporary.is_dir()
    del server
    gc.collect()
    assert not temporary.exists()
    FrankaServer(folder, log=tmp_path / "said.log")
    gc.collect()
    assert tmp_path.is_dir()

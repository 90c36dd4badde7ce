"""A process that is killed at any moment of writing: what it had written by then can be read, and an image is whole."""

from __future__ import annotations

import errno
import json
import os
import random
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path

import pytest
from click.testing import CliRunner
from depth import times

from fbvm.base.data import data_folder
from fbvm.cli.main import main

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")]
DEMO = str(data_folder("examples") / "demo.st")
PEER = ["--map", "192.168.250.1:502=peer"]
WITHIN_S = 60
CLIENTS_WORDS = 30_000
"""Words of D in front of those that the server's program uses itself."""


def killed(command: list[str], grown: Path, size: int) -> int:
    """Runs a command until a file has so many bytes, and kills it.  Returns the bytes that the file had then."""
    with subprocess.Popen([sys.executable, "-m", "fbvm", *command], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
        until_s = time.monotonic() + WITHIN_S
        try:
            while not grown.exists() or grown.stat().st_size < size:
                assert process.poll() is None, process.stderr and process.stderr.read()
                assert time.monotonic() < until_s, f"{grown} does not grow"
                time.sleep(0.001)
        finally:
            process.kill()
        process.wait(WITHIN_S)
    assert process.returncode == -signal.SIGKILL
    return grown.stat().st_size


@pytest.mark.parametrize("seed", range(times(2, 25)))
def test_a_run_that_writes_everything(seed: int, tmp_path: Path) -> None:
    journal, trace, capture = tmp_path / "run.jsonl", tmp_path / "run.fbt", tmp_path / "run.pcapng"
    size = random.Random(seed).randrange(1, 20_000)
    killed(["run", DEMO, *PEER, "--for", "100000000s", "--journal", str(journal), "--trace", str(trace), "--depth", "statements",
            "--pcap", str(capture)], journal, size)  # fmt: skip
    for verb in (["replay", str(journal), "--show", "D200", "--scans", "5000"],
                 ["table", str(trace), "D200", "--scans", "0..60"]):  # fmt: skip
        read = CliRunner().invoke(main, verb)
        words = "has no PLC yet", "has no scans yet", "has no beginning yet", "none of these changed", "neither a recording"
        assert read.exit_code == 0 or any(said in read.output for said in words), read.output
    content = capture.read_bytes()
    while len(content) >= 12:
        kind, length = struct.unpack_from("<II", content)
        assert kind in (0x0A0D0D0A, 1, 4, 6) and length % 4 == 0
        if length > len(content):
            break  # the block that was being written
        assert struct.unpack_from("<I", content, length - 4)[0] == length
        content = content[length:]


@pytest.mark.parametrize("seed", range(times(2, 25)))
def test_a_server_that_saves_its_memory(seed: int, tmp_path: Path) -> None:
    """Each save takes the place of the one before as a whole, so that the image of a killed server is always one of them."""
    image = tmp_path / "memory.json"
    image.write_text(json.dumps({"spaces": {"D": [7] * 32768}}), encoding="utf-8")
    chance = random.Random(seed)
    with subprocess.Popen([sys.executable, "-m", "fbvm", "serve", "--port", "0", "--image", str(image)],
                          stdout=subprocess.PIPE, text=True) as process:  # fmt: skip
        try:
            assert process.stdout
            process.stdout.readline()
            for _ in range(chance.randrange(1, 20)):
                process.send_signal(signal.SIGUSR1)
                time.sleep(chance.random() / 100)
        finally:
            process.kill()
        process.wait(WITHIN_S)
    words = json.loads(image.read_text(encoding="utf-8"))["spaces"]["D"]
    assert words[:CLIENTS_WORDS] == [7] * CLIENTS_WORDS
    assert len(words) == 32768


@pytest.mark.parametrize("verb", [["import", "../in.xml", "-o", "made"], ["new", "made"]], ids=["import", "new"])
def test_a_call_that_was_broken_off_between_two_files_is_completed_by_the_next(
    verb: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "in.st").write_text("FUNCTION_BLOCK A\nEND_FUNCTION_BLOCK\nPROGRAM Main\nVAR a : A; END_VAR\na();\nEND_PROGRAM\n")
    assert CliRunner().invoke(main, ["export", str(tmp_path / "in.st"), "-o", str(tmp_path / "in.xml")]).exit_code == 0

    def call(folder: Path, files: int) -> tuple[int, dict[Path, bytes]]:
        left = iter([True] * files)

        def killed(part: Path, target: Path) -> None:
            if not next(left, False):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            os.replace(part, target)

        monkeypatch.setattr("fbvm.base.files.replace", killed)
        folder.mkdir(exist_ok=True)
        monkeypatch.chdir(folder)
        status = CliRunner().invoke(main, verb).exit_code
        return status, {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}

    status, whole = call(tmp_path / "whole", 100)
    assert status == 0 and len(whole) > 1
    for count in range(len(whole)):
        folder = tmp_path / str(count)
        status, begun = call(folder, count)
        assert (status, len(begun)) == (2, count)
        (folder / "made").mkdir(exist_ok=True)
        (folder / "made" / ".fbvm.1.part").touch()  # of a process that was killed
        assert call(folder, 100) == (0, whole | {Path("made/.fbvm.1.part"): b""})
        assert call(folder, 100)[0] == 2
    changed = next(iter(begun))
    (folder / "other" / "made").mkdir(parents=True)
    (folder / "other" / changed).parent.mkdir(parents=True, exist_ok=True)
    (folder / "other" / changed).write_text("of the user")
    assert call(folder / "other", 100) == (2, {changed: b"of the user"})

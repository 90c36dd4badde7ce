"""What a recording says of each scan, from memory and from its file, is what an observed run said at the time: events, values,
memory, over several PLCs.

The same happens twice: to PLCs that are recorded, on each engine, and to others that are looked into all the time."""

from __future__ import annotations

import io
from contextlib import ExitStack
from pathlib import Path
from random import Random
from typing import Any

import pytest
from depth import times
from st_programs import made
from st_text import text_of
from watched_run import WatchedRun, contents

from fbvm import Etn21, LoopNetwork, Plc, compile_files, compile_text
from fbvm.code.image import Image
from fbvm.engine.native import engine as native
from fbvm.machine.plc import Mode
from fbvm.net.faults import random_faults
from fbvm.net.peers import ModbusPeer
from fbvm.record.recording.file_reader import RecordingFile
from fbvm.record.recording.file_writer import RecordingWriter
from fbvm.record.recording.recording import Recording
from fbvm.record.trace.observing import observing
from fbvm.units.port.noc import Noc
from fbvm.wire.link import Peer
from fbvm.wire.registers import server

ENGINES = ["python", *(["native"] if native.available() else [])]
SERVER, CLIENT, MASTER = "192.168.250.1", "192.168.250.21", "192.168.250.30"
ROUNDS = 40


def random_image(seed: int) -> Image | None:
    """The image of a random program; None for one that is refused."""
    return compile_text(text_of(made(seed))[0]).image


class Plant:
    """A client, a server, a program with a mailbox and a random program on one network with random faults.

    `seed` decides the program, the faults and what happens."""

    def __init__(self, seed: int, engine: str) -> None:
        self.random = Random(seed)
        self.network = LoopNetwork(seed, latency_ns=self.random.choice((0, 1_500_000)),
                                   faults=random_faults(seed, 2 * ROUNDS, longest=20))  # fmt: skip
        self.network.place(Peer("192.168.250.99", 502), ModbusPeer(server()))
        sources = {"client": "tests/bench/poll.st", "server": "examples/server.st", "master": "examples/mstr.st"}
        self.plcs = {name: Plc(_image(path), 5_000_000, engine=engine) for name, path in sources.items()}
        if alone := random_image(seed):
            self.plcs["alone"] = Plc(alone, budget=20_000, engine=engine)
        self.plcs["client"].attach(Etn21(0, CLIENT, timing=self.random.choice(("exact", "real")), seed=seed), self.network)
        self.plcs["server"].attach(Etn21(0, SERVER), self.network)
        self.plcs["master"].attach(Noc(address=MASTER), self.network)

    def run(self) -> None:
        """Rounds of scans of all PLCs, at one time those that share the network; between them something is done from outside now
        and then."""
        for _ in range(ROUNDS):
            more_ns = self.random.choice((0, 0, 0, 1_000_000))
            for name, plc in self.plcs.items():
                if self.random.random() < 0.15:
                    self.happen(plc)
                if plc.trap:
                    plc.warm_start()
                if name == "alone":
                    plc.run(scans=self.random.choice((1, 1, 30)))
                else:
                    plc.scan(plc.elapsed_ns + more_ns if plc.scans else None)

    def happen(self, plc: Plc) -> None:
        """Something is done to a PLC from outside."""
        kind = self.random.randrange(9)
        if kind < 3:
            plc.write(f"D{self.random.randrange(30, 40)}", self.random.randrange(0x10000))
        elif kind == 3:
            plc.memory.words("W")[self.random.randrange(20)] = self.random.randrange(0x10000)
        elif kind == 4:
            plc.force(f"CIO {self.random.randrange(3)}.05", self.random.random() < 0.5)
        elif kind == 5:
            plc.unforce()
        elif kind == 6:
            plc.mode = Mode.RUN if plc.mode is Mode.PROGRAM else Mode.PROGRAM
        elif kind == 7:
            plc.warm_start() if self.random.random() < 0.5 else plc.cold_start()
        elif plc.units and isinstance(unit := plc.units[0].unit, Etn21):
            unit.link_up = not unit.link_up
        else:
            plc.budget = 15_000 + self.random.randrange(5)


def _image(path: str) -> Image:
    image = compile_files([Path(path)]).image
    assert image is not None
    return image


def observed(seed: int) -> dict[str, list[tuple[Any, ...]]]:
    """What the scans of each PLC say while they happen, on the observed build."""
    plant = Plant(seed, "python")
    runs = {name: WatchedRun() for name in plant.plcs}
    with ExitStack() as stack:
        for name, plc in plant.plcs.items():
            stack.enter_context(observing(plc, runs[name]))
        plant.run()
    return {name: run.rows for name, run in runs.items()}


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("seed", range(times(2)))
def test_what_a_recording_says_of_a_scan_is_what_an_observed_run_said(seed: int, engine: str) -> None:
    plant, file = Plant(seed, engine), io.BytesIO()
    recording = Recording(file=RecordingWriter(file, verify=seed % 2 == 1))
    for name, plc in plant.plcs.items():
        recording.add(name, plc)
    plant.run()
    said = observed(seed)
    check(plant, recording, said)
    recording.close()
    file.seek(0)
    images = {name: plc.image for name, plc in plant.plcs.items()}
    written = RecordingFile(file, images=images)
    assert written.is_complete
    check(plant, written, said)
    assert [written[name].differs(row) for name in images for row in range(written[name].count)] == [None] * sum(
        written[name].count for name in images)


def check(plant: Plant, recording: Recording | RecordingFile, said: dict[str, list[tuple[Any, ...]]]) -> None:
    """What a recording says of each scan, and of one of them alone, is what was said while it happened."""
    for name, rows in said.items():
        recorded, again = recording[name], WatchedRun()
        assert recorded.scans == range(plant.plcs[name].scans)
        recorded.follow(again, recorded.scans)
        assert again.rows == rows, name
        if not rows:  # each of its scans has trapped
            continue
        number = plant.random.randrange(len(rows))
        one = WatchedRun()
        recorded.follow(one, range(rows[number][0], rows[number][0] + 1))
        assert one.rows == [rows[number]], name
        ends = {row[0]: row[-1][1] for row in rows}
        assert contents(plant.plcs[name]) == ends.get(plant.plcs[name].scans - 1, contents(plant.plcs[name]))

"""Files as fbvm 0.1 wrote them: journals, and traces of values, which are still read."""

from __future__ import annotations

from pathlib import Path

from fbvm import Depth, Etn21, Journal, LoopNetwork, ModbusPeer, Plc, TraceWriter, compile_text
from fbvm.wire.link import Peer
from fbvm.wire.registers import server


def plc_of(text: str, name: str, journal: Journal | None = None) -> Plc:
    """A PLC with an ETN21 and a server in memory."""
    image = compile_text(text, name).image
    assert image
    plc, network = Plc(image, journal=journal), LoopNetwork()
    network.place(Peer("192.168.250.1", 502), ModbusPeer(server()))
    plc.attach(Etn21(0, "192.168.250.21"), network)
    return plc


def write_old_journal(path: Path | str, text: str, name: str = "counter.st", scans: int = 4) -> None:
    """The journal of a run, with its program."""
    with Path(path).open("w", encoding="utf-8", newline="\n") as file:
        journal = Journal(file, {"program": None, "libraries": [], "sources": [[name, text]]})
        plc_of(text, name, journal).run(scans=scans)
        journal.close()


def write_old_trace(path: Path | str, text: str, name: str = "counter.st", scans: int = 4, depth: Depth = Depth.SCANS) -> None:
    """The trace of a run."""
    plc = plc_of(text, name)
    with Path(path).open("wb") as file:
        writer = TraceWriter(plc, file, depth)
        plc.run(scans=scans)
        writer.close()

"""A day of polling, recorded into a file: python tests/bench/recorded_day.py [HOURS].

tests/bench/poll.st asks a server for 10 registers every few scans of 10 ms, 8,640,000 scans in 24 hours.  Prints how long the run
takes plain and recorded, the size of the file, and how long scans anywhere in it take to be shown with every statement."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(HOUSE), str(Path(__file__).resolve().parent)]

from recorder import Listener, in_turns, row, seconds  # noqa: E402

from fbvm import Etn21, LoopNetwork, Plc, Recording, RecordingFile, RecordingWriter, compile_files  # noqa: E402
from fbvm.net.peers import ModbusPeer  # noqa: E402
from fbvm.record.recording.file_writer import Described  # noqa: E402
from fbvm.record.recording.program_text import ProgramText  # noqa: E402
from fbvm.wire.link import Peer  # noqa: E402
from fbvm.wire.registers import server  # noqa: E402

PROGRAM = Path(__file__).parent / "poll.st"
SCANS_AN_HOUR = 360_000
DAY_HOURS, ADDED_S, DAY_MB, SHOWN_MS = 24, 300, 200, 50
TURN_SCANS = 10_000
"""A plain PLC and a recorded one do so many in turn."""


def polling() -> Plc:
    image = compile_files([PROGRAM], runnable=True).image
    assert image is not None
    plc, network = Plc(image, engine="native"), LoopNetwork()
    network.place(Peer("192.168.250.1", 502), ModbusPeer(server()))
    plc.attach(Etn21(0, "192.168.250.21"), network)
    return plc


def main() -> None:
    hours = float(sys.argv[1]) if len(sys.argv) > 1 else DAY_HOURS
    scans, share = int(hours * SCANS_AN_HOUR), hours / DAY_HOURS
    polling().run(scans=1000)  # the compilation
    with tempfile.TemporaryDirectory() as folder:
        path, plc = Path(folder) / "day.fbtrace", polling()
        with path.open("wb") as file:
            recording = Recording(1, RecordingWriter(file))
            text = ProgramText(((str(PROGRAM), PROGRAM.read_text(encoding="utf-8")),))
            recording.add("client", plc, Described(text))
            plain, taken = in_turns([polling(), plc], scans, turns=max(1, scans // TURN_SCANS))
            taken += seconds(recording.close)
        row(f"{scans:,} scans, plain", f"{plain:.1f} s")
        row("added by recording it", f"{taken - plain:.1f} s", f"<= {ADDED_S * share:.3g} s")
        row("  size", f"{path.stat().st_size / 1e6:.1f} MB", f"<= {DAY_MB * share:.3g} MB")
        with RecordingFile.open(path) as opened:
            recorded = opened["client"]
            row("opened", f"{seconds(lambda: RecordingFile.open(path).close()) * 1e3:.0f} ms")
            row("the first scan shown", f"{seconds(lambda: recorded.follow(Listener(), range(1))) * 1e3:.0f} ms",
                "with compiling the program")  # fmt: skip
            took = [seconds(lambda scan=scan: recorded.follow(Listener(), range(scan, scan + 1)))
                    for scan in range(scans // 13, scans, max(1, scans // 97))]  # fmt: skip
            row("  others, anywhere, the slowest", f"{max(took) * 1e3:.1f} ms", f"<= {SHOWN_MS} ms")
            assert recorded.scans == range(scans)


if __name__ == "__main__":
    main()

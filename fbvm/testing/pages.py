"""The page of a failed test: its last scans are executed again, recorded with every statement, and written as HTML.

The modules that draw it are imported when a test has failed."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from fbvm.base.files import write_file
from fbvm.base.host import portable
from fbvm.machine.plc import Plc
from fbvm.record.trace.history import History
from fbvm.record.trace.packets import Packet
from fbvm.record.trace.reader import Trace
from fbvm.record.trace.writer import Depth, TraceWriter, descriptions, meanings, source_lines
from fbvm.testing.subject import Subject
from fbvm.watch.paths import Place

FOLDER = ".fbvm"
MOST_SCANS = 400


def page_path(root: Path, test: str) -> Path:
    """The path of the page of a test: `.fbvm/tests.test_pump.test_it_waits.html`."""
    return root / FOLDER / f"{file_name(test)}.html"


def file_name(test: str) -> str:
    """The name of a file about a test, without its suffix, which every system takes."""
    return portable(re.sub(r"[^\w\-\[\].]+", ".", re.sub(r"\.(py|st)::", ".", test))[:150])


def write_page(path: Path, title: str, history: History, subject: Subject, units: Plc, asked: Sequence[Place],
               packets: Sequence[tuple[int, Packet]] = (), unfinished: bool = False, failure: str = "") -> bool:  # fmt: skip
    """Writes the page of the scans that `history` holds; returns False if there are none.  Raises OSError.

    `units` is the PLC whose units describe addresses, `asked` are the variables that the page shows first, `packets` those
    of the network with the numbers of their scans.  `unfinished`: the last scan was interrupted, and the page shows how it
    would have ended.  `failure` is the text of the failed assertion."""
    scans = range(history.scans.start, history.scans.stop + unfinished)
    if not scans:
        return False
    from fbvm.record.page.data import frame_rows, page_data
    from fbvm.record.page.page import page

    file = io.BytesIO()

    @contextmanager
    def recorded(plc: Plc) -> Iterator[None]:
        writer = TraceWriter(plc, file, Depth.STATEMENTS, (), source_lines(plc.image, subject.texts))
        try:
            yield
        finally:
            writer.close()

    history.replay_with(range(max(scans.start, scans.stop - MOST_SCANS), scans.stop), recorded)
    trace = Trace(io.BytesIO(file.getvalue()))
    trace.described, trace.meanings = descriptions(units), meanings(units)  # the PLC of the replay has no units
    data = page_data(trace, title=title, prefix=subject.prefix, pinned=[place.name for place in asked])
    data["frames"] = frame_rows([row for row in packets if row[0] in trace.scans])
    data["failure"] = failure
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, page(data))
    return True

"""The page of a failed test: its last scans, statement by statement, as HTML.

The modules that draw it are imported when a test has failed."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from fbvm.base.files import write_file
from fbvm.base.host import portable
from fbvm.record.recording.recording import PlcRecording
from fbvm.record.recording.scans import RecordedScans
from fbvm.record.trace.writer import source_lines
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


def write_page(path: Path, title: str, recorded: PlcRecording, subject: Subject, asked: Sequence[Place],
               failure: str = "") -> bool:  # fmt: skip
    """Writes the page of the last scans that `recorded` holds; returns False if there are none.  Raises OSError.

    `asked` are the variables that the page shows first, `failure` is the text of the failed assertion.  Of a last scan that was
    interrupted the page shows how it would have ended."""
    source = RecordedScans(recorded, source_lines(recorded.plc.image, subject.texts))
    if not source.scans:
        return False
    from fbvm.record.page.data import page_data
    from fbvm.record.page.page import page

    pinned = [place.name for place in asked]
    data = page_data(source, (), source.scans[-MOST_SCANS:], title, prefix=subject.prefix, pinned=pinned)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, page(data, failure))
    return True

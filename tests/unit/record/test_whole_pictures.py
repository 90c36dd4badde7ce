"""A time chart as SVG and waveforms in other formats beside their files, word for word.  `FBVM_REWRITE=1 pytest` of this file
writes them anew; look at the picture in a browser before you keep it."""

from __future__ import annotations

import io
from itertools import pairwise
from xml.etree import ElementTree

import pytest
from test_whole_charts import check
from trace_rig import traced

from fbvm.record.draw.svg import STYLE, SvgChart, _fitting, _levels
from fbvm.record.export.vcd import write_vcd
from fbvm.record.trace.csv_writer import write_csv
from fbvm.record.trace.packets import Packet
from fbvm.record.trace.recorder import Waveforms
from fbvm.record.trace.signals import waveforms
from fbvm.wire.link import Peer

UNIT, SERVER = Peer("192.168.250.21", 1), Peer("192.168.250.1", 502)
PASSED = ((3, Packet(0, UNIT, SERVER, "asks & waits")), (3, Packet(0, SERVER, UNIT, "answers")),
          (3, Packet(0, UNIT, SERVER, "asks")), (11, Packet(0, SERVER, UNIT, "says")),
          (99, Packet(0, UNIT, SERVER, "behind the end")))  # fmt: skip
NAMES = ("CIO 0.00", "Main.Pump", "Main.Starts.CV", "Main.Mode", "Main.Delay.ET", "Main.Both[2].b", "Main.Text", "D200")


@pytest.fixture(scope="module")
def run() -> Waveforms:
    return waveforms(traced(29), NAMES)


def numbers_of(root: ElementTree.Element) -> list[str | None]:
    """The scans whose numbers stand above a chart."""
    return [row.text for row in root.iter() if row.get("class") == "dim"][2::2]


@pytest.mark.slow
def test_a_time_chart_as_svg(run: Waveforms) -> None:
    text = SvgChart(run, PASSED, "a <run>").text()
    ElementTree.fromstring(text)
    check("chart.svg", text.replace(STYLE, "").rstrip("\n").split("\n"))


@pytest.mark.slow
def test_waveforms_in_other_formats(run: Waveforms) -> None:
    late = waveforms(traced(160), ("CIO 0.00", "Main.Mode", "Main.Delay.ET", "Main.Both[2].b", "Main.Text"), range(147, 153))
    for name, waves in (("begin", run), ("late", late)):
        for ending, write in (("csv", write_csv), ("vcd", write_vcd)):
            file = io.StringIO(newline="")
            write(waves, file)
            check(f"{name}.{ending}", file.getvalue().rstrip("\n").split("\n"))


@pytest.mark.slow
def test_of_many_scans_each_is_narrow_and_of_few_none_is_too_wide(run: Waveforms) -> None:
    for scans, width, every in ((1, 158, 2), (25, 1118, 2), (26, 1118, 2), (100, 1118, 10), (300, 1118, 50), (1000, 1118, 100),
                                (2000, 1118, 200), (2001, 1118, 200), (3000, 1618, 200)):  # fmt: skip
        run_of = Waveforms([], 0, [number * 10_000_000 for number in range(scans)])
        root = ElementTree.fromstring(SvgChart(run_of).text())
        wide = float(root.get("width") or 0)
        step = min(40.0, max(0.5, 1000 / scans))
        assert wide == round(8 * 2 + 7.3 * 8 + step * scans + 8), (scans, width)
        ruled = [row for row in root.iter() if row.get("class") == "grid"]
        apart = {round(float(b.get("x1") or 0) - float(a.get("x1") or 0), 1) for a, b in pairwise(ruled)}
        assert len(apart) <= 1 and all(70 <= distance < 70 * 2.6 for distance in apart), (scans, apart)
        assert numbers_of(root) == [str(scan) for scan in range(0, scans, every)]
    late = SvgChart(Waveforms([], 17, [170_000_000 + number for number in range(30)])).text()
    assert numbers_of(ElementTree.fromstring(late)) == ["20", "25", "30", "35", "40", "45"]


def test_the_height_of_a_number_is_its_part_of_the_range() -> None:
    assert _levels([0, 5, 10]) == [0, 0.5, 1] and _levels([7, 7]) == [0, 0] and _levels(["a", 2.5, None]) == [0, 1, 0]
    assert _levels([True, -3, 1]) == [1, 0, 1]


def test_a_text_that_has_no_room_is_cut() -> None:
    assert [_fitting("Filling", room * 7.3 + 0.1) for room in (7, 6, 4, 3)] == ["Filling", "Filli…", "Fil…", ""]
    assert [_fitting("on", room * 7.3 + 0.1) for room in (3, 2, 1, 0)] == ["on", "on", "", ""]

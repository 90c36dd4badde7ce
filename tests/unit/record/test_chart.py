"""The chart and the recorder."""

from __future__ import annotations

import pytest
from images import counter_image

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.record.draw.chart import Chart, chart, draw
from fbvm.record.trace.recorder import Recorder, Signal
from fbvm.record.trace.symbols import from_data, to_data
from fbvm.watch.paths import UnknownPlace, find_place


@pytest.fixture
def plc() -> Plc:
    return Plc(counter_image())


def test_one_row_a_signal_one_column_a_scan(plc: Plc) -> None:
    assert chart(plc, scans=7, signals=["Main.done", "A200.11"]) == """
        Main.done  ....###
        A200.11    #......
    """


def test_descriptions_stand_at_the_right(plc: Plc) -> None:
    plc.write("CIO 1519.02", True)
    assert chart(plc, scans=3, signals=[("CIO 1519.02", "TCP Active Open Request Switch"), ("A200.11", "First")]) == """
        CIO1519.02  ###   TCP Active Open Request Switch
        A200.11     #..   First
    """


def test_numbers_with_room_are_shown_in_place(plc: Plc) -> None:
    recorder = Recorder(plc, ["D100"])
    for value, scans in ((0, 2), (12, 5), (513, 4)):
        plc.write("D100", value)
        plc.run(scans=scans)
    assert draw(recorder) == "D100  0 |12  |513"


def test_numbers_without_room_are_listed(plc: Plc) -> None:
    assert chart(plc, scans=4, signals=[("D200", "executions")]) == "D200  1|||4   = 1, 2, 3, 4   executions"


def test_flag_words_are_hexadecimal(plc: Plc) -> None:
    plc.write("CIO 1509", 0x8004)
    assert chart(plc, scans=6, signals=["CIO 1509"]) == "CIO1509  8004h"


def test_what_is_declared_to_be_read_in_hexadecimal_is() -> None:
    """Variables and pins, of any size, also in arrays, behind instances and in a trace; the names beside them are not."""
    made = compile_text("""
        FUNCTION_BLOCK Coded
        VAR_OUTPUT
            {attribute 'displaymode' := 'hex'}
            Error_Code : UINT := 16#81; Plain : UINT := 129;
            {ATTRIBUTE 'DisplayMode':='hexadecimal'}
            Codes : ARRAY[0..1] OF INT := [-2, 2];
            {attribute 'displaymode' := 'dec'}
            Decimal : UINT := 10;
        END_VAR
        END_FUNCTION_BLOCK
        PROGRAM Main
        VAR
            a : Coded;
            {attribute 'displaymode' := 'hex'} Byte_Code : USINT := 16#5;
        END_VAR
        END_PROGRAM""")
    assert made.image is not None and not made.errors
    names = ("a.Error_Code", "a.Plain", "a.Codes[0]", "a.Codes[1]", "a.Decimal", "Byte_Code")
    symbols = from_data(to_data(made.image.symbols))
    for found in (made.image.symbols, symbols):
        places = [find_place(found, made.image.layout.areas, f"Main.{name}") for name in names]
        texts = [Signal(place, "").text(value) for place, value in zip(places, (129, 129, -2, 2, 10, 5), strict=True)]
        assert texts == ["0081h", "129", "FFFEh", "0002h", "10", "05h"]


def test_times_are_short(plc: Plc) -> None:
    plc.run(scans=100)
    assert chart(plc, scans=1, signals=["Main.started"]) == "Main.started  1s"


def test_without_signals_what_changed_is_charted(plc: Plc) -> None:
    plc.run(scans=3)
    rows = chart(plc, scans=5).splitlines()
    assert [row.split()[0] for row in rows] == ["Main.n", "Main.done", "Main.kept", "Main.started"]


def test_a_chart_until_a_condition(plc: Plc) -> None:
    assert chart(plc, until="Main.done", signals=["Main.done"]) == "Main.done  ....#"
    with pytest.raises(AssertionError, match="D5 = 1 does not hold after 20 scans"):
        chart(plc, until="D5 = 1", signals=["D5"], max_scans=20)


def test_a_chart_equals_its_text_whatever_the_margin() -> None:
    text = Chart("A  #.\nB  .#\n")
    assert text == "\n      A  #.\n      B  .#   \n    "
    assert text != "A  #.\nB  ..\n"
    assert hash(text) == hash(Chart("  A  #.\n  B  .#"))


def test_a_long_chart_is_wrapped_with_a_ruler(plc: Plc) -> None:
    recorder = Recorder(plc, ["Main.done", "A200.11"])
    plc.run(scans=30)
    assert draw(recorder, width=11 + 20, ruler=True) == """
                   0         10
        Main.done  ....################
        A200.11    #...................

                   20
        Main.done  ##########
        A200.11    ..........
    """


def test_quiet_stretches_are_cut(plc: Plc) -> None:
    recorder = Recorder(plc, ["Main.done", "A200.11", "D100"])
    plc.run(scans=60)
    assert draw(recorder, ruler=True, compress=True) == """
                   0          55
        Main.done  ....######~#####
        A200.11    #.........~.....
        D100       0         ~
    """


def test_a_range_is_a_row_each(plc: Plc) -> None:
    assert chart(plc, scans=1, signals=["D5..D6"]) == "D5  0\nD6  0"


@pytest.mark.slow
def test_what_cannot_be_charted_is_refused(plc: Plc) -> None:
    with pytest.raises(TypeError, match="Main is Counter, which is no single value; name its members"):
        Recorder(plc, ["Main"])
    with pytest.raises(UnknownPlace):
        Recorder(plc, ["Main.missing"])
    assert plc.watchers == []


def test_a_stopped_recorder_keeps_what_it_has(plc: Plc) -> None:
    recorder = Recorder(plc, ["D200"])
    plc.run(scans=2)
    recorder.stop()
    plc.run(scans=2)
    assert (recorder.tracks[0].changes, recorder.times_ns) == ([(0, 1), (1, 2)], [0, 10_000_000])


def test_an_empty_recording_is_an_empty_chart(plc: Plc) -> None:
    assert draw(Recorder(plc, ["D200"])) == ""

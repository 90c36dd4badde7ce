"""Which scans a page shows statement by statement, and the form in which it writes values."""

from __future__ import annotations

import pytest
from trace_rig import image

from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.record.page.cells import form_of
from fbvm.record.page.windows import chosen_windows
from fbvm.record.trace.recorder import Signal
from fbvm.record.trace.symbols import from_data, to_data
from fbvm.watch.paths import Place

LATE_CHANGES = range(100, 900, 50)
FORMS = """\
TYPE Level : (Low, High); END_TYPE
PROGRAM Main
VAR
    n : INT; w AT CIO 1500 : UINT; r AT CIO 1502 : REAL; t : TIME; lt : LTIME; e : Level;
    {attribute 'displaymode' := 'hex'} code : UINT;
END_VAR
VAR CONSTANT c : INT := 5; END_VAR
VAR p : REF_TO INT; END_VAR
END_PROGRAM
"""


@pytest.fixture(scope="module")
def forms() -> Image:
    return image(FORMS)


@pytest.mark.parametrize(("scans", "room", "wanted", "changes", "windows"), [
    (range(0), 20, [], [], []),
    (range(5, 25), 20, [], [], [range(5, 25)]),
    # The end of a run and its beginning share the room.
    (range(100), 20, [], [], [range(10), range(90, 100)]),
    (range(100), 1, [], [], [range(99, 100)]),
    # Two scans on both sides of a change, as far as there are any.
    (range(1000), 40, [], [500], [range(15), range(498, 503), range(980, 1000)]),
    (range(10, 1000), 40, [], [11], [range(10, 26), range(980, 1000)]),
    (range(1000), 40, [], [980], [range(18), range(978, 1000)]),
    # Late changes come first; an eighth of the room is left for the beginning.
    (range(1000), 40, [], LATE_CHANGES,
     [range(5), range(748, 753), range(798, 803), range(848, 853), range(980, 1000)]),
    # What somebody wants to see comes before all else, up to the room that there is, and only of scans that there are.
    (range(1000), 20, [range(50, 500)], [700], [range(50, 70)]),
    (range(1000), 25, [range(10, 20), range(30, 50)], [], [range(10, 20), range(35, 50)]),
    (range(100, 1000), 30, [range(90, 110)], [], [range(100, 110), range(990, 1000)]),
])  # fmt: skip
def test_the_scans_that_are_shown_inside(
    scans: range, room: int, wanted: list[range], changes: list[int], windows: list[range]
) -> None:
    assert chosen_windows(scans, room, wanted, changes) == windows


def test_of_very_many_changes_the_latest_twenty_are_shown() -> None:
    windows = chosen_windows(range(100_000), 400, (), range(1000, 99_001, 1000))
    assert windows[0] == range(100) and windows[-1] == range(99_800, 100_000)
    assert [window.start + 2 for window in windows[1:-1]] == list(range(80_000, 99_001, 1000))


def test_the_form_of_a_number_is_that_of_its_type_and_its_area(forms: Image) -> None:
    plc = Plc(forms)

    def form(name: str, meanings: tuple[tuple[int, str], ...] = ()) -> tuple[str, dict[str, str]]:
        place = plc.find(name if name.startswith("CIO") else f"Main.{name}")
        assert isinstance(place, Place)
        found = form_of(Signal(place, "", meanings=meanings))
        return found["form"], found["texts"]

    found = {name: form(name)[0] for name in ("n", "w", "CIO 1500", "r", "t", "lt", "code")}
    assert found == {"n": "", "w": "", "CIO 1500": "hex", "r": "", "t": "time", "lt": "time", "code": "hex"}
    assert form("n") == ("", {})
    assert form("e") == ("", {"0": "Low", "1": "High"})
    assert form("CIO 1500", ((5, "waits"),)) == ("hex", {"5": "waits"})


def test_what_a_trace_keeps_of_a_symbol_is_what_the_image_says(forms: Image) -> None:
    def kept(field: object) -> list[object]:
        names = ("name", "offset", "kind", "bit", "absolute", "reference", "constant", "hexadecimal")
        return [getattr(field, name) for name in names]

    structure = forms.symbols["MAIN"].type
    again = from_data(to_data(forms.symbols))["MAIN"].type
    fields, found = structure.fields, again.fields  # type: ignore[attr-defined]
    assert {name: kept(field) for name, field in found.items()} == {name: kept(field) for name, field in fields.items()}
    assert [fields["C"].constant, fields["W"].absolute, fields["CODE"].hexadecimal] == [True] * 3

"""A recording in a file: what is read is what was recorded, up to where the file was cut; a bad file is refused in words."""

from __future__ import annotations

import io
import json
import random
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest
from trace_rig import TEXT, press
from watched_run import WatchedRun, contents

from fbvm import Etn21, LoopNetwork, Plc, compile_files, compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Phase
from fbvm.net.peers import ModbusPeer
from fbvm.record.recording import container, recording
from fbvm.record.recording.container import MAGIC, RecordingError
from fbvm.record.recording.file_reader import RecordingFile
from fbvm.record.recording.file_scans import FileScans
from fbvm.record.recording.file_writer import Described, RecordingWriter
from fbvm.record.recording.program_text import ProgramText
from fbvm.record.recording.recording import Recording
from fbvm.record.trace.signals import network_events, waveforms
from fbvm.record.trace.writer import Depth
from fbvm.wire.link import Peer
from fbvm.wire.registers import server

COUNTER = "PROGRAM Main VAR n : DINT; END_VAR n := n + 1; END_PROGRAM"


def image(text: str) -> Image:
    made = compile_text(text).image
    assert made
    return made


def text_of(text: str, **choices: object) -> Described:
    return Described(ProgramText((("text.st", text),), **choices))  # type: ignore[arg-type]


def written(text: str = TEXT, scans: int = 60, run: Callable[[Plc], object] = press, verify: bool = False,
            version: str = "") -> bytes:  # fmt: skip
    """The file of a run; `run` is called before each scan."""
    plc, file = Plc(image(text)), io.BytesIO()
    made = Recording(file=RecordingWriter(file, version, verify))
    made.add("pump", plc, text_of(text))
    for _ in range(scans):
        run(plc)
        plc.scan()
    made.close()
    return file.getvalue()


def opened(content: bytes, version: str = "") -> RecordingFile:
    return RecordingFile(io.BytesIO(content), version=version)


def nothing(plc: Plc) -> None:
    """Does nothing before a scan."""


@pytest.fixture
def small_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """A keyframe every ten scans or so."""
    monkeypatch.setattr(recording, "AGAIN_NS", 10 * recording.CALL_NS)


# --- what is read -----------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.usefixtures("small_pieces")
def test_values_are_those_of_the_run() -> None:
    plc = Plc(image(TEXT))
    ends: list[object] = []
    for _ in range(60):
        press(plc)
        plc.scan()
        ends.append((plc.read("Main.Delay.ET"), plc.read("CIO 0.00"), plc.now_ns))
    source = FileScans(opened(written())["pump"])
    found = [(moment.read("Main.Delay.ET"), moment.read("CIO 0.00"), moment.now_ns) for moment in source.moments()]
    assert found == ends
    assert [source.at(scan).read("Main.Delay.ET") for scan in (41, 3, 59)] == [ends[41][0], ends[3][0], ends[59][0]]  # type: ignore[index]


def test_what_readers_are_told_beside_the_scans() -> None:
    plc, file = Plc(image(TEXT)), io.BytesIO()
    made = Recording(file=RecordingWriter(file, "1.2"))
    lines = {"text.st": {16: "Pump := Delay.Q;"}}
    made.add("pump", plc, Described(ProgramText((("text.st", TEXT),)), lines, Depth.WRITES, ["Main.Delay"]))
    plc.run(scans=3)
    made.close()
    read = opened(file.getvalue())
    source = FileScans(read["pump"])
    assert (read.version, list(read), read.is_complete) == ("1.2", ["pump"], True)
    assert (source.depth, source.selected, source.lines) == (Depth.WRITES, ("Main.Delay",), lines)
    assert source.sites == plc.image.sites or source.sites == list(plc.image.sites)


@pytest.mark.slow
def test_several_plcs_are_in_one_file() -> None:
    file = io.BytesIO()
    made = Recording(file=RecordingWriter(file))
    plcs = {name: Plc(image(COUNTER)) for name in "abc"}
    for name, plc in plcs.items():
        made.add(name, plc, text_of(COUNTER))
    for round_ in range(30):
        for count, plc in enumerate(plcs.values()):
            plc.run(scans=count + 1 + round_ % 2)
    made.close()
    read = opened(file.getvalue())
    assert [read[name].scans for name in read] == [range(plc.scans) for plc in plcs.values()]
    for name in read:
        assert FileScans(read[name]).at(20).read("Main.n") == 21


@pytest.mark.slow
def test_a_period_without_input_costs_a_count() -> None:
    plc, file = Plc(image(COUNTER), engine="native"), io.BytesIO()
    made = Recording(file=RecordingWriter(file))
    made.add("counter", plc, text_of(COUNTER))
    plc.run(scans=1_000_000)
    made.close()
    assert len(file.getvalue()) < 40_000
    assert FileScans(opened(file.getvalue())["counter"]).at(765_432).read("Main.n") == 765_433


def test_a_scan_that_stands_at_a_breakpoint_is_there() -> None:
    plc, file = Plc(image(TEXT)), io.BytesIO()
    made = Recording(file=RecordingWriter(file))
    held = made.add("pump", plc, text_of(TEXT))
    plc.breakpoints.change("D200")
    while not plc.halted:
        press(plc)
        plc.scan()
    began = plc.scans
    made.close()
    assert held.begun == range(began + 1)
    recorded = opened(file.getvalue())["pump"]
    assert (recorded.scans, recorded.begun) == (range(began), range(began + 1))
    assert FileScans(recorded).at(began).read("D200") == 7


def test_a_run_that_went_back_has_what_it_did_then() -> None:
    plc, file = Plc(image(COUNTER)), io.BytesIO()
    made = Recording(file=RecordingWriter(file))
    made.add("counter", plc, text_of(COUNTER))
    plc.run(scans=10)
    state = plc.snapshot()
    plc.run(scans=10)
    plc.restore(state)
    plc.write("Main.n", 1000)
    plc.run(scans=3)
    made.close()
    recorded = opened(file.getvalue())["counter"]
    assert recorded.scans == range(13)
    assert [moment.read("Main.n") for moment in FileScans(recorded).moments(range(8, 13))] == [9, 10, 1001, 1002, 1003]


@pytest.mark.slow
def test_units_and_what_passed_the_network() -> None:
    made = compile_files([Path("tests/bench/poll.st")]).image
    assert made
    plc, network, file = Plc(made), LoopNetwork(3), io.BytesIO()
    network.place(Peer("192.168.250.1", 502), ModbusPeer(server()))
    plc.attach(Etn21(0, "192.168.250.21", timing="real", seed=5), network)
    held = Recording(file=RecordingWriter(file))
    recorded = held.add("client", plc, Described(ProgramText((("poll.st", Path("tests/bench/poll.st").read_text()),))))
    plc.run(scans=400)
    held.close()
    read = opened(file.getvalue())["client"]
    told, again = WatchedRun(), WatchedRun()
    recorded.follow(told, range(100, 300))
    read.follow(again, range(100, 300))
    assert told.rows == again.rows
    source = FileScans(read)
    assert len(network_events(source)) > 40
    assert source.described["CIO 1519.03"] == "Send Request Switch"


# --- files that are cut -----------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.usefixtures("small_pieces")
def test_a_file_is_good_up_to_where_it_was_cut() -> None:
    whole = written()
    ends = [moment.read("Main.Delay.ET") for moment in FileScans(opened(whole)["pump"]).moments()]
    seen = set()
    for cut in random.Random(1).sample(range(len(MAGIC), len(whole)), 60):
        try:
            read = opened(whole[:cut])
        except RecordingError as error:
            assert "no beginning yet" in str(error)
            continue
        assert not read.is_complete
        for name in read:
            found = [moment.read("Main.Delay.ET") for moment in FileScans(read[name]).moments()]
            assert found == ends[: len(found)]
            seen.add(len(found))
    assert len(seen) > 3


def test_a_file_is_read_while_it_grows() -> None:
    plc, file = Plc(image(COUNTER)), io.BytesIO()
    made = Recording(file=RecordingWriter(file))
    made.add("counter", plc, text_of(COUNTER))
    reading = io.BytesIO()

    def see() -> None:
        made.flush()
        reading.seek(0)
        reading.write(file.getvalue())

    plc.run(scans=5)
    see()
    reading.seek(0)
    read = RecordingFile(reading)
    assert FileScans(read["counter"]).at(4).read("Main.n") == 5
    plc.run(scans=5)
    see()
    read.refresh()
    assert FileScans(read["counter"]).at(9).read("Main.n") == 10
    assert not read.is_complete


# --- other versions ---------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_version_that_computes_the_same_shows_all() -> None:
    source = FileScans(opened(written(version="0.1"), version="9.9")["pump"])
    assert source.at(41).read("D200") == 7
    assert source.warning == ""


@pytest.mark.slow
@pytest.mark.parametrize("verify", [True, False])
@pytest.mark.usefixtures("small_pieces")
def test_a_version_that_computes_something_else_says_from_where_on(verify: bool) -> None:
    content = written(COUNTER, 100, nothing, verify, "0.1")
    other = image(COUNTER.replace("n + 1", "n + SEL(n = 25, DINT#1, DINT#0)"))  # scan 25 is the first that differs
    recorded = RecordingFile(io.BytesIO(content), images={"pump": other}, version="9.9")["pump"]
    source = FileScans(recorded)
    ends = [moment.read("Main.n") for moment in source.moments()]
    assert len(ends) == 100
    assert ends[:20] == list(range(1, 21))
    rows = [recorded.chunk_scans(row) for row in range(recorded.count)]
    held = next(row for row in rows if 25 in row)
    assert source.differs is not None
    assert source.differs == (25 if verify else held.stop - 1)
    assert f"from scan {source.differs} on fbvm 9.9 computes another memory than was recorded (fbvm 0.1)" in source.warning
    assert ends[held.stop - 1] == held.stop, "the keyframe behind it is what was recorded"


def test_a_program_that_is_not_had_shows_keyframes() -> None:
    plc, file = Plc(image(COUNTER)), io.BytesIO()
    made = Recording(file=RecordingWriter(file))
    made.add("counter", plc)
    for _ in range(4):
        plc.run(scans=10)
        plc.warm_start()
    made.close()
    source = FileScans(opened(file.getvalue())["counter"])
    told: list[tuple[int, Phase]] = []

    class Follower:
        def phase(self, moment: object, phase: Phase) -> None:
            told.append((moment.scans, phase))  # type: ignore[attr-defined]

        def event(self, moment: object, event: object) -> None:
            raise AssertionError("nothing is known of what happened inside")

    assert len(waveforms(source, ["Main.n"]).times_ns) == 40
    source.follow(Follower(), range(3, 5))
    assert told == [(3, Phase.REFRESH), (4, Phase.REFRESH)]
    assert source.warning.startswith("it holds no sources of the program")
    file.seek(0)
    with_image = RecordingFile(file, images={"counter": plc.image})["counter"]
    assert FileScans(with_image).at(15).read("Main.n") == 6


def test_another_program_of_that_name_is_not_executed() -> None:
    content = written(COUNTER, 5, nothing)
    other = image(COUNTER.replace("n : DINT", "n : DINT; m : LINT"))
    source = FileScans(RecordingFile(io.BytesIO(content), images={"pump": other})["pump"])
    assert [moment.read("Main.n") for moment in source.moments()] == [0] * 5
    assert "its program is another one here" in source.warning


# --- files that are bad -----------------------------------------------------------------------------------------------


def damaged(content: bytes) -> str:
    """What a reader says of a file, after looking at all of it; "" if it finds nothing wrong."""
    try:
        read = opened(content)
        for name in read:
            source = FileScans(read[name])
            for moment in source.moments():
                moment.read("D200")
            read[name].follow(WatchedRun(), range(5))
        return ""
    except RecordingError as error:
        return str(error)


def test_no_recording() -> None:
    assert damaged(b"") == damaged(b"PROGRAM Main") == "this is no recording of fbvm"
    assert damaged(MAGIC) == "the recording has no beginning yet"


@pytest.mark.slow
@pytest.mark.usefixtures("small_pieces")
def test_a_byte_that_has_changed_is_found() -> None:
    whole = written()
    for at in random.Random(2).sample(range(len(MAGIC), len(whole)), 150):
        changed = bytearray(whole)
        changed[at] ^= 1 << at % 8
        said = damaged(bytes(changed))
        assert said or len(list(opened(bytes(changed)))) <= 1, at


def blocks(content: bytes) -> list[tuple[container.BlockHead, bytes]]:
    file = io.BytesIO(content)
    file.seek(len(MAGIC))
    return [(head, container.read_block(file, head)) for head in list(container.heads(file))]


def joined(rows: list[tuple[container.BlockHead, bytes]]) -> bytes:
    file = io.BytesIO()
    file.write(MAGIC)
    for head, payload in rows:
        container.write_block(file, head.kind, payload, head.plc, head.first, head.scans)
    return file.getvalue()


def other_value(random_: random.Random, value: object) -> object:
    """Something else in the place of a value of JSON."""
    return random_.choice([None, -1, 1 << 63, 1 << 40, "x", [], {}, [[[]]], {"a": 1}, 0.5, True, value, [value], 0, 3])


def mutated(random_: random.Random, data: object) -> object:
    """The data with something else somewhere in them."""
    if isinstance(data, dict) and data and random_.random() < 0.9:
        key = random_.choice(sorted(data))
        return {**data, key: mutated(random_, data[key])}
    if isinstance(data, list) and data and random_.random() < 0.8:
        at = random_.randrange(len(data))
        return [*data[:at], mutated(random_, data[at]), *data[at + 1 :]]
    return other_value(random_, data)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.usefixtures("small_pieces")
def test_data_of_any_form_are_refused_in_words(seed: int) -> None:
    random_, whole = random.Random(seed), blocks(written())
    refused = 0
    for _ in range(40):
        rows = list(whole)
        at = random_.randrange(len(rows))
        head, payload = rows[at]
        json_end = len(payload)
        prefix, suffix = b"", b""
        if head.kind in (container.KEYFRAME, container.SCANS):
            json_end = 4 + int.from_bytes(payload[:4], "little")
            prefix, suffix = payload[:4], payload[json_end:]
        text = json.dumps(mutated(random_, json.loads(payload[len(prefix) : json_end]))).encode()
        rows[at] = head, (len(text).to_bytes(4, "little") if prefix else b"") + text + suffix
        refused += bool(damaged(joined(rows)))
    assert refused > 10


@pytest.mark.slow
def test_without_a_part_of_the_description_the_rest_is_read_or_refused_in_words() -> None:
    whole = blocks(written(scans=3))
    at, (head, payload) = next((at, row) for at, row in enumerate(whole) if row[0].kind == container.PLC)
    description = json.loads(payload)
    said = {}
    for key in description:
        less = json.dumps({name: value for name, value in description.items() if name != key}).encode()
        said[key] = damaged(joined([*whole[:at], (head, less), *whole[at + 1 :]]))
    assert {key: text for key, text in said.items() if not text.startswith("what the recording tells of a PLC is damaged")} == {
        key: "" for key in said if key in ("budget", "charts", "format", "heap", "objects", "results", "sized")}


@pytest.mark.parametrize(("key", "value", "said"), [
    ("slots", -1, "-1 bytes of slots"), ("slots", 1 << 62, f"{1 << 62} bytes of slots"), ("outer", [], "do not fit one another"),
    ("outer", [7], "do not fit one another")])  # fmt: skip
def test_a_description_that_does_not_fit_is_refused_in_words(key: str, value: object, said: str) -> None:
    whole = blocks(written(scans=1))
    at, (head, payload) = next((at, row) for at, row in enumerate(whole) if row[0].kind == container.PLC)
    changed = json.dumps({**json.loads(payload), key: value}).encode()
    assert said in damaged(joined([*whole[:at], (head, changed), *whole[at + 1 :]]))


@pytest.mark.slow
def test_blocks_that_are_much_larger_when_unpacked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(container, "LARGEST_BYTES", 1 << 22)
    whole = written(COUNTER, 5, nothing)
    head = blocks(whole)[2][0]
    packed = zlib.compress(bytes(1 << 23), 9)
    check = container._checksum(packed, head.kind, head.plc, head.first, head.scans)
    block = container._HEAD.pack(head.kind, len(packed), check, head.plc, head.first, head.scans) + packed
    assert "is too large" in damaged(whole[: head.at] + block + whole[blocks(whole)[3][0].at :])


@pytest.mark.parametrize("payload", [b"[" * 100_000, b'{"format":' * 50_000, b'{"a":' + b"9" * 5000 + b"}"])
def test_blocks_that_are_nested_deeply(payload: bytes) -> None:
    file = io.BytesIO()
    file.write(MAGIC)
    container.write_block(file, container.START, payload, 0, 0, 0)
    assert damaged(file.getvalue()).startswith("the recording's beginning is damaged")
    whole = written(COUNTER, 5, nothing)
    rows = blocks(whole)
    rows[1] = rows[1][0], payload
    assert damaged(joined(rows)).startswith("what the recording tells of a PLC is damaged")


def test_another_format_is_refused() -> None:
    rows = blocks(written(COUNTER, 5, nothing))
    rows[0] = rows[0][0], json.dumps({"format": 9, "fbvm": "7"}).encode()
    assert damaged(joined(rows)) == "a recording of format 9; this version of fbvm reads format 1"


def test_the_memory_of_a_replay_is_that_of_the_run() -> None:
    plc, file = Plc(image(TEXT)), io.BytesIO()
    made = Recording(file=RecordingWriter(file))
    made.add("pump", plc, text_of(TEXT))
    for _ in range(60):
        press(plc)
        plc.scan()
    made.close()
    assert contents(opened(file.getvalue())["pump"].at(60)) == contents(plc)


def test_only_blocks_of_scans_name_scans() -> None:
    found = [(head.kind, head.plc, head.first, head.scans) for head, _ in blocks(written(COUNTER, 5, nothing))]
    assert found == [(container.START, 0, 0, 0), (container.PLC, 0, 0, 0), (container.KEYFRAME, 0, 0, 0),
                     (container.SCANS, 0, 0, 5), (container.END, 0, 0, 0)]  # fmt: skip


def test_a_plc_of_the_past_goes_on_without_the_units_that_it_had() -> None:
    plc = Plc(image(COUNTER))
    plc.attach(Etn21(0, "192.168.250.21"), LoopNetwork())
    made = Recording()
    made.add("pump", plc)
    plc.run(scans=5)
    again = made["pump"].at(3)
    assert plc.units and not again.units
    again.run(scans=2)
    assert again.read("Main.n") == 5

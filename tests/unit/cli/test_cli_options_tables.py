"""Texts of options in tables: times, settings, maps, doors, names, banks; networks, journals and replays that they make."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import click
import pytest
from click.testing import CliRunner
from images import counter_image
from rows import each_of

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.cli.main import main
from fbvm.cli.running import replay, run
from fbvm.cli.shared import journals, networks, options, paths, sources
from fbvm.cli.shared.e_banks import e_banks_in
from fbvm.cli.shared.options import Door, Mapping, Setting
from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.net.journal import JournalError
from fbvm.net.loop import LoopNetwork
from fbvm.wire.link import Peer

# --- texts --------------------------------------------------------------------------------------------------------------


@each_of("arguments, said", [
    (("run", "--show", ""), "'--show': it is empty"), (("run", "--show=,"), "'--show': no name stands between the commas"),
    (("run", "--show", "Main.n", "--show", " "), "'--show': it is empty"), (("run", "--ladder", ""), "'--ladder': it is empty"),
    (("run", "--sfc="), "'--sfc': it is empty"), (("run", "--trace", ""), "'--trace': it is empty"),
    (("sweep", "--until", ""), "'--until': it is empty"),
    (("prove", "a.st", "--within", "a", "", "b"), "'--within': it is empty"),
    (("learn", "--folder", ""), "'--folder': it is empty"), (("import", "a.xml", "-o", " "), "'-o' / '--output': it is empty"),
    (("check", ""), "it is empty"), (("new", ""), "'NAME': it is empty"), (("map", "D0", ""), "it is empty"),
    (("run", "--nothing="), "No such option"),
])
def test_a_value_that_is_empty_is_refused_and_not_passed_over(arguments: tuple[str, ...], said: str) -> None:
    result = CliRunner().invoke(main, arguments)
    assert (result.exit_code, said in result.stderr) == (2, True), result.output


def test_a_command_line_is_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[str | None] = []
    make_parser = click.Command.make_parser
    monkeypatch.setattr(click.Command, "make_parser", lambda verb, ctx: (read.append(verb.name), make_parser(verb, ctx))[1])
    assert CliRunner().invoke(main, ["explain", "S0101"]).exit_code == 0
    assert read == ["main", "explain"]


@each_of("function, text, made", [
    ("time_ns", "5ms", 5_000_000), ("time_ns", 0, 0), ("time_ns", "0s", "0s is not a time that can pass"),
    ("time_ns", "soon", "soon"), ("moment_ns", "0s", 0), ("moment_ns", "-1ms", "-1ms is not a time that can pass"),
    ("watch_cycle_ns", "10ms", 10_000_000), ("watch_cycle_ns", "40s", 40_000_000_000),
    ("watch_cycle_ns", "9ms", "9ms is no watch cycle time: it is from 10ms to 40s"),
    ("watch_cycle_ns", "41s", "41s is no watch cycle"),
    ("setting", "a=1", Setting("a", "1", 0)), ("setting", " a.b = 1 @ 20ms", Setting("a.b", "1", 20_000_000, "20ms")),
    ("setting", "a='x@y'", Setting("a", "'x@y'", 0)), ("setting", 'a="x@y" ', Setting("a", '"x@y"', 0)),
    ("setting", "a='x'@1s", Setting("a", "'x'", 1_000_000_000, "1s")), ("setting", "a=1@-1s", "nothing is before power-on"),
    ("setting", "a=1@soon", "soon"), ("setting", "a", "'a' is not NAME=VALUE"), ("setting", "=1", "'=1' is not NAME=VALUE"),
    ("setting", "a= ", "'a= ' is not NAME=VALUE"), ("setting", "a=b=c", Setting("a", "b=c", 0)),
    ("mapping", "1.2.3.4:5=peer", Mapping(Peer("1.2.3.4", 5), None, 0)), ("mapping", "1.2.3.4:5= peer ", Mapping(
        Peer("1.2.3.4", 5), None, 0)), ("mapping", "1.2.3.4:5=host:6", Mapping(Peer("1.2.3.4", 5), "host", 6)),
    ("mapping", "1.2.3.4:5", "is not IP:PORT=HOST:PORT or IP:PORT=peer"),
    ("mapping", "1.2.3:5=peer", "'1.2.3' is no IPv4 address"),
    ("mapping", "1.2.3.256:5=peer", "is no IPv4 address"),
    ("mapping", "1.2.3.255:65535=peer", Mapping(Peer("1.2.3.255", 65535), None, 0)),
    ("mapping", "a.b.c.d:5=peer", "is no IPv4 address"), ("mapping", "1.2.3.4:65536=peer", "is not an address and a port"),
    ("mapping", "1.2.3.4=peer", "is not an address and a port"), ("mapping", ":5=peer", "is not an address and a port"),
    ("door", " 1502 ", Door(None, None, 1502)), ("door", "65536", "is not an address and a port"),
    ("door", "1.2.3.4:5=6", Door(Peer("1.2.3.4", 5), None, 6)), ("door", "1.2.3.4:5=h:6", Door(Peer("1.2.3.4", 5), "h", 6)),
    ("address", "10.0.0.1", "10.0.0.1"), ("address", "10.0.0", "--bind 10.0.0 is not an IPv4 address of this computer"),
])
def test_what_an_option_says(function: str, text: Any, made: Any) -> None:
    if isinstance(made, str) and not (function == "address" and made == text):
        with pytest.raises(click.BadParameter) as refused:
            getattr(options, function)(text)
        assert made in refused.value.message
    else:
        assert getattr(options, function)(text) == made


def test_settings_and_names_as_they_are_shown() -> None:
    assert [str(Setting("a", "1", 0)), str(Setting("a", "1", 5, "5ns"))] == ["a=1", "a=1@5ns"]
    assert options.charted_names(["a,b", "c[1,2]"]) == ["a", "b", "c[1,2]"] and options.charted_names([]) == []
    with pytest.raises(ValueError, match="--chart names nothing to draw"):
        options.charted_names(["a", ","])
    assert options._shown(cast(Any, None), cast(Any, None), ("a,b", "c")) == ("a", "b", "c")


@each_of("texts, banks", [
    (["E3_100", "e0:5 > 3"], ["E3", "E0"]), (["E3_1", "E3_2", "EA_0"], ["E3", "EA"]),
    (["aE3_1", "E3_x", "E3", "ED_1", "EF_1"], []),
    (["E C_1", "EC : 7"], ["EC"]), ([], []),
])
def test_banks_that_options_name(texts: list[str], banks: list[str]) -> None:
    assert e_banks_in(texts) == banks


# --- files --------------------------------------------------------------------------------------------------------------


@each_of("name, content, said", [
    ("a.st", b"PROGRAM Main", ""), ("a.bin", b"FBVMREC1", "a recording"),
    ("a.bin", b"\xef\xbb\xbf  <!DOCTYPE html><html>", "a page"),
    ("a.xml", b"<?xml version='1.0'?><x/>", "XML"),
    ("a.xml", b"<?xml?><project xmlns='http://www.plcopen.org/xml/tc6_0201'>", ""),
    ("a.tcpou", b"<?xml?><TcPlcObject>", ""), ("a.html", b"nothing", "a page"), ("a.htm", b"nothing", "a page"),
    ("a.XML", b"no", "XML"),
    ("a.zip", b"PK\x03\x04", "no text"), ("a.gz", b"\x1f\x8b", "no text"), ("a.pdf", b"%PDF-1.4", "no text"),
    ("a.json", b'{"journal": 1}', "a journal"), ("a.bin", b"FBVMTRC", "a trace"),
])
def test_files_that_are_no_sources(name: str, content: bytes, said: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    found = paths.foreign(path)
    assert found.startswith(f"{path} is {said} and no source of a program; ") if said else found == ""
    assert paths.foreign(tmp_path) == "" and paths.foreign(tmp_path / "none") == ""


def test_a_file_that_cannot_be_looked_into_may_be_a_source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> None:
        raise PermissionError

    path = tmp_path / "a.html"
    path.write_text("x", encoding="utf-8")
    monkeypatch.setattr(Path, "open", refused)
    assert paths.foreign(path) == ""


def test_names_that_are_like_one_that_does_not_exist(tmp_path: Path) -> None:
    for name in ("pump.st", "pumps.st", "tank.st", "other"):
        (tmp_path / name).touch()
    (tmp_path / "plant").mkdir()
    near = f"; did you mean {tmp_path / 'pump.st'} or {tmp_path / 'pumps.st'}?"
    assert paths._alike(tmp_path / "pump.sy", True) == near and paths._alike(tmp_path / "PUMP", True) == (
        f"; did you mean {tmp_path / 'pump.st'}?")
    assert paths._alike(tmp_path / "plan", False) == f"; did you mean {tmp_path / 'plant'}?"
    assert paths._alike(tmp_path / "pump.sy", False) == "" and paths._alike(tmp_path / "no" / "pump", True) == ""
    assert paths._alike(tmp_path / "nothing like it", True) == ""
    assert paths.suggestion("chek", ["check", "chart"]) == "; did you mean check?" and paths.suggestion("xyz", ["check"]) == ""
    assert paths.suggestion("CHEC", ["check", "checks", "chec"]) == "; did you mean chec or check?"


# --- diagnostics --------------------------------------------------------------------------------------------------------


@each_of("severities, last", [
    ("e", "1 error; `fbvm explain CODE` says more about each"), ("ee", "2 errors; `fbvm explain CODE` says more about each"),
    ("w", "1 warning; `fbvm explain CODE` says more about each"),
    ("eww", "1 error and 2 warnings; `fbvm explain CODE` says more about each"), ("", None),
])
def test_diagnostics_are_counted_behind_them(severities: str, last: str | None, capsys: pytest.CaptureFixture[str]) -> None:
    source = Source("a.st", "x := 1;\n")
    found = [Diagnostic("S0201" if each == "e" else "S0290", source, 0, 1, "said") for each in severities]
    sources.report_diagnostics(found, False)
    shown = capsys.readouterr()
    assert shown.out == "" and (shown.err.splitlines() or [None])[-1] == last
    assert shown.err.count("a.st:1:1: error S0201: said") == severities.count("e")
    assert shown.err.count("a.st:1:1: warning S0290: said") == severities.count("w")
    sources.report_diagnostics(found, True)
    assert capsys.readouterr().out.count('"code"') == len(severities)


def test_the_first_line_of_a_diagnostic_has_its_colour(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[tuple[str, Any]] = []
    monkeypatch.setattr(sources, "say", lambda text, **style: said.append((text.splitlines()[0], style)))
    source = Source("a.st", "x := 1;\n")
    for code in ("S0201", "S0290"):
        sources.show_diagnostic(Diagnostic(code, source, 0, 1, "said"))
    assert [style.get("fg") for _, style in said] == ["red", None, "yellow", None] and all(style["err"] for _, style in said)


# --- networks -----------------------------------------------------------------------------------------------------------


class Real:
    """Stands in for real connections."""

    made: list[Any]
    refuses = False

    def __init__(self, rows: Any, bind: str = "", door: Peer | None = None) -> None:
        self.made.append((dict(rows), bind, door))
        if any(host == "nohost" for host, _ in rows.values()):
            raise OSError(2, "Name or service not known")
        if any(host == "é" * 90 for host, _ in rows.values()):
            raise UnicodeError("label too long")

    def try_door(self, door: Peer) -> None:
        self.made.append(door)
        if Real.refuses:
            raise OSError(98, "1.2.3.4:5 cannot be used: somebody else listens there")

    def close(self) -> None:
        self.made.append("closed")


@pytest.fixture
def real(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    Real.made, Real.refuses = [], False
    monkeypatch.setattr(networks, "TcpNetwork", Real)
    return Real.made


ONE, TWO = Peer("10.0.0.1", 502), Peer("10.0.0.2", 502)


def test_a_real_network_has_rows_for_maps_and_doors(real: list[Any]) -> None:
    made = networks.build_network("tcp", (Mapping(ONE, "server", 1502),), 0, "0.0.0.0", (
        Door(TWO, None, 1503), Door(None, None, 1504)))  # fmt: skip
    assert isinstance(made, Real)
    rows = {ONE: ("server", 1502), TWO: ("0.0.0.0", 1503)}
    assert real == [({ONE: ("server", 1502)}, "", None), "closed", ({TWO: ("0.0.0.0", 1503)}, "", None), "closed",
                    (rows, "0.0.0.0", Peer("0.0.0.0", 1504)), Peer("0.0.0.0", 1504)]


@each_of("host, said", [("nohost", "nohost: Name or service not known"), ("é" * 90, f"{'é' * 90}: no name of a host")])
def test_a_host_without_an_address_ends_the_verb(host: str, said: str, real: list[Any],
capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        networks.build_network("tcp", (Mapping(ONE, host, 1502),))
    assert ended.value.code == 5 and capsys.readouterr().err == f"the network cannot be used: {said}\n"


def test_a_first_door_that_cannot_be_had_ends_the_verb(real: list[Any], capsys: pytest.CaptureFixture[str]) -> None:
    Real.refuses = True
    with pytest.raises(SystemExit) as ended:
        networks.build_network("tcp", (), 0, "127.0.0.1", (Door(None, "1.2.3.4", 5),))
    assert ended.value.code == 5 and real[-2:] == [Peer("1.2.3.4", 5), "closed"]
    assert capsys.readouterr().err == "1.2.3.4:5 cannot be used: somebody else listens there\n"


def test_in_memory_a_server_stands_at_each_mapped_endpoint() -> None:
    made = networks.build_network("loop", (Mapping(ONE, None, 0), Mapping(TWO, None, 0)), 77)
    assert isinstance(made, LoopNetwork)
    assert set(made._stations) == {ONE, TWO}
    networks.try_doors(cast(Any, None), made, (), ())


def test_doors_of_units_are_tried_and_told(monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[Any] = []
    plc = cast(Any, SimpleNamespace(units=[SimpleNamespace(unit=SimpleNamespace(address="10.0.0.1"))]))
    network = cast(Any, SimpleNamespace(try_doors=lambda named: tried.append(named) or "found",
    notices=SimpleNamespace(tell=None)))
    monkeypatch.setattr(networks, "say_doors", tried.append)
    monkeypatch.setattr(networks, "notice_teller", lambda how, known: (how, known))
    rows = (Mapping(ONE, "h", 1), Mapping(TWO, "h", 1), Mapping(Peer("10.0.0.1", 0), "h", 0))
    networks.try_doors(plc, network, rows, (Door(TWO, None, 5), Door(None, None, 6)))
    assert tried == [[ONE, TWO], "found"] and network.notices.tell == (networks.HOW_TO_MAP, "found")


@each_of("arguments, net", [([], "tcp"), (["--net", "loop"], "loop"), (["--net", "tcp"], "tcp")])
def test_a_door_is_on_the_host(arguments: list[str], net: str) -> None:
    found: list[str] = []

    @click.command()
    @options.net_option
    def verb(net: str) -> None:
        found.extend([networks.net_of(net, (Door(None, None, 1),)), networks.net_of(net, ())])

    CliRunner().invoke(verb, arguments)
    assert found == [net, arguments[1] if arguments else "loop"]


# --- journals and replays -----------------------------------------------------------------------------------------------

TEXT = "PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM"
ABOUT: dict[str, Any] = {"sources": [["a.st", TEXT]], "libraries": [], "program": None}


@pytest.mark.slow
@each_of("about, said", [
    ({}, "it holds no program; one that Python wrote is done again from Python"),
    (ABOUT | {"sources": [5]}, "it holds no program"),
    (ABOUT | {"libraries": ["/nowhere"]}, "the program needs the library folder /nowhere; say where it is now with --library"),
    (ABOUT | {"program": "Main", "banks": ["E3"], "chosen": {"dialect": "codesys"}}, ""), (ABOUT, ""),
    (ABOUT | {"chosen": 5}, "it holds no program"),
])
def test_the_program_of_a_journal(about: dict[str, Any], said: str) -> None:
    header = cast(Any, SimpleNamespace(about=about))
    if said:
        with pytest.raises(JournalError, match=said):
            journals.program_of(header, (), False)
        return
    image = journals.program_of(header, (), False)
    assert [body.name for body in image.bodies] == ["Main"] and list(image.layout.e_banks) == about.get("banks", [])


def test_a_journal_whose_program_has_errors_ends_the_verb(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    header = cast(Any, SimpleNamespace(about=ABOUT | {"sources": [["a.st", TEXT.replace("n + 1", "m")]]}))
    with pytest.raises(SystemExit) as ended:
        journals.program_of(header, (tmp_path,), False)
    assert ended.value.code == 3 and "S0201" in capsys.readouterr().err


@pytest.mark.slow
@each_of("ended, trap, until, differs, complete, quiet, reason, said, err", [
    ("end", None, None, None, True, False, "end", "3 scans were done again: the memory is what was recorded\n", ""),
    ("end", None, None, None, True, True, "end", "", ""), ("end", "trap", None, None, True, False, "trap", "", ""),
    ("end", None, "Main.n > 9", None, True, False, "max", "", ""),
    ("end", None, None, 7, True, False, "end", "", "after scan 7 the memory is not what was recorded\n"),
    ("end", None, None, None, False, False, "end", "", "the recording was cut off after 3 scans\n"),
    ("scans", None, None, None, False, False, "scans", "", ""), ("until", None, "Main.n > 1", None, True, False, "until", "", ""),
])
def test_how_a_replay_ends(ended: str, trap: str | None, until: str | None, differs: int | None, complete: bool, quiet: bool,
                           reason: str, said: str, err: str) -> None:  # fmt: skip
    plc = Plc(counter_image())
    plc.run(scans=3)
    plc.trap = cast(Any, trap)
    asked_of: list[Any] = []
    repeated = cast(Any, SimpleNamespace(plc=plc, differs=differs, complete=complete,
                                         run=lambda scans, until: asked_of.append((scans, until)) or ended))
    words: dict[bool, str] = {False: "", True: ""}

    def note(text: str, err: bool = False, **style: Any) -> None:
        words[err] += f"{text}\n"

    results: list[Any] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(replay, "say", note)
        patch.setattr(replay, "RunResult", lambda *given: results.append(given) or SimpleNamespace(print=lambda: None, status=42))
        shown = ("Main.n",) if quiet else ()
        assert replay._repeat(lambda: repeated, replay.Asked(9, until, shown, (), False)) == 42
    [(of, ended_by, places, recorder, as_json, bound)] = results
    assert (of is plc, ended_by, list(places), recorder, as_json, bound) == (True, reason, list(shown), None, False, until or "")
    assert asked_of == [(9, until)] and words == {False: said, True: err}


def test_names_that_a_replayed_program_does_not_have(tmp_path: Path) -> None:
    repeated = cast(Any, SimpleNamespace(plc=Plc(counter_image())))
    with pytest.raises(click.UsageError, match="nobody"):
        replay._repeat(lambda: repeated, replay.Asked(None, None, ("Main.nobody",), (), False))
    text = tmp_path / "a.journal"
    text.write_text("no journal\n", encoding="utf-8")
    result = CliRunner().invoke(main, ["replay", str(text)])
    assert result.exit_code == 2 and "this is neither a recording of fbvm nor a journal; `fbvm run --trace FILE`" in " ".join(
        result.stderr.split())


# --- runs ---------------------------------------------------------------------------------------------------------------


def test_a_map_that_nobody_used_is_told_with_the_units(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setattr(run, "say", lambda text, **style: said.append(text))
    units = [SimpleNamespace(unit=SimpleNamespace(name=f"ETN21 {number}", address=f"10.0.0.{number}")) for number in (1, 2)]
    plc = cast(Any, SimpleNamespace(units=units))
    run._warn_unused_mappings(plc, cast(Any, SimpleNamespace(map=SimpleNamespace(unused=[ONE, TWO]))))
    run._warn_unused_mappings(plc, LoopNetwork())
    assert said == [f"--map {row}: nobody used it; ETN21 1 has 10.0.0.1, ETN21 2 has 10.0.0.2" for row in (ONE, TWO)]


@each_of("rungs, charts, drawn", [(None, None, []), ("3", None, ["3", None]), (None, "4", [None, "4"]), ("3", "4", ["3", "4"])])
def test_what_draws_is_loaded_only_where_something_is_drawn(rungs: str | None, charts: str | None, drawn: list[Any]) -> None:
    found: list[Any] = []
    with pytest.MonkeyPatch.context() as patch:
        for name in ("draw_executed_rungs", "draw_executed_charts"):
            patch.setattr(f"fbvm.cli.shared.drawings.{name}", lambda plc, scans: found.append(scans) or nullcontext())
        with run._drawn(cast(Any, None), rungs, charts):
            assert found == drawn


@each_of("virtual, epoch", [(True, 0), (False, 4711)])
def test_a_capture_begins_at_power_on_or_at_the_hosts_time(virtual: bool, epoch: int, tmp_path: Path) -> None:
    from contextlib import ExitStack

    made: list[Any] = []
    with pytest.MonkeyPatch.context() as patch, ExitStack() as stack:
        patch.setattr(run, "Capture", lambda file, began_ns, comment: made.append((began_ns, comment("x"))) or "capture")
        patch.setattr(run.loop, "epoch_ns", lambda: 4711)
        plc, network = cast(Any, SimpleNamespace(scans=7)), cast(Any, SimpleNamespace(virtual_time=virtual))
        assert run._capture(stack, tmp_path / "a.pcapng", network, plc) == cast(Any, "capture")
    assert made == [(epoch, "scan 7")]


@pytest.mark.slow
def test_a_write_is_read_for_the_type_of_its_place() -> None:
    image = compile_text("PROGRAM Main VAR t : TIME; END_VAR END_PROGRAM").image
    assert image is not None
    made = run._write(Plc(image), Setting("Main.t", "50ms", 7))
    assert (made.value, made.at_ns) == (50_000_000, 7) and "Main.t" in str(made.where)

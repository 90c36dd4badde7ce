"""`fbvm serve`: a PLC as a service on real TCP, with the server program of `examples/server.st` or a program of one's own."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Mapping, Sequence, Set
from contextlib import AbstractContextManager, ExitStack
from io import TextIOWrapper
from pathlib import Path
from types import FrameType
from typing import IO, Any

import click
from click.core import ParameterSource

from fbvm.base.data import data_folder
from fbvm.base.files import reason
from fbvm.base.host import ending_signals, handling, saving_signals
from fbvm.cli.shared import status
from fbvm.cli.shared.debug.door import DebugPort
from fbvm.cli.shared.debug.worlds import DebugSources
from fbvm.cli.shared.doors import LISTENING, notice_teller, unusable, warn_if_reachable
from fbvm.cli.shared.files import OutputError, check_outputs, growing_file, writing
from fbvm.cli.shared.fins import ENDPOINT, FinsDoor, fins_door, fins_options, say_fins, try_fins
from fbvm.cli.shared.networks import mailbox_names
from fbvm.cli.shared.options import (
    address,
    bind_option,
    check_live_installed,
    debug_option,
    live_option,
    time_ns,
    watch_cycle_option,
)
from fbvm.cli.shared.paths import SourcePath, taken_folders
from fbvm.cli.shared.run_recording import RunRecording, described, program_text, record_run, recording_file_options
from fbvm.cli.shared.sources import compile_options, compile_or_exit, source_options
from fbvm.cli.shared.terminal import named, say
from fbvm.code.compiler import compile_files
from fbvm.machine.backplane import usual_units
from fbvm.machine.plc import Plc
from fbvm.net.notices import Notice, NoticeKind
from fbvm.net.tcp import TcpNetwork
from fbvm.record.trace import memory_images
from fbvm.record.trace.requests import RequestLog
from fbvm.record.trace.source_texts import source_texts
from fbvm.record.trace.writer import Depth
from fbvm.run import loop
from fbvm.run.interactive import Control
from fbvm.run.plant import ENDLESS, units_of
from fbvm.run.running import EVENT, Running
from fbvm.step.world import Debugged
from fbvm.units.openplc.tables import COILS, DISCRETE_INPUTS, HOLDING_REGISTERS, INPUT_REGISTERS
from fbvm.units.openplc.unit import OpenPlc
from fbvm.wire.link import Peer

CYCLE_NS = 10_000_000
START_LIMIT_NS = 5_000_000_000
SHIPPED = data_folder("examples") / "server.st"
"""The server program that is shipped, among the examples."""
SERVED = {"CIO": 5801, "D": 32768}
"""Words of each area that clients can reach, fblib/omron/etn_modbus/README.md."""

RUNTIME_WORDS = {area: words for part in (*HOLDING_REGISTERS, *INPUT_REGISTERS) for area, words in ((part.area, part.count),)} | {
    area: bits // 16 for area, bits in (COILS, DISCRETE_INPUTS)}
"""Words of each area that clients of OpenPLC's server can reach."""

OWN_SETTINGS = {"sockets": "Sockets", "read_only": "Read_Only", "fn0f": "Fn0F", "full_dm": "Full_DM", "idle_ns": "Idle_Time"}
"""The options that set inputs of the shipped server program."""
FINS_SETTINGS = {"read_only"}
"""Those of them that FINS knows, too."""
RUNTIME_SETTINGS = {"sockets": "clients", "read_only": "read_only"}
"""Those that OpenPLC's server knows, and what it calls them."""
HOW_TO_MAP = "the first port of the program is the one of --port; `fbvm run --map {endpoint}=127.0.0.1:{port}` has several"


@click.command("serve")
@source_options
@click.argument("files", nargs=-1, metavar="[FILE...]", type=SourcePath(), callback=taken_folders)
@bind_option
@click.option("--port", type=click.IntRange(0, 65535), default=1502, show_default=True, help="0: any free port.")
@click.option("--sockets", type=click.IntRange(1, 8), default=1, show_default=True, help="Clients at once.")
@click.option("--backlog/--no-backlog", default=True, show_default=True,
              help="Hold callers until a socket is free, where a unit refuses them.")
@click.option("--read-only", is_flag=True, help="Refuse everything that writes.")
@click.option("--fn0f", is_flag=True, help="Serve 0F, write multiple coils, too.")
@click.option("--full-dm", is_flag=True, help="Let 10, write multiple registers, begin anywhere in D.")
@click.option("--idle", "idle_ns", type=time_ns, metavar="TIME", help="Leave a client that is silent so long (60s).")
@fins_options
@watch_cycle_option
@recording_file_options
@debug_option
@click.option("--image", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE",
              help="Memory: loaded at the start if the file is there, saved at the end and on SIGUSR1.  Words that it does not "
                   "have begin with 0; words of units are not set.")
@live_option
@click.option("--log", type=click.Path(dir_okay=False, allow_dash=True, path_type=Path), metavar="FILE",
              help="Write who asked what, a JSON object a line; - is the terminal.")
def command(
    files: tuple[Path, ...], program: str | None, libraries: tuple[Path, ...], bind: str, port: int, image: Path | None,
    log: Path | None, watch_ns: int, backlog: bool, fins: bool, fins_bind: str, fins_port: int, fins_node: int | None,
    fins_control: bool, debug_port: int | None, live: bool, trace: Path | None, journal: Path | None, verify: bool,
    **settings: int | None,
) -> None:  # fmt: skip
    """Serve the memory of a PLC by Modbus TCP until Ctrl-C or SIGTERM; with FILEs run that program instead, and let others
    reach the first port at which it waits.  A program under --dialect matiec or strucpp that waits at none is served as OpenPLC
    does: its coils are %QX, its registers %QW, %MW, %MD and %ML.  With --fins, SCADA software and libraries that speak FINS reach
    it, too.

    With --trace all that clients do is recorded; `fbvm chart`, `table`, `why` and `step` look at it, also meanwhile.

    Status 5 if the port cannot be used, 4 if a trap stopped the program, 2 if the memory could not be saved, else 0."""
    if live:
        check_live_installed()
        if debug_port is not None:
            raise click.UsageError("--live and --debug both look into scans: give one of them")
    signals = Signals()
    read_only = bool(settings["read_only"])
    door = fins_door(fins_bind, fins_port, fins_node, fins_control, read_only) if fins else None
    with ExitStack() as stack:
        stack.enter_context(signals.installed())
        allowed = FINS_SETTINGS if fins else set()
        plc, runtime = _own(files, program, libraries, allowed, settings) if files else (_shipped(settings), None)
        plc.watch_cycle.time_ns = watch_ns
        if image:
            _load(plc, image)
        network = _network(bind, port, backlog, door)
        stack.callback(network.close)
        if log:
            network.tap = RequestLog(_opened(stack, log), loop.epoch_ns(), lambda: plc.scans).tap
            plc.watchers.append(lambda _: None)  # no scans in one go: the log says in which one an answer left
        for unit in usual_units(mailbox_names(plc.image), fins=door.unit if door else None):
            plc.attach(unit, network)
        if runtime:
            plc.attach(runtime, network)
        if door:
            try_fins(network, door)
        recordings: dict[str, Any] = {"trace": trace, "journal": journal, "verify": verify}
        if live:
            reason = _start(plc, network, signals, door)
            if reason != "trap":
                _serve_page(plc, files, libraries, signals, image, recordings)
                reason = "trap" if plc.trap else reason
            saved = _save(plc, image)
        else:
            recorded = _recording(stack, plc, files, libraries, program, recordings)
            reason = _start(plc, network, signals, door)
            debugging = _debug_port(stack, plc, debug_port, files, libraries) if debug_port is not None else None
            reason, saved = _serve(plc, reason, signals, debugging, image, recorded.tick)
    if plc.trap:
        say(str(plc.trap), err=True)
    sys.exit(status.STOPPED if reason == "trap" else status.GOOD if saved else status.USAGE)


def _serve(plc: Plc, reason: str, signals: Signals, debugging: DebugPort | None, image: Path | None,
           record: Callable[[], None]) -> tuple[str, bool]:  # fmt: skip
    """Runs until a trap or a signal, and records now and then; returns the reason of the end, and False if the memory could
    not be saved."""
    saved = True
    while reason != "trap" and not signals.end:
        try:
            running = Running(plc, scans=ENDLESS, pace=EVENT)
            loop.run_all([running], record, lambda: signals.is_heard or debugging is not None and debugging.is_called)
            reason = running.reason
            if debugging and debugging.serve(lambda: [Debugged("plc", plc)], lambda: signals.is_heard):
                signals.end = True
        except OutputError:  # the log; the memory is saved nevertheless
            _save(plc, image)
            raise
        if reason or signals.is_heard:
            signals.save = False
            saved = _save(plc, image)
    return reason, saved


def _debug_port(stack: ExitStack, plc: Plc, number: int, files: tuple[Path, ...], libraries: tuple[Path, ...]) -> DebugPort:
    """Where debuggers attach; it is closed with the stack."""
    given = files or (SHIPPED,)
    paths = {str(path): path for path in given}
    port = DebugPort(number, DebugSources(paths, source_texts(plc.image, paths, libraries)))
    stack.callback(port.close)
    return port


def _shipped(settings: dict[str, int | None]) -> Plc:
    """A PLC with the server program, its settings written."""
    program = compile_files([SHIPPED], runnable=True, lint=False).image
    assert program is not None, "the server's own program compiles"
    plc = Plc(program, CYCLE_NS)
    for name, value in settings.items():
        if value is not None:
            plc.write(f"Main.Server.{OWN_SETTINGS[name]}", value)
    return plc


def _own(files: tuple[Path, ...], program: str | None, libraries: tuple[Path, ...], allowed: Set[str],
         settings: Mapping[str, int | None]) -> tuple[Plc, OpenPlc | None]:  # fmt: skip
    """A PLC with a program of the user's own, and, if it is one of OpenPLC's that has no server of its own, that of its runtime.

    Raises UsageError for options of the shipped program, but for those `allowed`."""
    image = compile_or_exit(files, program, libraries, runnable=True)
    is_served = image.layout.sized is not None and not units_of(image)
    context = click.get_current_context()
    given = {str(parameter.name): parameter.opts[0] for parameter in context.command.params if parameter.name in OWN_SETTINGS
             and context.get_parameter_source(parameter.name) is not ParameterSource.DEFAULT}  # fmt: skip
    known = allowed | RUNTIME_SETTINGS.keys() if is_served else allowed
    if wrong := [option for name, option in given.items() if name not in known]:
        raise click.UsageError(f"{', '.join(wrong)}: said to the shipped server program; your own sets what it wants itself")
    told: dict[str, Any] = {RUNTIME_SETTINGS[name]: settings[name] for name in given if name in RUNTIME_SETTINGS}
    return Plc(image, CYCLE_NS), OpenPlc(**told) if is_served else None


def _load(plc: Plc, image: Path) -> None:
    """Loads the memory, and says which words the file does not set."""
    check_outputs(image)
    if not image.exists():
        return
    try:
        left = memory_images.load(plc.memory, image)
    except OSError as error:
        raise click.UsageError(f"{named(image)} cannot be read: {reason(error)}") from None
    except memory_images.ImageError as error:
        raise click.UsageError(str(error)) from None
    for area, words in left.items():
        said = f"{area} {words[0]} to {words[-1]}" if len(words) > 1 else f"{area} {words[0]}"
        say(f"{named(image)}: {said}: not set, since these words belong to units", fg="yellow", err=True)


def _opened(stack: ExitStack, log: Path) -> IO[str]:
    with writing(log):
        if str(log) == "-":
            return sys.stdout
        return stack.enter_context(TextIOWrapper(growing_file(log, "ab"), encoding="utf-8"))


def _recording(stack: ExitStack, plc: Plc, files: tuple[Path, ...], libraries: tuple[Path, ...], program: str | None,
               paths: Mapping[str, Any]) -> RunRecording:  # fmt: skip
    """Records the PLC until `stack` is closed, if --trace or --journal asks for it."""
    options = {**paths, "selected": (), "depth": Depth.SCANS.value}
    recorded = stack.enter_context(record_run(options, {}))
    if recorded.recording:
        sources = files or (SHIPPED,)
        text = program_text(sources, libraries, program=program, **compile_options(sources))
        recorded.add(sources[0].stem, plc, described(plc, text, options, sources, libraries))
    return recorded


def _network(bind: str, port: int, backlog: bool, fins: FinsDoor | None) -> TcpNetwork:
    """The network; its first door is at `bind` and `port`.  Ends with status 5 if that cannot be used."""
    real = Peer(address(bind), port)
    warn_if_reachable(real)
    network = TcpNetwork(fins.rows if fins else None, real.host, door=real, backlog=backlog)
    try:
        network.try_door(real)
    except OSError as error:
        network.close()
        unusable(error)
    return network


def _start(plc: Plc, network: TcpNetwork, signals: Signals, fins: FinsDoor | None) -> str:
    """Runs until a unit listens, and prints where; returns the reason of the end."""
    doors: list[Notice] = []
    say_notice = notice_teller(HOW_TO_MAP)

    def tell(notice: Notice) -> None:
        if fins and notice.endpoint == ENDPOINT and notice.kind is NoticeKind.LISTENING:
            say_fins(fins, notice.real)
            return
        if notice.endpoint != ENDPOINT and notice.kind in (NoticeKind.LISTENING, NoticeKind.UNUSABLE) and not doors:
            doors.append(notice)
        elif notice.kind is not NoticeKind.LISTENING or notice.endpoint != doors[0].endpoint:
            say_notice(notice)

    network.notices.tell = tell
    reason = loop.run(plc, until=lambda _: bool(doors) or signals.end, max_ns=START_LIMIT_NS, pace=EVENT)
    if reason == "max":
        say("no unit waits for callers; the program runs all the same", fg="yellow", err=True)
    elif doors and doors[0].kind is NoticeKind.UNUSABLE:
        unusable(OSError(f"{doors[0].real} cannot be used: {doors[0].error}"))
    elif doors:
        say(f"{LISTENING}{doors[0].real}")
    return reason


def _serve_page(plc: Plc, files: Sequence[Path], libraries: Sequence[Path], signals: Signals, image: Path | None,
                recording: dict[str, Any]) -> None:  # fmt: skip
    """Runs under a page until Ctrl-C or SIGTERM."""
    from fbvm.cli.shared.live.origins import Built, BuiltOrigin, SeenPlc
    from fbvm.cli.shared.live.page import PageOptions, serve_page

    control = Control()

    def tick() -> None:
        if signals.save:
            signals.save = False
            _save(plc, image)
        if signals.end:
            control.end()

    sources = files or [SHIPPED]
    texts = source_texts(plc.image, {str(file): file for file in sources} | {file.name: file for file in sources}, libraries)
    seen = SeenPlc(plc, texts, program_text(sources, libraries, **compile_options(sources)))
    built = Built({sources[0].stem: seen}, [Running(plc, scans=ENDLESS)])
    serve_page(BuiltOrigin(built), control, PageOptions(), recording, tick)


# --- signals and images -----------------------------------------------------------------------------------------------


class Signals:
    """The signals that the process has received: `end` (SIGTERM, Ctrl-C), `save` the image (SIGUSR1, where it exists).

    They only set flags, so that no scan is interrupted."""

    def __init__(self) -> None:
        self.end = False
        self.save = False

    @property
    def is_heard(self) -> bool:
        """True if one of them has come."""
        return self.end or self.save

    def _handle(self, number: int, frame: FrameType | None) -> None:
        if number in saving_signals():
            self.save = True
        else:
            self.end = True

    def installed(self) -> AbstractContextManager[None]:
        """Installs the handlers inside a `with` block."""
        return handling((signal.SIGINT, *ending_signals(), *saving_signals()), self._handle)


def _save(plc: Plc, image: Path | None) -> bool:
    """Saves the memory, if `image` is given; says why it cannot and returns False if the host refuses."""
    if image:
        try:
            served = {area: words for area, words in RUNTIME_WORDS.items() if area in plc.memory.areas}
            memory_images.save(plc.memory, image, served or SERVED)
        except OSError as error:
            say(f"{named(image)} cannot be written: {reason(error)}", err=True)
            return False
    return True

"""The debug adapter: messages of the client in, messages to the client out; no I/O, no clock.

`receive` takes a message, `work` does a slice of what runs.  Who calls them owns the connection and the time."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from fbvm.dap.breakpoints import BreakpointRequests
from fbvm.dap.capabilities import capabilities
from fbvm.dap.console import completions, evaluate, inline_values
from fbvm.dap.framing import Message
from fbvm.dap.memory import read_memory, write_memory
from fbvm.dap.moves import Moves
from fbvm.dap.session import Arguments, Body, Container, DebugSession, Refusal, StackFrame
from fbvm.dap.shapes import check_shapes
from fbvm.dap.sources import Sources
from fbvm.dap.stack import scan_text, stack_trace, threads
from fbvm.dap.target import LaunchError, Opener
from fbvm.dap.variables import scopes, set_variable, variables
from fbvm.step.debugger import Debugger
from fbvm.step.past_session import PastSession
from fbvm.step.position import Said
from fbvm.step.session import Session
from fbvm.step.world import ReadOnlyPast
from fbvm.watch.paths import Place
from fbvm.watch.values import Value, show, show_time

Request = Callable[[Arguments], "Body | None"]
BREAKPOINTS = {"setBreakpoints": "breakpoints", "setFunctionBreakpoints": "breakpoints", "setDataBreakpoints": "breakpoints",
               "setExceptionBreakpoints": "filters"}  # fmt: skip
"""Requests that may come before anything is debugged, and the argument that lists what is asked for."""
MOST_SAID = 1000
"""Messages of log points that are passed on in one slice."""


class Adapter:
    """Debugs what `open_target` opens, for the client behind `send`."""

    def __init__(self, open_target: Opener, send: Callable[[Message], None]) -> None:
        self._open_target, self._send = open_target, send
        self._sequence = 0
        self.debug = DebugSession(self._event)
        self.breakpoints = BreakpointRequests(self.debug)
        self.moves = Moves(self.debug, self.breakpoints, self._run_ended)
        self.ended = False
        """True when the client has disconnected."""
        self.ends_target = False
        """True if the client wants what it was attached to to end, too."""
        self._is_configured = False
        self._waiting: Message | None = None
        """The request `launch` or `attach` that is answered when the configuration is done."""
        self._arguments: tuple[str, Arguments] | None = None
        self._early: list[tuple[str, Arguments, list[int]]] = []
        self._said: list[Said] = []
        self._behind: list[Callable[[], None]] = []
        """What is told behind the answer to the present request."""
        self._progress: str | None = None
        self._requests = self._table()

    def _table(self) -> dict[str, Request]:
        """The requests by their names."""
        moves, rows = self.moves, self.breakpoints
        debug = self.debug
        return {
            "initialize": self._initialize, "launch": self._launch, "attach": self._launch,
            "configurationDone": self._configuration_done, "disconnect": self._disconnect, "terminate": self._terminate,
            "restart": self._restart, "cancel": self._cancel,
            "setBreakpoints": rows.set_lines, "setFunctionBreakpoints": rows.set_functions,
            "setDataBreakpoints": rows.set_data, "setExceptionBreakpoints": rows.set_exceptions,
            "dataBreakpointInfo": rows.data_info, "breakpointLocations": rows.locations,
            "continue": moves.resume, "next": moves.next, "stepIn": moves.step_in, "stepOut": moves.step_out,
            "stepBack": moves.step_back, "reverseContinue": moves.reverse, "restartFrame": moves.restart_frame,
            "pause": self._pause,
            "fbvm/stepScan": moves.scan, "fbvm/stepBackScan": moves.scan_back, "fbvm/stepBackInto": moves.step_back_into,
            "fbvm/gotoScan": moves.go_to_scan, "fbvm/lastWrite": moves.last_write,
            "threads": lambda arguments: threads(debug), "stackTrace": partial(stack_trace, debug),
            "scopes": lambda arguments: {"scopes": scopes(debug, debug.referred(arguments.get("frameId"), StackFrame))},
            "variables": lambda arguments: {"variables": variables(debug, dict(arguments))},
            "setVariable": self._set_variable, "setExpression": self._set_expression,
            "evaluate": self._evaluate, "completions": partial(completions, debug),
            "readMemory": partial(read_memory, debug), "writeMemory": partial(write_memory, debug),
            "source": self._source, "loadedSources": lambda arguments: {"sources": debug.sources.all},
            "exceptionInfo": self._exception_info,
            "fbvm/force": self._force, "fbvm/unforce": self._unforce, "fbvm/forces": lambda arguments: self._forces(),
            "fbvm/why": partial(self._said_by, "why"), "fbvm/rung": partial(self._said_by, "rung"),
            "fbvm/inlineValues": partial(inline_values, debug),
        }  # fmt: skip

    # --- messages -----------------------------------------------------------------------------------------------------

    def receive(self, message: Message) -> None:
        """Carries out a message of the client.  Every request is answered; what cannot be done is refused with a sentence."""
        if message.get("type") != "request":
            return
        command, arguments = str(message.get("command", "")), message.get("arguments")
        request = self._requests.get(command)
        given: dict[str, Any] = arguments if isinstance(arguments, dict) else {}
        try:
            if request is None:
                raise Refusal(f"there is no request {command!r}")
            if command in ("launch", "attach"):
                self._waiting = message
            check_shapes(given)
            body = self._done(command, request, given)
        except (Refusal, LaunchError, ReadOnlyPast, ValueError, TypeError, LookupError, OverflowError) as error:
            if command in ("launch", "attach"):
                self._waiting = None
            said = f"the argument {error} is missing" if isinstance(error, KeyError) else str(error)
            self._respond(message, None, said)
            return
        if self._waiting is not message:
            self._respond(message, body)
        behind, self._behind = self._behind, []
        for tell in behind:
            tell()
        if command == "initialize":
            self._event("initialized", {})
        self._start_if_ready()
        if self.debug.moved_by_command:
            self.debug.moved_by_command = False
            self.moves.stopped("step")
        self._end_progress()

    def _done(self, command: str, request: Request, arguments: dict[str, Any]) -> Body | None:
        """The body of the answer.  Breakpoints may change while it runs; anything else about the position has to wait."""
        if command in BREAKPOINTS:
            if self.debug.debugger is None:
                answer = self.breakpoints.pending(len(arguments.get(BREAKPOINTS[command]) or arguments.get("lines") or ()))
                self._early.append((command, arguments, [row["id"] for row in answer["breakpoints"]]))
                return answer
            interrupted = self.moves.interrupted()
            try:
                return request(arguments)
            finally:
                self.moves.go_on(interrupted)
        if self.moves.running and command in NEEDS_A_STOP:
            raise Refusal("it runs; pause it first")
        return request(arguments)

    def _respond(self, request: Message, body: Body | None, error: str = "") -> None:
        answer: Message = {"type": "response", "request_seq": request.get("seq", 0), "success": not error,
                           "command": request.get("command", "")}  # fmt: skip
        if error:
            answer["message"] = error
            answer["body"] = {"error": {"id": 1, "format": error.replace("{", "(").replace("}", ")"), "showUser": False}}
        elif body:
            answer["body"] = body
        self._post(answer)

    def _event(self, name: str, body: Body) -> None:
        self._post({"type": "event", "event": name, **({"body": body} if body else {})})

    def _post(self, message: Message) -> None:
        self._sequence += 1
        self._send({"seq": self._sequence, **message})

    def _output(self, text: str, category: str = "console") -> None:
        self._event("output", {"category": category, "output": text if text.endswith("\n") else f"{text}\n"})

    # --- beginning and end --------------------------------------------------------------------------------------------

    def _initialize(self, arguments: Arguments) -> Body:
        if self.debug.client:
            raise Refusal("initialize comes once")
        self.debug.client = {"adapterID": "fbvm", **arguments}
        return capabilities()

    def _launch(self, arguments: Arguments) -> None:
        assert self._waiting is not None
        if self._arguments is not None:
            raise Refusal("something is debugged already: one launch a session")
        self._open(str(self._waiting["command"]), arguments)

    def _open(self, how: str, arguments: Arguments) -> None:
        """Opens what is debugged, and sets the breakpoints that were asked for before."""
        try:
            target = self._open_target(how, arguments)
        except LaunchError as error:
            if error.output:
                self._output(error.output, "stderr")
            raise
        self._arguments = how, arguments
        debug = self.debug
        debug.target = target
        debug.debugger = Debugger(target.sessions, self._said.append)
        sites = [site for plc in debug.debugger.plcs.values() for site in plc.session.facts.sites]
        debug.sources = Sources(target.texts, target.paths, debug.client, sites)
        for note in target.notes:
            self._output(note)
        early, self._early = self._early, []
        for command, asked, numbers in early:
            answer = self._requests[command](asked) or {}
            rows = answer.get("breakpoints", ())
            known = {row["id"]: number for row, number in zip(rows, numbers, strict=False) if "id" in row}
            self.breakpoints.keep_numbers(known)
            for row, number in zip(rows, numbers, strict=False):
                if command != "setExceptionBreakpoints":
                    self._event("breakpoint", {"reason": "changed", "breakpoint": {**row, "id": number}})

    def _configuration_done(self, arguments: Arguments) -> None:
        self._is_configured = True

    def _start_if_ready(self) -> None:
        """Answers `launch` and begins, when the configuration is done, too."""
        if not self._is_configured or self._waiting is None or self.debug.debugger is None:
            return
        waiting, self._waiting = self._waiting, None
        self._respond(waiting, None)
        self._begin(bool(waiting.get("arguments", {}).get("noDebug")))

    def _begin(self, no_debug: bool) -> None:
        debug, target = self.debug, self.debug.target
        assert target is not None
        how = "attach" if self._is_attached else "launch"
        self._event("process", {"name": ", ".join(debug.running.plcs), "startMethod": how, "isLocalProcess": True})
        if no_debug:
            self.breakpoints.clear()
        session = debug.plc()
        if isinstance(session, PastSession):
            wrong = str(session.trap) if session.trap else target.failure
            reason = "exception" if wrong else "entry"
            text = session.trap.code if session.trap else "assert" if wrong else ""
            self.moves.stopped(reason, wrong or f"the end of the recording: {scan_text(session)}", text=text)
            return
        wants_entry = target.stop_on_entry
        if wants_entry is None and self._is_attached:
            wants_entry = False
        if wants_entry is None:
            wants_entry = self.breakpoints.is_empty and target.until_scan is None and not no_debug
        warnings = [text for plc in debug.running.plcs.values() if isinstance(plc.session, Session)
                    for text in plc.session.units.warnings]  # fmt: skip
        if warnings and self.breakpoints.is_on("warning"):
            self.moves.stopped("exception", "; ".join(warnings), text="warning")
        elif wants_entry:
            self.moves.stopped("entry")
        else:
            self.moves.resume({})

    @property
    def _is_attached(self) -> bool:
        """True if something is debugged that runs elsewhere."""
        return self._arguments is not None and self._arguments[0] == "attach"

    def _restart(self, arguments: Arguments) -> None:
        """restart: opens the same again, with the same breakpoints."""
        if self._arguments is None:
            raise Refusal("nothing is debugged")
        if self._is_attached:
            raise Refusal("what runs elsewhere cannot be begun again from here")
        self.moves.interrupted()
        how, given = self._arguments
        changed = arguments.get("arguments")
        self._close()
        self._open(how, changed if isinstance(changed, dict) else given)
        self.breakpoints.renew()
        self._after(lambda: self._begin(False))

    def _close(self) -> None:
        if self.debug.target:
            self.debug.target.close()
        self.debug.target = self.debug.debugger = None
        self.debug.forget_references()

    def _disconnect(self, arguments: Arguments) -> None:
        self.moves.interrupted()
        self._close()
        self.ended, self.ends_target = True, bool(arguments.get("terminateDebuggee"))

    def _terminate(self, arguments: Arguments) -> None:
        self.moves.interrupted()
        self._after(lambda: self._event("terminated", {}))

    def _run_ended(self) -> None:
        """The run has reached its own end."""
        self._flush_said()
        self._event("exited", {"exitCode": 0})
        self._event("terminated", {})

    def close(self) -> None:
        """Ends everything: the connection is gone."""
        self._disconnect({})

    # --- running ------------------------------------------------------------------------------------------------------

    @property
    def is_running(self) -> bool:
        """True while a move is carried out."""
        return self.moves.running is not None

    def work(self) -> bool:
        """Does a slice of what runs; returns False if nothing does any more."""
        running = self.moves.work()
        self._flush_said()
        self._end_progress()
        return running

    def _end_progress(self) -> None:
        """Tells that nothing runs any more, if the client was told that something does."""
        if self._progress and not self.is_running:
            self._event("progressEnd", {"progressId": self._progress})
            self._progress = None

    def tell_progress(self) -> None:
        """Called now and then while something runs, by who has a clock."""
        if not self.is_running or not self.debug.supports("supportsProgressReporting"):
            return
        debugger = self.debug.running
        scan = debugger.here.end
        session = debugger.session
        time = show_time(scan * session.facts.cycle_ns)[2:]
        if self._progress is None:
            self._progress = f"run {self.debug.moves}"
            self._event("progressStart", {"progressId": self._progress, "title": "running", "cancellable": True,
                                          "message": f"scan {scan}, {time}"})  # fmt: skip
        else:
            self._event("progressUpdate", {"progressId": self._progress, "message": f"scan {scan}, {time}"})

    def _pause(self, arguments: Arguments) -> None:
        """pause: answered first; the stop follows."""
        interrupted = self.moves.interrupted()
        if interrupted is None:
            raise Refusal("nothing runs")
        self._after(lambda: self.moves.stopped("pause"))

    def _cancel(self, arguments: Arguments) -> None:
        """cancel: of a run by its progress; requests are answered at once, so there are none to cancel."""
        if arguments.get("progressId") == self._progress and self.moves.interrupted():
            self._after(lambda: self.moves.stopped("pause"))

    def _after(self, tell: Callable[[], None]) -> None:
        """Tells something behind the answer to the present request."""
        self._behind.append(tell)

    def _flush_said(self) -> None:
        """Passes on what log points said."""
        said, self._said[:] = self._said[:], []
        for one in said[:MOST_SAID]:
            facts = self.debug.plc(one.plc).facts
            site = facts.sites[one.site]
            text = f"scan {one.scan}, {show_time(one.now_ns)[2:]}: {one.text}\n"
            self._event("output", {"category": "console", "output": text, "source": self.debug.sources.source(site.file),
                                   "line": self.debug.sources.client_line(site.line)})  # fmt: skip
        if len(said) > MOST_SAID:
            self._output(f"... {len(said) - MOST_SAID} more")

    # --- values -------------------------------------------------------------------------------------------------------

    def _set_variable(self, arguments: Arguments) -> Body:
        container: Container = self.debug.referred(arguments.get("variablesReference"), Container)
        row = set_variable(self.debug, container.named(str(arguments["name"])), str(arguments["value"]))
        return {key: row[key] for key in row if key in ("value", "type", "variablesReference", "namedVariables",
                                                        "indexedVariables", "memoryReference")}  # fmt: skip

    def _set_expression(self, arguments: Arguments) -> Body:
        found = self.debug.scope(self.debug.frame_of(arguments)).find(str(arguments["expression"]))
        row = set_variable(self.debug, found, str(arguments["value"]))
        return {key: row[key] for key in row if key in ("value", "type", "variablesReference")}

    def _evaluate(self, arguments: Arguments) -> Body:
        return evaluate(self.debug, arguments)

    def _force(self, arguments: Arguments) -> Body:
        name, value = str(arguments["name"]), str(arguments["value"])
        found = self.debug.scope(None).find(name)
        if not isinstance(found, Place):
            raise Refusal("force one place after the other")
        self._typed(f"force {found.name} = {value}")
        return self._forces()

    def _unforce(self, arguments: Arguments) -> Body:
        self._typed(f"unforce {arguments.get('name') or ''}".strip())
        return self._forces()

    def _forces(self) -> Body:
        session = self.debug.plc()
        forces = session.plc.forces if isinstance(session, Session) else {}
        return {"forces": [{"name": name, "value": self._shown(name, value)} for name, value in forces.items()]}

    def _shown(self, name: str, value: Value) -> str:
        found = self.debug.plc().find(name)
        return show(found.type, value) if isinstance(found, Place) else str(value)

    def _typed(self, line: str) -> Body:
        result = evaluate(self.debug, {"expression": line, "context": "repl"})
        if self.debug.supports("supportsInvalidatedEvent"):
            self._event("invalidated", {"areas": ["variables"]})
        return result

    def _said_by(self, command: str, arguments: Arguments) -> Body:
        """A text that a command of the stepping language prints."""
        argument = arguments.get("name", arguments.get("number", ""))
        if command == "why":
            argument = self.debug.scope(self.debug.frame_of(arguments)).find(str(argument)).name
        return {"text": evaluate(self.debug, {"expression": f"{command} {argument}".strip(), "context": "repl"})["result"]}

    def _source(self, arguments: Arguments) -> Body:
        source = arguments.get("source") or {}
        number = source.get("sourceReference") or arguments.get("sourceReference")
        text = self.debug.sources.text(number) if isinstance(number, int) else None
        if text is None:
            name = self.debug.sources.name_of(source)
            text = self.debug.sources.texts.get(name) if name else None
        if text is None:
            raise Refusal("there is no such source")
        return {"content": text, "mimeType": "text/x-iecst"}

    def _exception_info(self, arguments: Arguments) -> Body:
        session, reached = self.debug.plc(), self.moves.exception
        if session.trap:
            trap = session.trap
            return {"exceptionId": trap.code, "description": str(trap), "breakMode": "always",
                    "details": {"message": str(trap), "typeName": trap.code,
                                "stackTrace": "\n".join(self.debug.report().calls()) or str(trap.site)}}  # fmt: skip
        failure = self.debug.target.failure if self.debug.target else ""
        if reached is None and failure:
            return {"exceptionId": "assert", "description": failure, "breakMode": "always"}
        if reached is None:
            raise Refusal("it did not stop at an exception")
        return {"exceptionId": reached.kind, "description": reached.reasons[0], "breakMode": "always"}


NEEDS_A_STOP = {"stackTrace", "scopes", "variables", "setVariable", "setExpression", "evaluate", "readMemory", "writeMemory",
                "fbvm/force", "fbvm/unforce", "fbvm/why", "fbvm/rung", "fbvm/inlineValues", "completions"}  # fmt: skip
"""Requests about the position, which has to stand."""

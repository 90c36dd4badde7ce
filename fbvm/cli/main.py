"""The command `fbvm` and its verbs.

Exit status: 0 good, 1 a check failed, 2 usage, 3 the program has errors, 4 running stopped, 5 the network could not be
used, 130 ended by Ctrl-C, 143 ended by SIGTERM, 141 nobody reads the output any more.
"""

from __future__ import annotations

import errno
import importlib
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import click

import fbvm
from fbvm.base import cache
from fbvm.base.files import reason
from fbvm.base.printable import printable
from fbvm.cli.shared import ending, status
from fbvm.cli.shared.files import OutputError
from fbvm.cli.shared.streams import give_up_output, prepare_streams
from fbvm.cli.shared.terminal import named, say

NO_THREAD = "can't start new thread"
"""What Python says if the system has no more threads for it."""
NO_MORE = "the system gives fbvm no more {} (`ulimit -a` shows its limits)"
LACKING = {errno.EMFILE: "open files", errno.ENFILE: "open files", errno.EAGAIN: "processes", errno.ENOMEM: "memory"}
"""What there is too little of, by the number of the host's error; EAGAIN is that of starting a process."""
TAKES_NO_MORE = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG)
"""Errors of the second file, where one is copied to another."""
VERB_GROUPS = {
    "running": ("Run PLCs", {
        "demo": "Fetch registers from a real Modbus TCP server and show how it went.",
        "run": "Run a program, in virtual time or over real TCP.",
        "live": "Run a program with a page in the browser, to see and to touch.",
        "step": "Step through the scans of a program, forth and back.",
        "dap": "Debug programs from an editor, forth and back.",
        "replay": "Do a run again from its journal.",
        "serve": "Serve the memory of a PLC by Modbus TCP, through its server program.",
        "map": "Print under which addresses Modbus clients find words and bits.",
        "peer": "Start a Modbus TCP server to talk to.",
    }),
    "projects": ("Projects and lessons", {
        "new": "Make a project with a block and its test.",
        "test": "Run the tests of a project.",
        "campaign": "Run a project many times under faults, and tell in which ways it fails.",
        "sweep": "Run a program once for each value of its parameters, and print the results.",
        "fleet": "Run the many equal PLCs of a project in several processes, or on a cluster.",
        "mutate": "Tell which small mistakes in a project's programs its tests would miss.",
        "learn": "Learn in sixteen lessons what a scan cycle really does.",
    }),
    "programs": ("Look at programs", {
        "check": "Say what is wrong with a program; silent when nothing is.",
        "prove": "Prove a property for all inputs and scans, or show the shortest run that breaks it.",
        "fmt": "Rewrite a program in canonical Structured Text.",
        "list": "Print the compiled program, readable.",
        "explain": "Print the page of a message, an instruction, a block or a function.",
        "ladder": "Draw the rungs of a program.",
        "sfc": "Draw the sequential function charts of a program.",
        "import": "Make sources of a project in PLCopen XML or of CX-Programmer.",
        "export": "Write programs as PLCopen XML, or into a project of CX-Programmer.",
        "diff": "Show what differs between two versions of a program.",
    }),
    "recordings": ("Look at recordings", {
        "chart": "Draw variables of a trace, a column a scan.",
        "table": "Show which statement changed variables of a trace.",
        "why": "Say why a variable has its value, back through scans.",
        "convert": "Write a trace as a page, a picture, CSV or VCD, or a CSV as a trace.",
    }),
    "editors": ("For editors", {
        "lsp": "Tell an editor about programs: mistakes, names, completion.",
    }),
}  # fmt: skip
"""The verbs by folder: heading in `fbvm --help`, and the help of each verb.  The module of a verb has the name of the verb."""
GROUP_OF = {verb: room for room, (_, verbs) in VERB_GROUPS.items() for verb in verbs}


class _Verbs(click.Group):
    """Loads the module of a verb when it is called, so that `fbvm check` starts quickly."""

    def make_context(self, *arguments: Any, **options: Any) -> click.Context:
        """Reads the arguments.  Ctrl-C ends it with status 130."""
        try:
            return super().make_context(*arguments, **options)
        except KeyboardInterrupt:
            sys.exit(status.INTERRUPTED)

    def invoke(self, ctx: click.Context) -> object:
        """Runs the verb.  Ctrl-C ends it with status 130, a reader that has gone with 141, in silence; an output that the host
        refuses with 4 for a file that grows during a run, else with 2."""
        try:
            return super().invoke(ctx)
        except click.UsageError as error:
            if (said := error.format_message()).isprintable():
                raise
            raise click.UsageError(printable(said), error.ctx) from None
        except OutputError as error:
            say(str(error), err=True)
            sys.exit(status.STOPPED)
        except BrokenPipeError:
            give_up_output()
            sys.exit(status.OUTPUT_CLOSED)
        except KeyboardInterrupt:
            sys.exit(status.INTERRUPTED)

    def main(self, *arguments: Any, **options: Any) -> Any:
        """Runs the command line and writes what is still in the buffer of the standard output.

        Signals that ask for the end do what Ctrl-C does, with a sentence and a status of their own."""
        prepare_streams()
        cache.warn_by(lambda sentence: say(sentence, err=True))
        with ending.heard():
            try:
                return self._run(*arguments, **options)
            except SystemExit as end:
                if end.code != status.INTERRUPTED:
                    raise
                with suppress(OSError):  # the terminal may have gone
                    say(ending.sentence(), err=True)
                sys.exit(ending.exit_status())

    def _run(self, *arguments: Any, **options: Any) -> Any:
        try:
            try:
                return super().main(*arguments, **options)
            finally:
                sys.stdout.flush()
        except BrokenPipeError:
            give_up_output()
            sys.exit(status.OUTPUT_CLOSED)
        except (OSError, MemoryError, RuntimeError) as error:
            if lacking := _lacking(error):
                said = NO_MORE.format(lacking)
            elif isinstance(error, OSError):
                give_up_output()
                said = _refused(error)
            else:
                raise
            if ending.by_other_than_ctrl_c():  # such as the end of its terminal, to which nothing can be written any more
                sys.exit(ending.exit_status())
            with suppress(OSError):
                say(said, err=True)
            sys.exit(status.USAGE)

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple[str | None, click.Command | None, list[str]]:
        """The verb of a command line.  Raises UsageError for an unknown one, with a suggestion."""
        name = args[0]
        if self.get_command(ctx, name) is None and not name.startswith("-") and not ctx.resilient_parsing:
            from fbvm.cli.shared.paths import suggestion

            near = suggestion(name, GROUP_OF)
            ctx.fail(f"There is no command {name!r}" + (f"; run the file by `fbvm run {name}`" if Path(name).exists() else near))
        found, command, rest = super().resolve_command(ctx, args)
        if command is not None and not ctx.resilient_parsing and any(map(_may_be_empty, rest)):
            _refuse_empty(click.Context(command, ctx, found, **command.context_settings), rest)
        return found, command, rest

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(GROUP_OF)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in GROUP_OF:
            return None
        with ending.loading():
            command: click.Command = importlib.import_module(f"fbvm.cli.{GROUP_OF[cmd_name]}.{cmd_name}").command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        for heading, verbs in VERB_GROUPS.values():
            with formatter.section(heading):
                formatter.write_dl(list(verbs.items()))


def _may_be_empty(argument: str) -> bool:
    """True if an argument may be an empty value or end with one: `""`, `--show=`, `-o " "`.  Without such an argument nothing is
    read for _refuse_empty before the verb reads its command line."""
    return not argument or argument.endswith("=") or argument[-1].isspace()


def _refuse_empty(verb: click.Context, arguments: Sequence[str]) -> None:
    """Raises BadParameter for a value that is empty, such as that of a shell's variable that is not set: no verb would see that
    something was asked for.  The arguments of other programs are theirs."""
    values, _, _ = verb.command.make_parser(verb).parse_args(list(arguments))
    for parameter in verb.command.params:
        given = values.get(parameter.name or "")
        texts = given if isinstance(given, list | tuple) else [given]
        if parameter.type is not click.UNPROCESSED and any(_is_empty(text) for text in texts):
            raise click.BadParameter("it is empty", verb, parameter)


def _is_empty(given: object) -> bool:
    return not given.strip() if isinstance(given, str) else isinstance(given, tuple) and any(map(_is_empty, given))


def _lacking(error: Exception) -> str:
    """What the system does not give to this process; "" if the error is another one."""
    if isinstance(error, OSError) and not hasattr(error, "characters_written"):  # of a stream that cannot take more now
        return LACKING.get(error.errno or 0, "")
    return "memory" if isinstance(error, MemoryError) else "threads" if str(error) == NO_THREAD else ""


def _refused(error: OSError) -> str:
    """What the host has refused to a verb that was not prepared for it."""
    if error.errno is None:  # an error of our own, which is a sentence
        return str(error)
    if error.errno == errno.ENOENT and not error.filename:
        return "the folder in which fbvm was started has gone"
    name = error.filename2 if error.errno in TAKES_NO_MORE and error.filename2 else error.filename
    return f"{named(name) + ' cannot be used' if name else 'the output cannot be written'}: {reason(error)}"


@click.group(cls=_Verbs, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(fbvm.__version__, prog_name="fbvm")
def main() -> None:
    """Runs PLC function blocks off the PLC."""

"""A program that is being edited: its files, and what is wrong with them after each change.

There are two ways to the same diagnostics.  `check` checks everything, in steps between which the caller may do something else
or give up.  `check_changes` checks again only the POUs whose texts have changed, in the project of the last `check`; it knows
when that is not enough, because a change concerns others.  Warnings come from `check` only, as they need the whole program."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from fbvm.analysis.names import Use, uses
from fbvm.analysis.parts import File, Part, common_beginning
from fbvm.base.diagnostics import Diagnostic, Source, errors
from fbvm.base.dialects import dialect as named_dialect
from fbvm.base.repeats import gathered
from fbvm.base.types import fold
from fbvm.check.calls import generics
from fbvm.check.checker import Checker
from fbvm.check.lint.linter import lint_steps
from fbvm.check.lint.suppression import ANY, Suppressions
from fbvm.check.symbols.forgetting import forget
from fbvm.check.symbols.library import Libraries, LibraryError
from fbvm.check.symbols.report import Report
from fbvm.check.symbols.size_limits import SizeLimits
from fbvm.check.symbols.symbol_table import SymbolTable
from fbvm.code.builder.evaluation import evaluate
from fbvm.code.compiler.follow_on_errors import FollowOnErrors
from fbvm.code.recursion import room
from fbvm.syntax import tree
from fbvm.syntax.st.pragmas import external

Pair = tuple[Part | None, Part | None]
"""A part before and after a change; None where there was or is none."""


@dataclass(eq=False)
class Checked:
    """The result of one `check`, kept true by `check_changes`."""

    checker: Checker
    project: SymbolTable
    collected: dict[Source, list[Diagnostic]] = field(default_factory=dict)
    """Messages about declarations by the text of the part, or of the library, that they are about."""
    found: dict[Source, list[Diagnostic]] = field(default_factory=dict)
    """Messages of the checker and the linter, of which some may only follow from a syntax error."""

    def add(self, messages: Sequence[Diagnostic], before_check: int) -> None:
        """Add messages, of which `before_check` are about declarations."""
        for table, some in ((self.collected, messages[:before_check]), (self.found, messages[before_check:])):
            for message in some:
                table.setdefault(message.source, []).append(message)

    def move(self, old: Source, new: Source) -> None:
        """Let messages whose second place is in the text of a part point into its next text."""
        same, longer = common_beginning(old.text, new.text), len(new.text) - len(old.text)
        for table in (self.collected, self.found):
            for messages in table.values():
                for number, message in enumerate(messages):
                    if message.related is not None and message.related[0] is old:
                        _, at, said = message.related
                        messages[number] = replace(message, related=(new, at + (longer if at >= same else 0), said))


@dataclass
class _WholeProgram:
    """What the texts of one revision tell together."""

    revision: int
    follow_on: FollowOnErrors = field(default_factory=FollowOnErrors)
    places: dict[int, tuple[File, Part]] = field(default_factory=dict)
    """By the `id` of a part's source."""


class Program:
    """Files that are compiled together, as their editor has them.

    libraries: folders of libraries that are looked into before the shipped ones.
    dialect: the name of the answers to what compilers disagree about.
    program, resource: what runs, as for `compile_files`.

    Raises ValueError for an unknown dialect, LibraryError for a damaged library."""

    def __init__(self, *, libraries: Sequence[Path] = (), dialect: str = "standard", program: str | None = None,
                 resource: str | None = None) -> None:
        self.dialect = named_dialect(dialect)
        self.files: dict[str, File] = {}
        self.checked: Checked | None = None
        """What is known about the texts; None before the first `check`."""
        self._libraries = tuple(libraries)
        self._searched()
        self._program, self._resource = program, resource
        self._changes: list[Pair] = []
        self._whole = True
        """Whether the changes since the last `check` need another one for the errors."""
        self.revision = 0
        """Counts changes of texts and of what is known about them."""
        self._outdated: list[SymbolTable] = []
        """What earlier checks knew, to be freed."""
        self._known: _WholeProgram | None = None
        self._uses: dict[Part, list[Use]] = {}
        """Names by part.  Keys outlive a check that changes nothing that others see."""

    def _searched(self) -> Libraries:
        return Libraries(self._libraries, preferred=self.dialect.libraries)

    def copied(self) -> Program:
        """Another program with the same files and settings, to try a change in."""
        other = Program(libraries=self._libraries, dialect=self.dialect.name, program=self._program, resource=self._resource)
        for name, file in self.files.items():
            other.files[name] = file.copied()
        return other

    # --- texts ------------------------------------------------------------------------------------------------------

    def replace(self, name: str, text: str) -> bool:
        """Give a file another text, or add it.  Returns False if it has that text already."""
        file = self.files.get(name)
        if file is not None and file.text == text:
            return False
        self.revision += 1
        if file is None:
            self.files[name] = File(name, text)
            self._whole = True
        else:
            pairs = file.replace(text)
            self._changes = [pair for pair in self._changes if pair[1] not in {old for old, _ in pairs}] + [
                (self._before(old), new) for old, new in pairs]
        return True

    def _before(self, old: Part | None) -> Part | None:
        """The part that the last check knew, of one that has changed again since then."""
        return next((first for first, then in self._changes if then is old and old is not None), old)

    def remove(self, name: str) -> None:
        """Forget a file."""
        if self.files.pop(name, None) is not None:
            self.revision += 1
            self._whole = True

    def parts(self) -> Iterator[Part]:
        """All parts of all files."""
        for file in self.files.values():
            yield from file.parts

    # --- checks -----------------------------------------------------------------------------------------------------

    @property
    def is_current(self) -> bool:
        """True if errors and facts are those of the present texts; warnings may be missing."""
        return self.checked is not None and not self._changes and not self._whole

    def check(self, lint: bool = True) -> Generator[None, None, None]:
        """Check everything, in steps.  A caller that gives up closes the iterator: the program then knows what it knew before.

        Call `release` when there is time for it behind the last step."""
        self.release()
        changes, self._changes = self._changes, []
        before, self._whole = (self._whole, changes), False
        try:
            yield from _deep(self._check(lint))
            if before[0] or changes:
                self._uses.clear()
        except GeneratorExit:
            self._whole, self._changes = before[0] or self._whole, [*before[1], *self._changes]
            raise

    def _check(self, lint: bool) -> Iterator[None]:
        report = Report()
        project = SymbolTable(self._searched(), report, self.dialect)
        parts = list(self.parts())
        for part in parts:
            if "_parsed" not in vars(part):
                yield
                _ = part.syntax
        for file in self.files.values():
            file.share_usings()
        for part in parts:
            project.collect(part.syntax, part.source)
        before_check = len(report.diagnostics)
        checker = Checker(project, evaluate)
        yield from checker.steps(self._program, self._resource)
        if lint and not errors(report.diagnostics) and not any(errors(part.mistakes) for part in parts):
            yield from lint_steps(checker, self._program)
        checked = Checked(checker, project)
        checked.add(report.diagnostics, before_check)
        old, self.checked = self.checked, checked
        self.revision += 1
        if old is not None:
            self._outdated.append(old.project)

    def release(self) -> None:
        """Free what earlier checks knew, which takes tenths of a second after many changes of a large program."""
        while self._outdated:
            self._outdated.pop().let_go()

    def check_all(self) -> None:
        """Check everything at once."""
        for _ in self.check():
            pass
        self.release()

    def check_changes(self) -> bool:
        """Check again the POUs that have changed since the last check.  Returns False, and does nothing, if the changes
        concern other declarations, too: then `check` is needed."""
        checked = self.checked
        if checked is None or self._whole or checked.project.config_sections:
            return False
        if not all(self._is_local(checked, *pair) for pair in self._changes):
            return False
        for old, new in self._changes:
            assert old is not None and new is not None
            self._uses.pop(old, None)
            with room():
                self._check_pou(checked, old, new)
        self._changes = []
        self.revision += 1
        return True

    def _is_local(self, checked: Checked, old: Part | None, new: Part | None) -> bool:
        """True for a change of a POU that others do not notice."""
        if old is None or new is None:
            return False
        before, after = old.pou, new.pou
        if before is None or after is None or self._signature(old, before) != self._signature(new, after):
            return False
        if self.dialect.bits_of_words and _names_bits_of_words(old) != _names_bits_of_words(new):
            return False  # what %IX means everywhere
        known = checked.project.pous.get(("", fold(after.name.text)))
        if _is_object(before) or _is_object(after) or any(pou.base is known for pou in checked.project.pous.values()):
            return False  # what derived blocks inherit, and which bodies calls may mean, is worked out for all
        return known is not None and known.source.whole is old.source and not generics.is_generic(known, checked.project) and \
            known.template is None and \
            not generics.variables(after) and not external(new.syntax, after)

    def _signature(self, part: Part, pou: tree.Pou) -> object:
        """What others see of a POU."""
        text = part.source.text
        hidden = ("VAR_TEMP",) if pou.kind == "PROGRAM" or self.dialect.locals_are_read else ("VAR", "VAR_TEMP")
        sections = tuple(text[section.start:section.end] for section in pou.sections
                         if section.kind not in hidden and not section.hidden)
        actions = [fold(action.name.text) for action in _actions(part)]
        result = text[pou.result.start:pou.result.end] if pou.result is not None else ""
        lost = any(not mistake.lossless for mistake in errors(part.mistakes) if _in_head(pou, mistake.start))
        usings = tuple(name.text for using in pou.usings for name in using.names)
        return pou.kind, fold(pou.name.text), result, sections, actions, usings, len(pou.refused), lost

    def _check_pou(self, checked: Checked, old: Part, new: Part) -> None:
        """Check one POU, whose signature has not changed, in place of what it was."""
        project, checker, report = checked.project, checked.checker, Report()
        former = project.pous.pop(("", fold(_name(old))))
        bodies = {former, *former.actions.values()}
        checker.bodies[:] = [pou for pou in checker.bodies if pou not in bodies]
        checker.global_order[:] = [variable for variable in checker.global_order if variable.owner is not former]
        project.report = checker.report = report
        project.size_limits = SizeLimits(report, project.dialect.large_memory)
        new.source.surroundings = old.source.surroundings
        project.collect(new.syntax, new.source)
        before_check = len(report.diagnostics)
        project.new_pous.clear()
        forget(project.facts, former, old.syntax)
        made, starts = project.pous["", fold(_name(new))], len(project.facts.starts)
        checker.check_body(made)
        checker.check_starts(starts)
        checked.collected.pop(old.source, None)
        checked.found.pop(old.source, None)
        checked.move(old.source, new.source)
        checked.add(report.diagnostics, before_check)

    # --- names ------------------------------------------------------------------------------------------------------

    def uses(self, part: Part) -> list[Use]:
        """The names in a part and what they mean, with places in the part; nothing before the first check."""
        known = self._uses.get(part)
        if known is None:
            with room():
                known = uses(self.checked.checker, part) if self.checked is not None else []
            if self.is_current:
                self._uses[part] = known
        return known

    def place(self, source: Source) -> tuple[File, int] | None:
        """The file of a part's text and where that begins in it; None for the text of a library."""
        found = self._whole_program().places.get(id(source.whole))
        return (found[0], found[1].base) if found is not None else None

    # --- diagnostics ------------------------------------------------------------------------------------------------

    def diagnostics(self, name: str) -> list[Diagnostic]:
        """What is wrong with a file, with places in its whole text, in their order."""
        file = self.files[name]
        suppressions, wrong = Suppressions(), []
        for part in file.parts:
            wrong += [_moved(each, file, part.base) for each in part.mistakes]
            shifted = tuple(tree.Pragma(p.start + part.base, p.end + part.base, p.text) for p in part.syntax.pragmas)
            wrong += suppressions.add(file.source, tree.SourceText(0, 0, (), shifted), self.dialect)
        follow_on = self._whole_program().follow_on
        checked = self.checked
        for part in file.parts if checked is not None else ():
            assert checked is not None
            kept = [each for each in checked.found.get(part.source, ()) if not follow_on.has(each)]
            wrong += [self._related(_moved(each, file, part.base)) for each in [*checked.collected.get(part.source, ()), *kept]]
        return gathered(sorted(suppressions.apply(wrong, ANY), key=Diagnostic.order))

    def _whole_program(self) -> _WholeProgram:
        """What all files tell together, which is asked for each of them."""
        if self._known is None or self._known.revision != self.revision:
            self._known = known = _WholeProgram(self.revision)
            for file in self.files.values():
                for part in file.parts:
                    known.places[id(part.source)] = file, part
                    if part.mistakes:
                        known.follow_on.add(part.source, part.syntax, errors(part.mistakes))
        return self._known

    def _related(self, message: Diagnostic) -> Diagnostic:
        """The message with the place of its second part in the whole text of a file."""
        if message.related is None:
            return message
        source, at, said = message.related
        found = self.place(source)
        return replace(message, related=(found[0].source, at + found[1], said)) if found else message

    def library_errors(self) -> list[Diagnostic]:
        """Errors of the libraries' own files."""
        tables = (self.checked.collected, self.checked.found) if self.checked is not None else ()
        return [each for table in tables for source, messages in table.items() if source.library for each in messages]


def _moved(message: Diagnostic, file: File, base: int) -> Diagnostic:
    """A message of a part as one of the whole text; a second place in the same part goes along."""
    related = message.related
    if related is not None and related[0] is message.source:
        related = file.source, related[1] + base, related[2]
    return replace(message, source=file.source, start=message.start + base, end=message.end + base, related=related)


def _is_object(pou: tree.Pou) -> bool:
    """True for what has methods, or extends or implements something."""
    return bool(pou.methods or pou.bases or pou.interfaces or pou.kind in ("CLASS", "INTERFACE"))


def _name(part: Part) -> str:
    assert part.pou is not None
    return part.pou.name.text


def _actions(part: Part) -> Iterator[tree.Action]:
    """The actions of a part in and behind its POU."""
    for declared in part.syntax.declarations:
        if isinstance(declared, tree.Pou | tree.Actions):
            yield from declared.actions
        elif isinstance(declared, tree.Action):
            yield declared


def _in_head(pou: tree.Pou, at: int) -> bool:
    """True if a place lies in front of the end of the last section of variables."""
    return at < max((section.end for section in pou.sections), default=pou.name.end)


def _deep(steps: Iterator[None]) -> Iterator[None]:
    """The steps, each with the recursion that it needs."""
    while True:
        with room():
            try:
                next(steps)
            except StopIteration:
                return
        yield


__all__ = ["LibraryError", "Program"]


def _names_bits_of_words(part: Part) -> bool:
    return any(form.switch == "bits_of_words" for form in part.syntax.forms)

"""NAMESPACE and USING: what a name may mean where it stands (IEC 61131-3 ed. 3, 6.9, tables 64 to 66).

A name is looked up in the namespace around it, then in the one around that, and so on; at each level the namespace's own
declarations come first, then those that a USING of that level brings.  Two of these under one name are ambiguous."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from fbvm.base.diagnostics import Source
from fbvm.base.namespaces import Surroundings
from fbvm.base.types import fold
from fbvm.syntax import tree


def full_name(name: str, source: Source) -> str:
    """The name of a declaration with its namespace in front."""
    space = source.surroundings.space if source.surroundings is not None else ""
    return f"{space}.{name}" if space else name


@dataclass
class Namespaces:
    """The namespaces of a program."""

    declared: dict[str, str] = field(default_factory=dict)
    """Full names of namespaces by their folded names."""
    usings: list[tuple[tree.NamedType, Source]] = field(default_factory=list)
    """Each name behind a USING, and where it is looked up."""
    _internal: set[str] = field(default_factory=set)

    def declare(self, node: tree.Namespace, source: Source) -> Source:
        """Add a NAMESPACE; returns the source for what stands in it."""
        made = self.inside(node, source)
        inner = made.surroundings
        assert inner is not None
        for level in inner.levels():
            if level is source.surroundings:
                break  # what is around it is declared
            if level.space:
                self.declared.setdefault(fold(level.space), level.space)
        if any(word.text == "INTERNAL" for word in node.modifiers):
            self._internal.add(fold(inner.space))
        self.usings += [(name, made) for using in node.usings for name in using.names]
        return made

    def used_by(self, pou: tree.Pou, source: Source) -> Source:
        """The source for a POU that may have USINGs of its own."""
        if not pou.usings:
            return source
        outer = source.surroundings or Surroundings()
        self.usings += [(name, source) for using in pou.usings for name in using.names]
        return source.inside(Surroundings(outer.space, self.names_used(pou.usings), outer))

    def used_in(self, text: tree.SourceText, source: Source) -> None:
        """Take the USINGs of a whole text."""
        usings = tuple(each for each in text.declarations if isinstance(each, tree.Using))
        self.usings += [(name, source) for using in usings for name in using.names]
        if usings:
            source.surroundings = Surroundings("", self.names_used(usings))

    @classmethod
    def inside(cls, node: tree.Namespace, source: Source) -> Source:
        """The source for what stands in a NAMESPACE."""
        return source.inside((source.surroundings or Surroundings()).within(node.name.text, cls.names_used(node.usings)))

    @classmethod
    def each(cls, declarations: Iterable[tree.Declaration], source: Source) -> Iterator[tuple[tree.Declaration, Source]]:
        """Declarations and those in their NAMESPACEs, each with the source in which its names are looked up."""
        for declaration in declarations:
            if isinstance(declaration, tree.Namespace):
                yield from cls.each(declaration.declarations, cls.inside(declaration, source))
            elif not isinstance(declaration, tree.Using):
                yield declaration, source

    @staticmethod
    def names_used(usings: tuple[tree.Using, ...]) -> tuple[str, ...]:
        """The names behind some USINGs."""
        return tuple(name.text for using in usings for name in using.names)

    def space(self, name: str, source: Source) -> str | None:
        """The folded full name of the namespace that a name means in `source`; None if it means none."""
        folded = fold(name)
        for level in (source.surroundings or Surroundings()).levels():
            full = f"{fold(level.space)}.{folded}".lstrip(".")
            if full in self.declared:
                return full
        return None

    def candidates(self, folded: str, source: Source) -> Iterator[list[str]]:
        """Folded full names that a name may mean in `source`, in groups: the first group with a declaration counts."""
        for level in (source.surroundings or Surroundings()).levels():
            yield [f"{fold(level.space)}.{folded}".lstrip(".")]
            if level.usings and "." not in folded:
                spaces = [self.space(using, source) for using in level.usings]
                yield [f"{space}.{folded}" for space in dict.fromkeys(spaces) if space is not None]

    def keeps(self, full: str, internal: bool, source: Source) -> str | None:
        """The full name of what keeps a declaration to itself though `source` names it: a namespace.  None if nothing does.

        full: the folded full name of the declaration.  internal: whether that itself is INTERNAL."""
        inside = f"{fold(source.surroundings.space)}." if source.surroundings is not None else "."
        around = full.rpartition(".")[0]
        if internal and around and not inside.startswith(f"{around}."):
            return self.declared[around]
        while around:
            outer = around.rpartition(".")[0]
            if around in self._internal and outer and not inside.startswith(f"{outer}."):
                return self.declared[outer]
            around = outer
        return None

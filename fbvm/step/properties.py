"""Values of properties: the GET accessor is executed on a copy of the memory, so that the program does not notice."""

from __future__ import annotations

from dataclasses import dataclass, replace

from fbvm.base.areas import BUDGET
from fbvm.base.memory import Memory
from fbvm.base.types import RefType, StructType, fold
from fbvm.code.image import Image, ProgramRun, TaskRow
from fbvm.code.operations import CALLS
from fbvm.code.shapes import statements
from fbvm.engine.python.engine import PythonEngine
from fbvm.machine.plc import STEP_BUDGET
from fbvm.machine.source_lines import pou_of_member
from fbvm.step.facts import ProgramFacts
from fbvm.watch.paths import Place, UnknownPlace, find_place
from fbvm.watch.places import dereferenced, read_found
from fbvm.watch.scopes import Scope
from fbvm.watch.values import Value

GET = ".Get"


@dataclass(frozen=True)
class PropertyValue:
    """A property as `place`, which has its path and type, and the value that it has now."""

    place: Place
    value: Value
    instance: str = ""
    """Path of the instance for which a reference, a pointer or an interface stands."""


class Properties:
    """Reads the properties of the instances of a program."""

    def __init__(self, facts: ProgramFacts) -> None:
        self._facts = facts
        self._bodies = {fold(body.name): number for number, body in enumerate(facts.image.bodies)}
        self._images: dict[tuple[int, int], Image] = {}
        """Programs that execute one accessor of one instance only."""

    def of(self, kind: StructType) -> list[str]:
        """The names of the properties that instances of a block have, inherited ones among them."""
        own = [name for body in self._facts.image.bodies if body.kind == "GET"
               for pou, _, name in [body.name.removesuffix(GET).rpartition(".")] if fold(pou) == fold(kind.name)]  # fmt: skip
        return list(dict.fromkeys([*own, *(name for parent in kind.parents for name in self.of(parent))]))

    def read(self, text: str, scope: Scope, memory: Memory) -> PropertyValue | None:
        """The value of a property that is named as in `scope`, None if `text` names no property.

        Raises ValueError if its accessor ends with a trap."""
        owner = self._owner(text, scope, memory)
        name = text.rpartition(".")[2].strip()
        if owner is None or not isinstance(owner.type, StructType):
            return None
        body = self._bodies.get(fold(pou_of_member(owner.type, f".{name}", self._bodies) + GET))
        if body is None:
            return None
        result = next(field for field in self._facts.image.frames[fold(self._facts.body_name(body))].values()
                      if field.kind == "RESULT")  # fmt: skip
        copy = Memory(memory.size, memory.areas)
        copy.restore(memory.snapshot())
        copy.views["i64"][BUDGET // 8] = STEP_BUDGET
        if trap := PythonEngine(self._image(body, owner.offset), copy).run(0):
            raise ValueError(f"{owner.name}.{name} cannot be computed: {trap}")
        place = find_place({fold(result.name): result}, {}, result.name)
        made = replace(place, name=f"{owner.name}.{result.name}")
        return PropertyValue(made, read_found(copy, place), self._instance(place, copy))

    def is_method(self, text: str, scope: Scope, memory: Memory) -> bool:
        """Whether `text` names a method of an instance."""
        owner, name = self._owner(text, scope, memory), text.rpartition(".")[2].strip()
        return owner is not None and isinstance(owner.type, StructType) and \
            fold(pou_of_member(owner.type, f".{name}", self._bodies)) in self._bodies

    def _owner(self, text: str, scope: Scope, memory: Memory) -> Place | None:
        """The instance whose property `text` names; of an interface or a reference the instance that it stands for."""
        path = text.rpartition(".")[0].strip()
        if not path or fold(path).replace("^", "") == "THIS":
            return scope.instance
        try:
            found = scope.find(path)
        except UnknownPlace:
            made = self.read(path.rstrip("^ "), scope, memory)
            instance = made.instance if made is not None else ""
        else:
            instance = self._instance(found, memory) if isinstance(found, Place) else ""
        return find_place(self._facts.symbols, self._facts.areas, instance) if instance else None

    def _instance(self, found: Place, memory: Memory) -> str:
        """The path of the instance at a place, or of that for which it stands; "" if there is none."""
        if isinstance(found.type, RefType):
            found = replace(found, hops=(*found.hops, 0))
        direct = dereferenced(memory, found)
        return self._facts.names.instance(direct.offset) if direct is not None else ""

    def _image(self, body: int, offset: int) -> Image:
        """A program whose only task executes one body for one instance."""
        key = body, offset
        if key not in self._images:
            whole = self._facts.image
            needed, waiting = {body}, [body]
            while waiting:
                for node in statements(whole.bodies[waiting.pop()].code):
                    if node[0] in CALLS and node[1] not in needed:
                        needed.add(node[1])
                        waiting.append(node[1])
            bodies = tuple(each if number in needed else replace(each, code=()) for number, each in enumerate(whole.bodies))
            run = ProgramRun(self._facts.body_name(body), body, offset)
            self._images[key] = replace(whole, bodies=bodies, tasks=(TaskRow("", 0, 0, "", (run,)),))
        return self._images[key]

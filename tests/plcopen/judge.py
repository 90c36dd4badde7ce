"""Beremiz's own generator as the judge of imports and exports.

`python tests/plcopen/judge.py BEREMIZ DIR [PYTHON]`: BEREMIZ is a checkout of Beremiz, DIR has documents in PLCopen XML, PYTHON
is an interpreter that has lxml and numpy.  For each document the text that Beremiz generates is compiled and runs beside what the
import makes of it, and the text that Beremiz generates of our export runs beside the sources of the export, both for 50 scans
with inputs at random.  Prints counts and causes.  The checkout and the documents belong to whoever wrote them: they are never
part of this repository."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

if __name__ == "__main__":
    sys.path[:0] = [str(Path(__file__).parents[2]), str(Path(__file__).parents[1])]

from sweeping import BUDGET, CYCLE_NS, Sweep, cause, compare

from fbvm.base.diagnostics import Source
from fbvm.code.compiler import compile_sources
from fbvm.code.image import Image
from fbvm.interchange.plcopen.read.importing import import_xml
from fbvm.interchange.plcopen.write.exporting import export_xml
from fbvm.machine.plc import Plc

STAGES = ("imported", "generated", "taken", "equal", "exported", "generated again", "taken again", "equal again")
DIALECT, ORDER = "matiec", "document"
"""The dialect of Beremiz, and the order in which its generator has evaluated drawings since October 2022."""
GENERATE = """
import builtins, os, sys
from types import ModuleType
from lxml import etree

home, document, text, *libraries = sys.argv[1:]
sys.path.insert(0, home)
os.chdir(home)
import fake_wx


class Window(ModuleType):
    __path__ = []

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return fake_wx.FakeObject(__classname__=name)


for name in ("controls", "controls.CustomToolTip", "dialogs"):
    sys.modules[name] = Window(name)
builtins._ = lambda text: text
from PLCControler import PLCControler



class Controller(PLCControler):
    variables = []

    def AddConfNodeTypesList(self, libraries):
        self.ConfNodeTypes.extend(libraries)
        for library in libraries:
            for pou in library["types"].getpous():
                found = pou.getblockInfos()
                self.TotalTypesDict.setdefault(found["name"], []).append((library["name"], found))

    def GetConfNodeGlobalInstances(self):
        return self.variables


types = []
for library in libraries:
    one = Controller()
    one.OpenXMLFile(library)
    one.AddConfNodeTypesList(types)
    types.append({"name": library, "types": one.Project})
controller = Controller()
controller.AddConfNodeTypesList(types)
controller.OpenXMLFile(document)
for place, _, names in os.walk(os.path.dirname(document)):
    for name in names if "@" in place else ():
        if name.endswith(".xml"):
            tree = etree.parse(os.path.join(place, name))
            controller.variables += [(one.get("name"), one.get("type"), one.get("initial", ""))
                                     for one in tree.iterfind("./{*}variables/{*}variable")]
result = controller.GenerateProgram(text)
print(result[1:], file=sys.stderr)
"""
"""A program for PYTHON that has Beremiz write the text of a document, without its windows: with the types of its libraries, and
with the variables that extensions beside the document bring along."""
LIBRARIES = ("NativeLib.xml", "py_ext/pous.xml", "svghmi/pous.xml")
"""Documents of Beremiz's own libraries, each after those that it needs."""


class Judge:
    """Compares with what a checkout of Beremiz generates."""

    def __init__(self, home: Path, python: str) -> None:
        self.home = home.resolve()
        self.python = python
        self.made = Sweep(STAGES)
        self.folder = Path(tempfile.mkdtemp(prefix="judge"))

    def document(self, path: Path, name: str) -> None:
        """Judge the import of a document, and the export of what comes of it."""
        imported = import_xml(path, name, ORDER)
        sources = [Source(file, text) for file, text in imported.files.items()]
        image = _runnable(sources) if sources and not imported.errors else None
        if image is None:
            return
        self.made.note("imported", name)
        self._judge(image, path, name, "")
        exported = export_xml(sources)
        if self.made.note("exported", name, "" if exported.text else cause(exported.errors) or "no document"):
            assert exported.text is not None
            (self.folder / "exported.xml").write_text(exported.text, encoding="utf-8")
            self._judge(image, self.folder / "exported.xml", name, " again")

    def _judge(self, image: Image, document: Path, name: str, again: str) -> None:
        text = self.folder / "generated.st"
        text.unlink(missing_ok=True)
        libraries = [str(self.home / library) for library in LIBRARIES]
        done = subprocess.run([self.python, "-c", GENERATE, str(self.home), str(document.resolve()), str(text), *libraries],
                              capture_output=True, text=True, timeout=120, check=False)
        said = "" if text.exists() else (done.stderr.strip().splitlines() or ["nothing"])[-1][:100]
        if not self.made.note(f"generated{again}", name, said):
            return
        source = Source("generated.st", text.read_text(encoding="utf-8"))
        compiled = compile_sources([source], runnable=True, dialect=DIALECT, lint=False)
        if self.made.note(f"taken{again}", name, cause(compiled.errors)):
            assert compiled.image is not None
            plcs = [Plc(one, CYCLE_NS, budget=BUDGET) for one in (image, compiled.image)]
            self.made.note(f"equal{again}", name, compare(*plcs))


def _runnable(sources: list[Source]) -> Image | None:
    return compile_sources(sources, runnable=True, dialect=DIALECT, lint=False).image


def judge(home: Path, folder: Path, python: str) -> Sweep:
    """All documents below a folder."""
    made = Judge(home, python)
    for path in sorted(path for path in folder.rglob("*") if path.suffix.lower() == ".xml" and path.is_file()):
        made.document(path, str(path.relative_to(folder)))
    return made.made


if __name__ == "__main__":
    print(judge(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3] if len(sys.argv) > 3 else sys.executable).report())

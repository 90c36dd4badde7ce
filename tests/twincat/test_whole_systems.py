"""Systems and projects of TwinCAT, and exports of CODESYS 2.3, beside all that is read of them, word for word.
`FBVM_REWRITE=1 pytest` of this file writes the text anew; read the difference before you keep it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from twincat_files import CORE, LINE, PROJECT, TASK, write_project, write_solution

from fbvm.base.diagnostics import Diagnostic
from fbvm.interchange.codesys2.importing import import_codesys2
from fbvm.interchange.imported import Imported
from fbvm.interchange.twincat.project import read_project
from fbvm.interchange.twincat.system import read_system

TEXT = Path(__file__).parent / "texts" / "systems.txt"
SYSTEM = """<TcSmProject><Project><System><Tasks><Task CycleTime="5000" Priority="7"><Name>PlcTask</Name></Task>
<Task CycleTime="x" Priority="1"><Name>Other</Name></Task><Task CycleTime="1" Priority="1"/></Tasks></System>
<Plc>{}</Plc></Project></TcSmProject>"""
ONE = '<Project PrjFilePath="Plant.plcproj"/>'
SYSTEMS = {
    "one project": SYSTEM.format(ONE), "none": SYSTEM.format(""),
    "two": SYSTEM.format(ONE + '<Project PrjFilePath="Sub\\Plant.plcproj"/>'),
    "no such file": SYSTEM.format('<Project PrjFilePath="None.plcproj"/>'), "no path": SYSTEM.format("<Project/>"),
    "another suffix": SYSTEM.format('<Project PrjFilePath="Plant.txt"/>'),
    "outside": SYSTEM.format('<Project PrjFilePath="..\\Plant.plcproj"/>'),
    "a drive": SYSTEM.format('<Project PrjFilePath="C:\\Plant.plcproj"/>'),
    "a part": SYSTEM.format('<Project File="Part.xti"/>'),
    "a part that is missing": SYSTEM.format('<Project File="None.xti"/>'),
    "a part outside": SYSTEM.format('<Project File="..\\Part.xti"/>'),
    "a part with two": SYSTEM.format('<Project File="Two.xti"/>'),
    "a part that is none": SYSTEM.format('<Project File="Odd.xti"/>'),
    "a part that is damaged": SYSTEM.format('<Project File="Bad.xti"/>'), "no system": "<Project/>", "damaged": "<TcSmProject>",
}  # fmt: skip
PARTS = {"Part": '<TcSmItem><Project PrjFilePath="..\\..\\Plant.plcproj"/></TcSmItem>', "Odd": "<Item/>", "Bad": "<TcSmItem>",
         "Two": '<TcSmItem><Project PrjFilePath="a.plcproj"/><Project PrjFilePath="b.plcproj"/></TcSmItem>'}  # fmt: skip
PROJECTS = {
    "as it is": PROJECT, "without tasks": PROJECT.replace('"PlcTask.TcTTO"', '"None.TcTTO"'), "without objects": "<Project/>",
    "a reference": PROJECT.replace('Include="Tc2_Standard"', 'Include="Own, * (us)"'), "no project": "<Projekt/>",
    "names and parameters": LINE.replace("<Key>NSTEPS</Key>", "<Key> a </Key>"),
    "a title of two words": CORE.replace("Core", "A B"),
}  # fmt: skip
EXPORT = """(* @NESTEDCOMMENTS := 'Yes' *)
(* @PATH := '\\\\/Motors' *)
FUNCTION_BLOCK Doubler
VAR_INPUT IN : INT; END_VAR
(* @END_DECLARATION := '0' *)
IN := IN * 2;
END_FUNCTION_BLOCK

ACTION Count:
IN := IN + 1;
END_ACTION
(* @PATH := '' *)
TYPE Pair :
STRUCT a : INT; END_STRUCT
END_TYPE
(* @GLOBAL_VARIABLE_LIST := 'Settings' *)
VAR_GLOBAL
    Factor : INT := 2;
END_VAR
(* @OBJECT_END := 'Settings' *)
VAR_GLOBAL CONSTANT
    Most : INT := 5;
END_VAR
PROGRAM Drawn
VAR END_VAR
_FBD_BODY
_NETWORKS : 1
END_PROGRAM
FUNCTION F : INT
VAR_INPUT a : INT; END_VAR
(* @END_DECLARATION := '0' *)
F := a;
END_FUNCTION

_ALARMCONFIG
_ALARMCLASSNAME : 'DEFAULT'
_END_ALARMCONFIG
LIBRARY
Standard.lib 4.10.05 12:14:46
NumOfPOUs: 1
TON: 0
END_LIBRARY
PLC_CONFIGURATION
_MODULE: '3S'
PLC_END
RESOURCE
TASK Fast (INTERVAL := T#1ms)
TASK Slow (INTERVAL := T#1s)
END_RESOURCE
"""
EXPORTS = {"as it is": EXPORT, "with other line ends": EXPORT.replace("\n", "\r\n"), "cut off": EXPORT[:700],
    "a part alone": EXPORT[EXPORT.index("RESOURCE"):],
           "no end of a part": EXPORT.replace("_END_ALARMCONFIG\n", "").replace("PLC_END", ""),
    "nothing": "(* @NESTEDCOMMENTS := 'Yes' *)\n"}  # fmt: skip


def told(made: Imported, folder: Path, texts: bool = False) -> list[str]:
    """All that an import says, without the folder in which its files lie."""
    def message(found: Diagnostic) -> str:
        line, column = found.source.place(found.start)
        marked = " ".join(found.source.text[found.start : found.end].split())
        return f"{line}:{column} {found.severity} {found.code}: {found.message}; {found.hint} [{marked}]"

    lines = [line for name, text in made.files.items() for line in
             (f"--- {name}", *(text.rstrip().splitlines() if texts or name.endswith("Tasks.st") else ()))]  # fmt: skip
    lines += [*map(message, made.diagnostics), f"{made.family} | {made.because} | {', '.join(made.references)}"]
    lines += [*(f"uses {path}" for path in made.uses), *(f"sets {key} {value}" for key, value in made.parameters.items())]
    return [line.replace(str(folder), "FOLDER").rstrip() for line in lines]


@pytest.mark.slow
def test_what_is_read_of_systems_projects_and_exports(tmp_path: Path) -> None:
    write_project(tmp_path)
    write_project(tmp_path / "Sub")
    (tmp_path / "_Config" / "PLC").mkdir(parents=True)
    for name, text in PARTS.items():
        (tmp_path / "_Config" / "PLC" / f"{name}.xti").write_text(text, encoding="utf-8")
    lines = []
    for name, text in SYSTEMS.items():
        (file := tmp_path / "Whole.tsproj").write_text(text, encoding="utf-8")
        lines += [f"=== a system: {name}", *told(read_system(file), tmp_path)]
    for name, text in PROJECTS.items():
        (file := tmp_path / "Plant.plcproj").write_text(text, encoding="utf-8")
        lines += [f"=== a project: {name}", *told(read_project(file), tmp_path)]
    line = write_solution(tmp_path / "All")
    lines += ["=== a solution", *told(read_project(line), tmp_path)]
    (line.parent / "PlcTask.TcTTO").write_text(TASK.replace("<CycleTime>", "<CycleTime>1"), encoding="utf-8")
    lines += ["=== a solution with another cycle", *told(read_project(line), tmp_path)]
    for name, text in EXPORTS.items():
        lines += [f"=== an export: {name}", *told(import_codesys2(text.encode("cp1252"), "a.exp"), tmp_path, texts=True)]
    made = "\n".join(lines) + "\n"
    if os.environ.get("FBVM_REWRITE"):
        TEXT.write_text(made, encoding="utf-8")
    assert made == TEXT.read_text(encoding="utf-8")

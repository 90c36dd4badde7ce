"""Every diagnostic code: S = source, P = project file, X = project files of other tools, R = running (trap).

Each has a page in `pages/` and a test.

Ranges: S01 text and syntax, S02 names and declarations, S03 types, S04 calls, S05 statements, S06 addresses and memory,
S07 constants and initial values, S08 configuration and tasks, S09 understood but refused, P01 the project file,
X01 XML and its frame, X02 diagrams, X03 export, X04 CX-Programmer, R01 traps.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Code:
    """A row of the table: the code, how severe it is, and its title for lists."""

    code: str
    severity: str
    title: str


def _table(severity: str, rows: dict[str, str]) -> dict[str, Code]:
    return {code: Code(code, severity, title) for code, title in rows.items()}


CODES: dict[str, Code] = {
    **_table("error", {
        "S0101": "unexpected text",
        "S0102": "character that no word begins with",
        "S0103": "comment or pragma without end",
        "S0104": "string literal without end or with a wrong escape",
        "S0105": "malformed literal",
        "S0106": "nested too deep",
        "S0107": "file cannot be read as text",
        "S0108": "literal out of range of its type",
        "S0109": "no instruction of ladder",
        "S0110": "ladder that cannot be executed",
        "S0111": "chart that cannot be executed",
        "S0112": "action of a step is wrong",
        "S0113": "drawing of a rung that cannot be read",
        "S0114": "instruction list that cannot be executed",
        "S0201": "unknown name",
        "S0202": "name declared twice",
        "S0203": "POU or type declared twice",
        "S0204": "unknown type",
        "S0205": "section not allowed in this POU",
        "S0206": "qualifier not allowed here",
        "S0207": "recursive declaration",
        "S0208": "VAR_EXTERNAL without matching VAR_GLOBAL",
        "S0209": "no program to run",
        "S0210": "no such member",
        "S0301": "types do not fit",
        "S0302": "operator not defined for these types",
        "S0303": "condition is not BOOL",
        "S0304": "not an array, structure or instance",
        "S0305": "wrong number of subscripts",
        "S0401": "not callable",
        "S0402": "unknown parameter",
        "S0403": "parameter given twice",
        "S0404": "parameter missing",
        "S0405": "argument does not fit",
        "S0406": "positional and named arguments mixed",
        "S0407": "in-out or output needs a variable",
        "S0408": "recursive call",
        "S0409": "function without result used as a value",
        "S0501": "target cannot be written",
        "S0502": "EXIT or CONTINUE outside a loop",
        "S0503": "CASE label wrong or doubled",
        "S0504": "FOR variable or step wrong",
        "S0601": "no such address",
        "S0602": "address does not fit the type",
        "S0603": "memory is full",
        "S0604": "location not allowed here",
        "S0701": "constant expression needed",
        "S0702": "constant out of range",
        "S0703": "constant expression divides by zero or is not defined",
        "S0704": "bounds are wrong",
        "S0705": "initial value does not fit",
        "S0801": "task or resource declared wrongly",
        "S0901": "understood, but not executed by this version",
        "S0902": "object-oriented text is refused",
        "S0903": "not in this dialect",
        "P0101": "project file is not TOML",
        "P0102": "unknown key in a project file",
        "P0103": "value in a project file does not fit",
        "P0104": "key missing from a project file",
        "P0201": "library.toml does not describe a library",
        "X0101": "no well-formed XML",
        "X0102": "XML with a document type",
        "X0103": "XML too large or too deep",
        "X0104": "no PLCopen XML",
        "X0105": "element without what it needs",
        "X0201": "wire that leads nowhere",
        "X0202": "diagram that cannot be executed",
        "X0203": "part of a program that is not taken over",
        "X0301": "cannot be said in PLCopen XML",
        "X0401": "no project of CX-Programmer",
    }),
    **_table("warning", {
        "S0190": "pragma is not known and has no effect",
        "S0191": "name with doubled or trailing underscore",
        "S0192": "characters beyond the type of the literal",
        "S0290": "variable is never used",
        "S0291": "instance is never called",
        "S0292": "function never sets its result",
        "S0293": "input is never read",
        "S0294": "output is never written",
        "S0390": "reals compared for equality",
        "S0391": "fraction of an integer division is lost",
        "S0490": "timer, counter or edge is called only sometimes",
        "S0491": "result is not used",
        "S0590": "FOR variable written inside its loop",
        "S0591": "input written inside its block",
        "S0592": "statement is never executed",
        "S0593": "condition is always the same",
        "S0594": "assignment without effect",
        "S0595": "CASE forgets a member of an enumeration",
        "S0596": "output written twice, and the first value lost",
        "S0597": "step or transition is never reached",
        "S0598": "step may be entered while it is active",
        "S0599": "action with two times at once",
        "S0690": "output written in two POUs",
        "S0691": "located variables share memory",
        "S0692": "location left open",
        "S0693": "number of a timer or counter used twice",
        "S0790": "text is cut",
        "S0791": "constant loses digits",
        "S0792": "constant is infinite or no number",
        "S0793": "power of constants taken as an integer",
        "S0890": "program that no task runs",
        "X0190": "not taken over, and not needed to run",
        "X0290": "loop of wires",
        "X0291": "element without effect",
        "X0292": "read in one of several ways",
        "X0390": "only this program understands it in PLCopen XML",
    }),
    **_table("trap", {
        "R0101": "division by zero",
        "R0102": "index outside its array",
        "R0103": "value outside its subrange",
        "R0104": "step budget used up (watchdog)",
        "R0105": "conversion out of range",
        "R0106": "negative shift or rotate",
        "R0107": "selector of MUX out of range",
        "R0108": "string position or length out of range",
        "R0109": "FOR step is zero",
        "R0110": "reference is null or its object has ended",
        "R0111": "text cannot be converted",
        "R0112": "watch cycle time exceeded",
        "R0120": "the program has stopped itself",
    }),
}

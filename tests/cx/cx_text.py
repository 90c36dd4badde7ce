"""Projects of CX-Programmer for tests, of our own making: the text of a `.cxt` from symbols, rungs and function blocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

SEPARATOR = "\x11"


@dataclass
class Cxt:
    """Makes the text; markers of texts and lists have one counter, from 1 on."""

    symbols: Sequence[str] = ()
    """Rows of the table of global symbols, without `;`; a second line is a comment between markers."""
    local: Sequence[str] = ()
    sections: Sequence[tuple[str, Sequence[str | Sequence[str]]]] = ()
    """Names and rungs; a rung is its statement list, of which lines with `#` are its comment and with `~` attached comments,
    or the elements of a rung with a call."""
    blocks: Sequence[str] = ()
    """Text of definitions; `<list>` and `</list>` stand for the markers of a list."""
    version: str = "1.8"
    plc_keys: str = ""
    task: int = 256
    lines: list[str] = field(default_factory=list)
    count: int = 0

    @property
    def text(self) -> str:
        """The project: lines of structure end with CR LF, those of statement lists with LF."""
        self.lines, self.count = [], 0
        self._add(
            f'CXProgVer:="{self.version}";',
            'WrittenByCXPVersion:="9.61";',
            "FileType:=1;",
            'Name:="Sample";',
            "ResourceCount:=1;",
            "Resource[0]:=",
            "BEGIN",
            ' Name:="NewResource1";',
            " PLC:=",
            " BEGIN",
            '  Name:="NewPLC1";',
            r'  Config:="[ADDRESS]PATH:BACKPLANE\0;[DEV]DEV:CJ1M;CLOCK:TRUE;CPU:CPU11;";',
            *self.plc_keys.splitlines(),
            " END;",
            " GlobalVariables:=",
            " BEGIN",
        )
        self._table(self.symbols)
        self._add(
            " END;", " FunctionBlocks:=", " BEGIN", *([f"  FunctionBlockCount:={len(self.blocks)};"] if self.blocks else [])
        )
        for number, block in enumerate(self.blocks):
            self._add(f"  FunctionBlockWrapper[{number}]:=")
            for line in block.splitlines():
                if line.strip() == "<list>":
                    self.count += 1
                    line = f"BEGIN_LIST_$#[{self.count}]"
                elif line.strip() == "</list>":
                    line = f"END_LIST_$#[{self.count}];"
                self._add(line)
        self._add(
            " END;",
            " Programs:=",
            " BEGIN",
            "  Program[0]:=",
            "  BEGIN",
            '   Name:="NewProgram1";',
            "   FileType:=2;",
            "   LocalVariables:=",
            "   BEGIN",
        )
        self._table(self.local)
        self._add(
            "   END;", f"   TaskID:={self.task};", "   OpStart:=1;", "   Sections:=", "   BEGIN", f"    SC:={len(self.sections)};"
        )
        for number, (name, rungs) in enumerate(self.sections):
            self._add(
                f"    Sec[{number}]:=",
                "    BEGIN",
                "     IEC1131Type:=11;",
                "     SecType:=0;",
                f'     SecName:="{name}";',
                "     ProgramData:=",
                "     BEGIN",
                f"      RC:={len(rungs)};",
            )
            for at, rung in enumerate(rungs):
                self._add(f"      R[{at}]:=", "      BEGIN")
                self._rung(rung)
                self._add("      END;")
            self._add("     END;", "    END;")
        self._add("   END;", "  END;", " END;", "END;")
        return "".join(self.lines)

    def bytes(self, encoding: str = "cp1252") -> bytes:
        """The project as a file."""
        return self.text.encode(encoding)

    def _add(self, *lines: str) -> None:
        self.lines += [f"{line}\r\n" for line in lines]

    def _table(self, rows: Sequence[str]) -> None:
        self.count += 1
        marker = self.count
        self._add("  VariableList:=", f"  BEGIN_LIST_$#[{marker}]")
        for row in rows:
            head, _, raw = row.partition("\n")
            if raw:
                self.count += 1
                mark = f"$?St$Bk?_#[{self.count}]"
                self._add(f"   {head}", mark, f"{raw}{mark};")
            else:
                self._add(f"   {row};")
        self._add(f"  END_LIST_$#[{marker}];", f"  VariableCount:={len(rows)};")

    def _rung(self, rung: str | Sequence[str]) -> None:
        if not isinstance(rung, str):
            self._add('       Com:="";', '       Flags:="0,0";', f"       TotEl:={len(rung)};")
            for at, element in enumerate(rung):
                self._add(f'       [{at}]:="{element.replace("|", SEPARATOR)}";', f'       AtCom[{at}]:="";')
            return
        rows = [line.strip() for line in rung.strip().splitlines()]
        comment = " ".join(row[1:].strip() for row in rows if row.startswith("#"))
        notes = [row[1:].strip() for row in rows if row.startswith("~")]
        steps = [row for row in rows if not row.startswith(("#", "~"))]
        self._add(f'       Com:="{comment}";', '       Flags:="1,0";', '       FBversion:="";')
        if steps or comment:
            self.count += 1
            mark = f"$?St$Bk?_#[{self.count}]"
            self._add("       SL:=", mark)
            self.lines += [f"{line}\n" for line in ([*(["'  R0"] if comment else []), *steps])]
            self._add(mark)
        else:
            self._add('       SL:="";')
        self._add(
            "       AtchCmts:=",
            "       BEGIN",
            f"        CC:={len(notes)};",
            *(f'        {at}:="{note}";' for at, note in enumerate(notes)),
            "       END;",
        )


DOUBLE = """BEGIN
FBType:="FBLadder";
FunctionBlock:=
BEGIN
IEC1131Type:=3;
Name:="DOUBLE";
POUHeader:=
BEGIN
PouVarList:=
<list>
1,X,1,,0,0,0,raw value;
2,Y,1,,0,0,0,twice the raw value;
0,Runs,2,,0,0,1,;
</list>
PouVarCount:=3;
END;
POUBody:=
BEGIN
FBProgramData:=
BEGIN
FBRC:=1;
FBR[0]:=
BEGIN
Com:="Y = X + X";
Flags:="1,0";
TotEl:=6;
[0]:="0,0,1,1,1,1,EN, 1";
[1]:="3,0,1,0,2,5,++(590), 0,Runs, 0";
[2]:="1,0,1,1,0,3";
[3]:="2,0,1,1,0,3";
[4]:="0,2,1,1,1,1,P_Off, 8";
[5]:="1,2,1,0,4,5,+(400), 0,X, 0,X, 0,Y, 0";
END;
END;
END;
END;
END;"""
"""A function block in ladder: Y is twice X, and Runs counts how often EN rises."""

SAMPLE = Cxt(
    symbols=(
        "Start_PB,0.00,BOOL,,,start button",
        'Stop_PB,0.01,BOOL,,,"stop button, normally open"',
        'Pump,100.00,BOOL,,,\npump of the 2" line',
        ",D100,CHANNEL,,,raw level",
        "Dbl1,,FUNCTION BLOCK,DOUBLE,A,",
    ),
    local=("Helper,,BOOL,,A,",),
    blocks=(DOUBLE,),
    sections=(
        (
            "Pumping",
            (
                "# self hold\nLD Start_PB\nOR Pump\nANDNOT Stop_PB\n//  0\nOUT Pump\n~ opens the hold",
                (
                    "0|1|1|1|1|LD|P_On|1",
                    "2|0|7|1|1|FBCALL|Dbl1|9",
                    "1|2|8|1|1|FB_INPUT|D100|10",
                    "4|2|8|1|1|FB_OUTPUT|D101|11",
                    "1|1|3",
                ),
                "",
            ),
        ),
        ("END", ("END(001)", "")),
    ),
)
"""Two sections, a table of symbols, a function block."""

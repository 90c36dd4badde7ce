"""Blocks of TwinCAT's libraries that ask for what a simulation has not (ADS, sockets, axes), and those of files, scan by scan."""

from __future__ import annotations

from functools import cache
from typing import Any

import pytest
from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc

MS = 1_000_000


@cache
def image_of(text: str) -> Image:
    made = compile_text(f"PROGRAM Main\n{text}\nEND_PROGRAM", dialect="twincat")
    assert made.image is not None, [message.render() for message in made.diagnostics]
    return made.image


def after(plc: Plc, names: str, **inputs: Any) -> tuple[Any, ...]:
    """What variables of Main are after one more scan with these inputs."""
    for name, value in inputs.items():
        plc.write(f"Main.{name}", value)
    assert plc.scan() is None
    return tuple(plc.read(f"Main.{name}") for name in names.split())


SOCKETS = ["Accept", "Close", "CloseAll", "Connect", "Listen", "Receive", "Send", "UdpCreate", "UdpReceiveFrom", "UdpSendTo"]
ASKED = {
    **{name: (pin, "BUSY ERR ERRID", 7) for name, pin in (
        ("ADSREAD", "READ"), ("ADSREADEX", "READ"), ("ADSWRITE", "WRITE"), ("ADSWRTCTL", "WRITE"), ("ADSRDWRT", "WRTRD"),
        ("ADSRDWRTEX", "WRTRD"), ("ADSRDSTATE", "RDSTATE"))},
    "FW_AdsRdWrt": ("bExecute", "bBusy bError nErrId", 7),
    **{f"FB_Socket{name}": ("bExecute", "bBusy bError nErrId", 6) for name in SOCKETS},
}  # fmt: skip
"""By block its input that rises, its outputs, and the error that it ends with."""


@pytest.mark.slow
@pytest.mark.parametrize("block", ASKED)
def test_a_block_that_reaches_nobody_is_busy_for_one_call_and_ends_in_its_error(block: str) -> None:
    pin, outputs, error = ASKED[block]
    plc = Plc(image_of(f"VAR b : {block}; go : BOOL; END_VAR\nb({pin} := go);"))
    names = " ".join(f"b.{name}" for name in outputs.split())
    idle, busy, failed = (False, False, 0), (True, False, 0), (False, True, error)
    assert [after(plc, names, go=level) for level in (False, True, True, True, False, True, False, False)] == [
        idle, busy, failed, failed, failed, busy, failed, failed]  # fmt: skip


MOVES = ["Absolute", "Additive", "ContinuousAbsolute", "ContinuousRelative", "Modulo", "Relative", "Velocity"]
AXES = {
    **{f"MC_{name}": "Execute" for name in [
        "Halt", "Home", "ReadDriveAddress", "ReadParameterSet", "Reset", "SetPosition", "Stop", "WriteBoolParameter",
        "WriteParameter", "GearIn", "GearOut", *(f"Move{way}" for way in MOVES)]},
    **{f"MC_{name}": "Enable" for name in [
        "BacklashCompensation", "GearInDyn", "Power", "ReadActualPosition", "ReadActualVelocity", "ReadAxisError",
        "ReadBoolParameter", "ReadParameter", "ReadStatus", "SetOverride"]},
}  # fmt: skip
OTHERS = {"MC_GearIn": "Master := a, Slave := a", "MC_GearInDyn": "Master := a, Slave := a", "MC_GearOut": "Slave := a",
          "MC_ReadParameterSet": "Axis := a, Parameter := p"}  # fmt: skip


@pytest.mark.slow
def test_a_block_of_an_axis_is_in_error_as_long_as_it_is_asked() -> None:
    declared = " ".join(f"{name}_b : {name};" for name in AXES)
    called = "\n".join(f"{name}_b({OTHERS.get(name, 'Axis := a')}, {pin} := go);" for name, pin in AXES.items())
    plc = Plc(image_of(f"VAR a : AXIS_REF; p : ST_AxisParameterSet; go : BOOL; {declared} END_VAR\n{called}"))
    for level in (False, True, False):
        after(plc, "go", go=level)
        for name in AXES:
            number = "ErrorId" if name == "MC_BacklashCompensation" else "ErrorID"
            told = (plc.read(f"Main.{name}_b.Error"), plc.read(f"Main.{name}_b.{number}"))
            assert told == ((True, 0x8145) if level else (False, 0)), name


@pytest.mark.slow
def test_a_jog_is_asked_by_either_direction_and_an_axis_counts_its_readings() -> None:
    plc = Plc(image_of("VAR a : AXIS_REF; b : MC_Jog; on, back : BOOL; code : DWORD; END_VAR\n"
                       "a.NcToPlc.ErrorCode := code; a(); b(Axis := a, JogForward := on, JogBackwards := back);"))  # fmt: skip
    for on, back in ((False, False), (True, False), (False, True), (True, True)):
        told = after(plc, "b.Error b.ErrorID", on=on, back=back)
        assert told == ((True, 0x8145) if on or back else (False, 0))
    read = "a.Status.Error a.Status.ErrorId a.Status.CycleCounter"
    assert [after(plc, read, code=code) for code in (0, 1, 0x4650, 0)] == [
        (False, 0, 5), (True, 1, 6), (True, 0x4650, 7), (False, 0, 8)]  # fmt: skip


NUMBERS = """
MC_Direction.MC_Positive_Direction=1 MC_Shortest_Way=2 MC_Negative_Direction=3 MC_Current_Direction=4
MC_Undefined_Direction=128 MC_AxisParameter.CommandedPosition=1 MC_AxisParameter.MaxJerkAppl=17 MC_AxisParameter.AxisId=1000
MC_AxisParameter.AxisModuloToleranceWindow=1045 E_DisableMode.DisableModeHold=0 E_DisableMode.DisableModeReset=1
E_PersistentMode.SPDM_2PASS=0 E_PersistentMode.SPDM_VAR_BOOST=1 E_TimeZoneID.eTimeZoneID_Invalid=-1
E_TimeZoneID.eTimeZoneID_Unknown=0 E_TimeZoneID.eTimeZoneID_Standard=1 E_TimeZoneID.eTimeZoneID_Daylight=2
E_OpenPath.PATH_GENERIC=1 E_OpenPath.PATH_BOOTPATH=4 E_OpenPath.PATH_USERPATH1=11 E_OpenPath.PATH_USERPATH9=19
E_TcMemoryArea.Static=1 E_TcMemoryArea.Dynamic=2 E_TcMemoryArea.CNC=3 E_TcMemoryArea.Unknown=0 FOPEN_MODEREAD=1
FOPEN_MODEWRITE=2 FOPEN_MODEAPPEND=4 FOPEN_MODEPLUS=8 FOPEN_MODEBINARY=16 FOPEN_MODETEXT=32 ADSLOG_MSGTYPE_HINT=1
ADSLOG_MSGTYPE_WARN=2 ADSLOG_MSGTYPE_ERROR=4 ADSLOG_MSGTYPE_LOG=16 ADSLOG_MSGTYPE_MSGBOX=32 ADSLOG_MSGTYPE_RESOURCE=64
ADSLOG_MSGTYPE_STRING=128 MAX_STRING_LENGTH=255 TCPADS_MAXUDP_BUFFSIZE=8192 TIME_TO_DINT(DEFAULT_ADS_TIMEOUT)=5000
DEFAULT_CSV_FIELD_SEP=59 GVL_Param_TcUnit.MaxNumberOfTestSuites=100 GVL_Param_TcUnit.MaxNumberOfTestsForEachTestSuite=100
GVL_Param_TcUnit.MaxNumberOfAssertsForEachTestSuite=65535
"""


@pytest.mark.slow
def test_constants_of_the_libraries_have_the_vendors_numbers() -> None:
    wanted = {name: int(number) for name, _, number in (row.partition("=") for row in NUMBERS.split())}
    lines = "\n".join(f"n[{at}] := TO_LINT({name});" for at, name in enumerate(wanted))
    [found] = after(Plc(image_of(f"VAR n : ARRAY[0..{len(wanted) - 1}] OF LINT; END_VAR\n{lines}")), "n")
    assert dict(zip(wanted, found, strict=True)) == wanted


SIZES = """
T_MaxString=256 T_AmsNetId=24 T_AmsNetIdArr=6 AMSNETID=6 T_IPv4Addr=16 T_IPv4AddrArr=4 ST_LibVersion.sVersion=24
ST_SockAddr.sAddr=16 ST_TimeZoneInformation.standardName=32 ST_TimeZoneInformation.daylightName=32
NCTOPLC_AXIS_REF.CamCouplingState=8
NCTOPLC_AXIS_REF.CamCouplingTableID=16 ST_AxisStatus.CamCouplingState=8 ST_AxisParameterSet.sAxisName=32
ST_AxisParameterSet.sEncName=32 ST_AxisParameterSet.sCtrlName=32 ST_AxisParameterSet.sDriveName=32
ST_AxisParameterSet.Reserved=376 ST_AxisParameterSet=1024
PlcAppSystemInfo.AppName=64 PlcAppSystemInfo.ProjectName=64 PlcTaskSystemInfo.TaskName=64
TwinCAT_LogMessage.Text=254
"""
"""Bytes of types and of their members; a text has one more than characters."""


@pytest.mark.slow
def test_types_of_the_libraries_have_the_vendors_sizes() -> None:
    wanted = {name: int(size) for name, _, size in (row.partition("=") for row in SIZES.split())}
    declared = " ".join(f"v{at} : {name.partition('.')[0]};" for at, name in enumerate(wanted))
    parts = [f"v{at}{''.join(name.partition('.')[1:])}" for at, name in enumerate(wanted)]
    lines = "\n".join(f"n[{at}] := SIZEOF({part});" for at, part in enumerate(parts))
    plc = Plc(image_of(f"VAR n : ARRAY[0..{len(wanted) - 1}] OF UDINT; tasks, lines : UDINT; {declared} END_VAR\n{lines}\n"
                       "tasks := SIZEOF(TwinCAT_SystemInfoVarList._TaskInfo) / SIZEOF(PlcTaskSystemInfo);\n"
                       "lines := SIZEOF(TwinCAT_Log) / SIZEOF(TwinCAT_LogMessage);"))  # fmt: skip
    found, tasks, kept = after(plc, "n tasks lines")
    assert dict(zip(wanted, found, strict=True)) == wanted
    assert (tasks, kept) == (33, 256)


@pytest.mark.slow
def test_inputs_that_are_not_given_have_the_vendors_values() -> None:
    plc = Plc(image_of("VAR clock : FB_LocalSystemTime; gear : MC_GearIn; file : FB_FileOpen; END_VAR\nclock();"))
    assert after(plc, "clock.dwCycle clock.dwOpt gear.RatioDenominator file.ePath file.tTimeout") == (5, 1, 1, 1, 5000 * MS)


# --- files of Tc2_System ------------------------------------------------------------------------------------------------

FILES = """VAR
    open : FB_FileOpen; close : FB_FileClose; puts : FB_FilePuts; gets : FB_FileGets; write : FB_FileWrite; read : FB_FileRead;
    delete : FB_FileDelete; what, room : INT; path, line : STRING(255); mode : DWORD; h : UINT; go : BOOL;
    bytes, into : ARRAY[0..7] OF BYTE := [97, 98, 10, 99, 100, 101, 102, 103];
END_VAR
CASE what OF
    0: open(sPathName := path, nMode := mode, bExecute := go);
    1: close(hFile := h, bExecute := go);
    2: puts(hFile := h, sLine := line, bExecute := go);
    3: gets(hFile := h, bExecute := go);
    4: write(hFile := h, pWriteBuff := ADR(bytes), cbWriteLen := INT_TO_UDINT(room), bExecute := go);
    5: read(hFile := h, pReadBuff := ADR(into), cbReadLen := INT_TO_UDINT(room), bExecute := go);
    6: delete(sPathName := path, bExecute := go);
END_CASE"""
ORDER = ["open", "close", "puts", "gets", "write", "read", "delete"]


def done(plc: Plc, block: str, outputs: str = "", **inputs: Any) -> Any:
    """The error and outputs of a block of files, after it was busy for one call; it keeps them until it is asked again."""
    state = f"{block}.bBusy {block}.bError {block}.nErrId"
    assert after(plc, state, what=ORDER.index(block), go=True, **inputs) == (True, False, 0)
    told = after(plc, " ".join([state, *(f"{block}.{name}" for name in outputs.split())]))
    assert after(plc, state) == after(plc, state, go=False) == told[:3]
    assert told[:2] == (False, told[2] != 0)
    return told[2:] if outputs else told[2]


@pytest.mark.slow
def test_bytes_and_lines_are_written_read_and_deleted() -> None:
    plc = Plc(image_of(FILES))
    error, h = done(plc, "open", "hFile", path="a", mode=0x2)
    assert error == 0 and h != 0
    assert done(plc, "write", "cbWrite", h=h, room=8) == (0, 8)
    assert done(plc, "puts", line="x$L".replace("$L", "\n")) == 0
    assert done(plc, "close") == 0
    assert (done(plc, "close"), done(plc, "puts"), done(plc, "write"), done(plc, "read"), done(plc, "gets")) == (0x703,) * 5
    error, h = done(plc, "open", "hFile", mode=0x1)
    assert done(plc, "gets", "sLine bEOF", h=h) == (0, "ab\n", False)
    assert done(plc, "read", "cbRead bEOF", room=3) == (0, 3, False)
    assert plc.read("Main.into") == [99, 100, 101, 99, 100, 101, 102, 103]
    assert done(plc, "read", "cbRead bEOF", room=4) == (0, 4, False)
    assert done(plc, "read", "cbRead bEOF", room=1) == (0, 0, True)
    assert done(plc, "gets", "sLine bEOF") == (0, "", True)
    assert done(plc, "read", "cbRead bEOF", h=0, room=1) == (0x703, 0, False)
    assert done(plc, "gets", "sLine bEOF") == (0x703, "", False)
    assert done(plc, "close", h=h) == 0
    assert (done(plc, "delete"), done(plc, "delete"), done(plc, "open", "hFile")) == (0, 0x70C, (0x70C, 0))
    assert done(plc, "open", path="", mode=0x2) == 0x70A


@pytest.mark.slow
def test_a_line_without_an_end_is_read_up_to_255_characters() -> None:
    plc = Plc(image_of(FILES))
    _, h = done(plc, "open", "hFile", path="a", mode=0x22)
    for line in ("a" * 250, "b" * 6):
        assert done(plc, "puts", h=h, line=line) == 0
    assert done(plc, "close") == 0
    _, h = done(plc, "open", "hFile", mode=0x21)
    assert done(plc, "gets", "sLine bEOF", h=h) == (0, "a" * 250 + "b" * 5, False)
    assert done(plc, "gets", "sLine bEOF") == (0, "b", False)
    assert done(plc, "gets", "sLine bEOF") == (0, "", True)


@pytest.mark.slow
@each_of(("mode", "told", "kept"), [
    (0x1, (0, "abc", 0x700), "abc"), (0x9, (0, "abc", 0), "abcx"), (0x2, (0, "", 0), "x"), (0xA, (0, "", 0), "x"),
    (0x4, (0, "abc", 0), "abcx"), (0xC, (0, "abc", 0), "abcx"), (0x12, (0, "", 0), "x"),
])  # fmt: skip
def test_the_mode_of_a_file_says_what_may_be_done_with_it(mode: int, told: tuple[Any, ...], kept: str) -> None:
    plc = Plc(image_of(FILES))
    _, h = done(plc, "open", "hFile", path="a", mode=0x2)
    assert (done(plc, "puts", h=h, line="abc"), done(plc, "close")) == (0, 0)
    error, h = done(plc, "open", "hFile", mode=mode)
    assert error == 0
    assert (*done(plc, "gets", "sLine", h=h), done(plc, "puts", line="x")) == told
    assert done(plc, "read", "cbRead bEOF", room=1) == (0, 0, True)
    assert done(plc, "close") == 0
    _, h = done(plc, "open", "hFile", mode=0x1)
    assert done(plc, "gets", "sLine", h=h) == (0, kept)


@pytest.mark.slow
@each_of(("mode", "error"), [(0x1, 0x70C), (0x9, 0x70C), (0x2, 0), (0xA, 0), (0x4, 0), (0xC, 0)])
def test_a_file_is_made_to_be_written_and_not_to_be_read(mode: int, error: int) -> None:
    assert done(Plc(image_of(FILES)), "open", path="a", mode=mode) == error


@pytest.mark.slow
def test_the_bits_of_a_mode_are_one_of_the_modes_of_codesys() -> None:
    modes = ("AM_READ", "AM_WRITE", "AM_APPEND_PLUS", "AM_READ_PLUS", "AM_WRITE_PLUS")
    wanted = {0: 0, 1: 0, 2: 1, 3: 1, 4: 2, 6: 2, 8: 3, 9: 3, 10: 4, 12: 2, 0x10: 0, 0x20: 0, 0x22: 1}
    lines = "\n".join(f"all[{at}] := TO_DINT({name});" for at, name in enumerate(modes))
    plc = Plc(image_of("VAR mode : DWORD; got : DINT; all : ARRAY[0..4] OF DINT; END_VAR\n"
                       f"got := TO_DINT(TwinCAT_AccessMode(mode));\n{lines}"))  # fmt: skip
    for mode, at in wanted.items():
        got, known = after(plc, "got all", mode=mode)
        assert got == known[at], mode

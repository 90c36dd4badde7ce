"""Names of other languages and of vendors' libraries, with the hints for programs that use them."""

from __future__ import annotations

import re

from fbvm.base.types import ELEMENTARY

_WAIT = "a scan never waits: use a timer, such as TON"
_PRINT = "a PLC prints nothing: watch a variable"
VALUES = dict.fromkeys(("DEFAULT", "OTHERS", "OTHERWISE"), "the rest of a CASE stands behind ELSE, without a colon") | {
    "NIL": "write NULL", "NULLPTR": "write NULL", "PI": "write 3.14159265358979, or declare a constant",
    "THEN": "THEN belongs to IF", "NEXT": "a loop ends with END_FOR", "WEND": "a loop ends with END_WHILE",
    "BREAK": "EXIT leaves a loop", "END_DO": "FOR ends with END_FOR, WHILE with END_WHILE", "GOTO": "write JMP and a label",
    "INF_REAL": "write STRING_TO_REAL('INF')", "INF_LREAL": "write STRING_TO_LREAL('INF')",
    "NAN_REAL": "write STRING_TO_REAL('NAN')", "NAN_LREAL": "write STRING_TO_LREAL('NAN')",
    **dict.fromkeys(("END", "FI", "ENDLOOP", "END_LOOP", "DONE"), "blocks end with END_IF, END_FOR, END_WHILE, END_CASE"),
    **dict.fromkeys(("ON", "YES", "HIGH"), "write TRUE"), **dict.fromkeys(("OFF", "NO", "LOW"), "write FALSE"),
    **dict.fromkeys((*ELEMENTARY, "STRING", "WSTRING"),
                    "it is a type: variables are declared between VAR and END_VAR, in front of all statements")}
"""Names of values."""
FUNCTIONS = {
    **{name: f"write TO_{name}(x)" for name in (*ELEMENTARY, "STRING", "WSTRING", "TOD", "DT", "LTOD", "LDT")},
    "SWITCH": "a choice among values is CASE x OF 1: .. END_CASE", "POW": "write a ** b, or EXPT(a, b)",
    "POWER": "write a ** b, or EXPT(a, b)", "FABS": "write ABS", "SQR": "write x * x", "LOG10": "write LOG",
    "FLOOR": "TRUNC(x) drops the fraction",
    "CEIL": "TRUNC(x) drops the fraction", "FLOAT": "write TO_REAL(x)",
    "BOOL": "compare it: x <> 0", "STR": "write TO_STRING(x)", "STRLEN": "write LEN", "STRCAT": "write CONCAT",
    "STRCMP": "compare texts with =", "STRCPY": "assign it: a := b", "SUBSTR": "write MID(text, length, position)",
    "PRINT": _PRINT, "PRINTF": _PRINT, "PUTS": _PRINT, "SLEEP": _WAIT, "DELAY": _WAIT, "WAIT": _WAIT,
    "IIF": "write SEL(condition, if_false, if_true)"}
"""Functions of other languages, and what to write here."""
TYPES = {
    "BOOLEAN": "BOOL", "BIT": "BOOL", "INTEGER": "INT", "SHORT": "INT", "INT16": "INT", "LONG": "DINT", "INT32": "DINT",
    "LONGINT": "DINT", "INT64": "LINT", "INT8": "SINT", "UINT8": "USINT", "UINT16": "UINT", "UINT32": "UDINT",
    "UINT64": "ULINT", "FLOAT": "REAL", "FLOAT32": "REAL", "SINGLE": "REAL", "DOUBLE": "LREAL", "FLOAT64": "LREAL",
    "LONGREAL": "LREAL", "CARDINAL": "UDINT", "QWORD": "LWORD", "TEXT": "STRING",
}
"""Names of elementary types, and ours."""
_BY_DIALECT = (
    (r"PID|DERIVATIVE|RAMP|SEMA", "a block of Beremiz and OpenPLC: --dialect matiec or strucpp brings it"),
    (r"RTC", "a block of Beremiz, OpenPLC and TwinCAT: --dialect matiec, strucpp or twincat brings it"),
    (r"LOGGER|LOGLEVEL|HMI_(?:NODE|BOOL|[US]?INT|U?[DL]INT|REAL|STRING)|python_(?:eval|poll|gear)|csv_read_by_(?:string|int)|"
     r"csv_reload", "a block of Beremiz and OpenPLC: --dialect matiec brings it"),
    (r"(?:LEFT|RIGHT|MID|INSERT|DELETE|REPLACE|CONCAT)_EXT", "a function of RuSTy: --dialect rusty brings it"),
    (r"ROUND", "a function of RuSTy, which --dialect rusty brings; a conversion rounds, too: REAL_TO_DINT(x)"),
    (r"FRAC|LTRUNC|LMOD|MODABS|MODTURNS|(?:GET|SET|CSET|CLEAR)BIT32", "a function of TwinCAT: --dialect twincat brings it"),
    (r"AXIS_REF|ST_AxisStatus|MC_(?:Power|Reset|Move\w+|Home|Stop|Halt|Jog|Gear(?:In|InDyn|Out)|SetPosition|Direction|BufferMode)",
     "a name of TwinCAT's Tc2_MC2: --dialect twincat brings it, with axes that do not move"),
    (r"F_RaiseException", "a function of TwinCAT: --dialect twincat brings it"),
    (r"TIME_TO_(?:[NUM]?S|[MHD])", "a function of STruC++: --dialect strucpp brings it"),
)
"""Patterns of the names of types, blocks and functions that only a dialect brings, and what they are."""
_LIBRARIES = (
    (r"MC_\w+|AXIS_REF\w*|_MC_\w+", "PLCopen's motion control (Tc2_MC2, SM3_Basic and their like)"),
    (r"ADS(?:READ|WRITE|RDWRT|RDSTATE|WRTCTL|LOG)\w*|FB_(?:File|EOF|SimpleAdsLogEvent)\w*|T_AmsNetId\w*|T_AmsPort|"
     r"T_IPv4Addr|TwinCAT_SystemInfoVarList|_AppInfo|_TaskInfo|PlcTaskSystemInfo|PlcAppSystemInfo|GETCURTASKINDEX\w*|"
     r"F_GetSystemTime", "TwinCAT's Tc2_System"),
    (r"FB_(?:FormatString|LocalSystemTime|GetTimeZone\w*|TzSpecific\w*|LinkedList\w*|CTRL_\w+)|NT_\w+|T_Arg|F_"
     r"(?:SINT|INT|DINT|LINT|USINT|UINT|UDINT|ULINT|BYTE|WORD|DWORD|LWORD|BOOL|REAL|LREAL|STRING)|SYSTEMTIME_TO_\w+|"
     r"(?:BYTE|WORD|DWORD|LWORD)_TO_(?:BIN|OCT|DEC)STR|TIMESTRUCT|LREAL_TO_FMTSTR|DINT_TO_DECSTR|FindAnd(?:Delete|Replace|Split)|"
     r"T_FILETIME|FILETIME_TO_\w+", "TwinCAT's Tc2_Utilities"),
    (r"DCTIME\w*_TO_\w+|T_DCTIME\w*|DCTIMESTRUCT|F_GetCurDc\w+|F_GetActualDcTime\w*", "TwinCAT's Tc2_EtherCAT"),
    (r"FB_(?:Socket|Client|Server)\w+|T_HSERVER|TCPADS_\w+|F_CreateServerHnd", "TwinCAT's Tc2_TcpIp"),
    (r"ComBuffer|SerialLine\w+|(?:Send|Receive)(?:String|Byte|Data)(?:255)?|ClearComBuffer|EL6(?:in|out)Data\w+|ComError_t",
     "TwinCAT's Tc2_SerialCom"),
    (r"(?:FB|I|E|F|T|ST)_BA_\w+", "TwinCAT's Tc3_BA2"),
    (r"(?:FB|E|T|ST)_BACnet\w+", "TwinCAT's Tc3_BACnetRev14"),
    (r"(?:ST_|E_)?UA\w+|(?:ST|E)_UA\w+", "TwinCAT's Tc3_PLCopen_OpcUa"),
    (r"TcBaseModuleRegistered|ITcUnknown|IID_?\w*", "TwinCAT's Tc3_Module"),
    (r"FB_IotMqtt\w+", "TwinCAT's Tc3_IotBase"),
    (r"(?:FB|E|ST)_IPCDiag\w+", "TwinCAT's Tc3_IPCDiag"),
    (r"ST_(?:Plc)?DriveRef|FB_SoE\w+", "TwinCAT's Tc2_Drive"),
    (r"F_GetTaskInfo", "TwinCAT's Tc2_System"),
    (r"FB_SQL\w+|FB_PLCDB\w+", "TwinCAT's Tc3_Database"),
    (r"FB_MB(?:Read|Write|Diagnose)\w*", "TwinCAT's Tc2_ModbusSrv"),
    (r"Button|Led|TextCtrl|GetBoolString", "the svgui of older versions of Beremiz"),
    (r"CLOUD_(?:BEGIN|ADD_\w+)|DS18B20(?:_[2-5]_OUT)?|PWM_CONTROLLER|ADC_CONFIG|(?:ARDUINO|STM32)CAN_\w+|P1AM_INIT|P1_\d\w+|"
     r"MQTT_(?:(?:DIS)?CONNECT(?:_AUTH)?|RECEIVE|SEND|(?:UN)?SUBSCRIBE)|SM_(?:\d+\w+|BAS|HOME|INDUSTRIAL|RTD)|"
     r"TCP_(?:CLOSE|CONNECT|RECEIVE|SEND)", "OpenPLC Editor's libraries for boards, CAN, MQTT and TCP"),
    (r"FB_(?:EcSoE|EcCoE|EcGet|EcSet|EcMaster)\w*|ST_Ec\w+|Tc2_EtherCAT", "TwinCAT's Tc2_EtherCAT"),
    (r"FB_Json\w+|SJsonValue|SJsonAIterator|FB_Xml(?:Dom|Sax)\w+|SXml\w+", "TwinCAT's Tc3_JsonXml"),
    (r"FB_TcMessage|FB_TcAlarm|FB_TcEvent|TcEventSeverity|TcEventEntry|I_TcMessage|I_TcSourceInfo", "TwinCAT's Tc3_EventLogger"),
    (r"TcUnit|FB_TestSuite|TEST|TEST_FINISHED|Assert(?:Array[23d]*)?Equals\w*|AssertTrue|AssertFalse|WRITE_PROTECTED_\w+|GVL_TcUnit|"
     r"F_AnyToUnionValue|U_ExpectedOrActual|F_GetCpuCounterAs64bit", "TcUnit"),
    (r"Sys(?:Time|File|Mem|Sock|Com|Task|Target|Process|Cpu|Dir|Event|Lib)\w+|RTS_IEC_\w+|CmpErrors2?|TimerSwitch",
     "CODESYS's system libraries"),
    (r"FPU", "CODESYS's FloatingPointUtils"),
    (r"Stu", "CODESYS's StringUtils"),
    (r"GEN|GEN_MODE|PD|PID|PID_FIXCYCLE|DERIVATIVE|BASE64",
     "CODESYS's Util"),
)
"""Patterns of names, and the library that they come from."""


_DURATION = re.compile(r"T_?([0-9]+(?:[mun]s|[dhms]))", re.IGNORECASE)


def duration(name: str) -> str:
    """A hint for `T5s`; "" for any other name."""
    match = _DURATION.fullmatch(name)
    return f"a duration is written T#{match[1]}" if match else ""


def library_of(name: str) -> str:
    """A hint for an unknown name that comes from a library of a vendor; "" for any other."""
    for pattern, what in _BY_DIALECT:
        if re.fullmatch(pattern, name, re.IGNORECASE):
            return f"it is {what}"
    for pattern, library in _LIBRARIES:
        if re.fullmatch(pattern, name.rpartition(".")[2] if "." in name else name, re.IGNORECASE):
            return f"it comes from {library}, which fbvm does not bring: give its source, or one of your own, with the files"
    return ""


def format_hint(name: str, given: int) -> str:
    """A hint for BYTE_TO_STRING(b, '%02X'); "" for other calls."""
    if given != 2 or not re.fullmatch(r"\w+_TO_STRING", name, re.IGNORECASE):
        return ""
    return "the format is one of PC WORX, in no dialect here: leave it out, or write BYTE_TO_HEXSTR(x, 2, FALSE) or its like"


_COMMA = re.compile(r"(?<![\w.#,\[])([0-9]+),([0-9]+)(?![\w#,\]])")


def comma_hint(text: str) -> str:
    """How a number is written that stands with a comma in a piece of a program; "" if none does."""
    match = _COMMA.search(text)
    return f"the decimal sign of a number is a point: {match[1]}.{match[2]}" if match else ""

"""Words of PLCopen XML that import and export share, and the names of fbvm's own data in documents."""

from __future__ import annotations

KINDS = {"function": "FUNCTION", "functionBlock": "FUNCTION_BLOCK", "program": "PROGRAM"}
"""Values of `pouType` -> kinds of POUs."""
SECTIONS = {"localVars": "VAR", "tempVars": "VAR_TEMP", "inputVars": "VAR_INPUT", "outputVars": "VAR_OUTPUT",
            "inOutVars": "VAR_IN_OUT", "externalVars": "VAR_EXTERNAL", "globalVars": "VAR_GLOBAL"}
"""Elements with variables -> sections."""
QUALIFIERS = {"constant": "CONSTANT", "retain": "RETAIN", "nonretain": "NON_RETAIN", "persistent": "PERSISTENT"}
"""Attributes of such an element -> qualifiers of the section."""
_NAMES = ("BOOL BYTE WORD DWORD LWORD SINT INT DINT LINT USINT UINT UDINT ULINT REAL LREAL TIME DATE DT TOD "
          "ANY ANY_DERIVED ANY_ELEMENTARY ANY_MAGNITUDE ANY_NUM ANY_REAL ANY_INT ANY_BIT ANY_STRING ANY_DATE")
ELEMENTARY = frozenset(_NAMES.split())
"""Types that are empty elements of their name (TC6 2.01 elementaryTypes)."""
CODESYS = "http://www.3s-software.com/plcopenxml/"
"""What the names of the `addData` of CODESYS begin with."""
LOCATION = "urn:fbvm:location"
"""Name of fbvm's `addData` at a variable: an address that is no IEC location, such as D100."""
MNEMONIC = "urn:fbvm:mnemonic"
"""Name of fbvm's `addData` at a block: the mnemonic of the ladder instruction that the block stands for."""
SIGNS = {"OR": "OR", "XOR": "XOR", "AND": "AND", "EQ": "=", "NE": "<>", "LT": "<", "GT": ">", "LE": "<=", "GE": ">=", "ADD": "+",
         "SUB": "-", "MUL": "*", "DIV": "/", "MOD": "MOD"}
"""The functions of diagrams that are operators in text, and their signs."""

"""What the bits and words of an ETN21 are called, for charts and lists.

From W420 4-1 p80-85, 4-2 p88 and W421 6-6, 6-7.
"""

from __future__ import annotations

from fbvm.units.etn21 import map as at
from fbvm.units.etn21.codes import ERRNO, MEANING
from fbvm.units.etn21.map import Layout, Switch

SWITCH_NAMES = {
    Switch.UDP_OPEN: "UDP Open Request Switch",
    Switch.PASSIVE_OPEN: "TCP Passive Open Request Switch",
    Switch.ACTIVE_OPEN: "TCP Active Open Request Switch",
    Switch.SEND: "Send Request Switch",
    Switch.RECEIVE: "Receive Request Switch",
    Switch.CLOSE: "Close Request Switch",
}
FLAG_NAMES = {
    0: "Opening Flag",
    1: "Receiving Flag",
    2: "Sending Flag",
    3: "Closing Flag",
    13: "Data Received Flag",
    15: "Open Flag",
}
ERROR_NAMES = {2: "IP Address Setting Error", 3: "IP Address Table Error", 4: "IP Router Table Error", 5: "DNS Server Error",
               6: "Routing Table Error", 11: "SNTP Server Error", 12: "SMTP Server Error", 13: "POP Server Error",
               14: "Address Disagreement", 15: "EEPROM Error"}  # fmt: skip
"""Bits of n+18.  W420 4-1 p84; 2 to 4 from the EIP21 (W465)."""
PARAMETER_NAMES = {
    at.OPTION_AND_SOCKET: "Option and Socket Number",
    at.LOCAL_PORT: "Local Port",
    at.REMOTE_HOST: "Remote IP Address, high",
    at.REMOTE_HOST + 1: "Remote IP Address, low",
    at.REMOTE_PORT: "Remote Port",
    at.COUNT: "Number of Bytes to Send or Receive",
    at.DATA_ADDRESS: "Send or Receive Data Address, high",
    at.DATA_ADDRESS + 1: "Send or Receive Data Address, low",
    at.TIMEOUT: "Time-out Value",
    at.RESPONSE: "Response Code",
}


def descriptions(layout: Layout) -> dict[str, str]:
    """The name of each bit and word by its address, such as `CIO 1519.02`; area and socket 1 go unnumbered."""
    names = {
        f"CIO {layout.n}.02": "Socket Force-close Switch",
        f"CIO {layout.n + at.SERVICE_STATUS}.14": "Link Status",
        f"D{layout.m + at.LOCAL_IP}": "Local IP Address, high",
        f"D{layout.m + at.LOCAL_IP + 1}": "Local IP Address, low",
        f"A{at.INITIALIZING}.{layout.bit:02}": "CPU Bus Unit Initializing Flag",
        f"A{at.RESTART}.{layout.bit:02}": "CPU Bus Unit Restart Bit",
    }
    names |= {f"CIO {layout.n + at.ERROR_STATUS}.{bit:02}": name for bit, name in ERROR_NAMES.items()}
    names |= {f"CIO {layout.n + at.FINS_TCP_STATUS}.{connection - 1:02}": _numbered("FINS/TCP Connection Flag", connection)
              for connection in at.CONNECTIONS}  # fmt: skip
    for area in at.AREAS:
        word, first = layout.switches(area)
        for switch, name in SWITCH_NAMES.items():
            names[f"CIO {word}.{first + switch:02}"] = _numbered(name, area)
    for protocol in ("TCP", "UDP"):
        for socket in at.SOCKETS:
            for bit, name in FLAG_NAMES.items():
                names[f"CIO {layout.status(protocol, socket)}.{bit:02}"] = _numbered(f"{protocol} {name}", socket)
    for socket in at.SOCKETS:
        names[f"D{layout.m + at.BYTES_RECEIVED + socket}"] = _numbered("Number of Bytes Received", socket)
        names[f"D{layout.m + at.TCP_STATE + socket}"] = _numbered("TCP Connection State", socket)
    for area in at.AREAS:
        for offset, name in PARAMETER_NAMES.items():
            names[f"D{layout.parameters(area) + offset}"] = _numbered(name, area)
    return names


def meanings(layout: Layout) -> dict[str, dict[int, str]]:
    """What the values of words mean, by address: connection states and response codes."""
    states = {state.value: state.name for state in at.TcpState}
    codes = dict(MEANING) | {value: name for name, value in ERRNO.items() if value not in MEANING}
    return ({f"D{layout.m + at.TCP_STATE + socket}": states for socket in at.SOCKETS}
            | {f"D{layout.parameters(area) + at.RESPONSE}": codes for area in at.AREAS})  # fmt: skip


def _numbered(name: str, number: int) -> str:
    return name if number == 1 else f"{name} {number}"

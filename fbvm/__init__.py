"""fbvm runs PLC function blocks off the PLC.

    from fbvm import Plc, compile_files
    plc = Plc(compile_files(["pump.st"]).image)
    plc.write("Main.start", True)
    plc.run(until="Main.running", max_ns=5_000_000_000)

A name is imported when it is first used, so `import fbvm` is fast.  `fbvm.run.run` runs a PLC in real time.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from fbvm.base.version import VERSION

__version__ = VERSION

if TYPE_CHECKING:
    from fbvm.base.diagnostics import Diagnostic as Diagnostic
    from fbvm.base.diagnostics import Source as Source
    from fbvm.code.compiler import Compilation as Compilation
    from fbvm.code.compiler import compile_files as compile_files
    from fbvm.code.compiler import compile_sources as compile_sources
    from fbvm.code.compiler import compile_text as compile_text
    from fbvm.code.image import Image as Image
    from fbvm.engine.trap import Trap as Trap
    from fbvm.interchange.imported import Imported as Imported
    from fbvm.interchange.plcopen.read.importing import import_xml as import_xml
    from fbvm.interchange.plcopen.write.exporting import Exported as Exported
    from fbvm.interchange.plcopen.write.exporting import export_xml as export_xml
    from fbvm.machine.plc import Mode as Mode
    from fbvm.machine.plc import Plc as Plc
    from fbvm.machine.plc import Stopped as Stopped
    from fbvm.net.journal import Journal as Journal
    from fbvm.net.journal import JournalError as JournalError
    from fbvm.net.journal import open_journal as open_journal
    from fbvm.net.loop import LoopNetwork as LoopNetwork
    from fbvm.net.peers import ModbusPeer as ModbusPeer
    from fbvm.net.tcp import TcpNetwork as TcpNetwork
    from fbvm.record.draw.chart import chart as chart
    from fbvm.record.draw.chart import draw as draw
    from fbvm.record.export.pcapng import Capture as Capture
    from fbvm.record.recording.file_reader import RecordingFile as RecordingFile
    from fbvm.record.recording.file_scans import FileScans as FileScans
    from fbvm.record.recording.file_writer import RecordingWriter as RecordingWriter
    from fbvm.record.recording.journal_replay import Replay as Replay
    from fbvm.record.recording.recording import Recording as Recording
    from fbvm.record.trace.reader import Trace as Trace
    from fbvm.record.trace.recorder import Recorder as Recorder
    from fbvm.record.trace.writer import Depth as Depth
    from fbvm.record.trace.writer import TraceWriter as TraceWriter
    from fbvm.units.etn21.unit import Etn21 as Etn21
    from fbvm.units.openplc.unit import OpenPlc as OpenPlc
    from fbvm.units.port.noc import Noc as Noc
    from fbvm.units.port.tianxing import Tianxing as Tianxing
    from fbvm.watch.paths import UnknownPlace as UnknownPlace
    from fbvm.wire.link import Peer as Peer
    from fbvm.wire.modbus_server import ModbusServer as ModbusServer

_HOMES = {
    "base.diagnostics": ("Diagnostic", "Source"),
    "code.compiler": ("Compilation", "compile_files", "compile_sources", "compile_text"),
    "code.image": ("Image",),
    "engine.trap": ("Trap",),
    "net.journal": ("Journal", "JournalError", "open_journal"),
    "net.loop": ("LoopNetwork",),
    "net.peers": ("ModbusPeer",),
    "net.tcp": ("TcpNetwork",),
    "machine.plc": ("Mode", "Plc", "Stopped"),
    "interchange.plcopen.write.exporting": ("Exported", "export_xml"),
    "interchange.imported": ("Imported",),
    "interchange.plcopen.read.importing": ("import_xml",),
    "record.draw.chart": ("chart", "draw"),
    "record.export.pcapng": ("Capture",),
    "record.recording.file_reader": ("RecordingFile",),
    "record.recording.file_scans": ("FileScans",),
    "record.recording.file_writer": ("RecordingWriter",),
    "record.recording.journal_replay": ("Replay",),
    "record.recording.recording": ("Recording",),
    "record.trace.reader": ("Trace",),
    "record.trace.recorder": ("Recorder",),
    "record.trace.writer": ("Depth", "TraceWriter"),
    "units.etn21.unit": ("Etn21",),
    "units.port.noc": ("Noc",),
    "units.openplc.unit": ("OpenPlc",),
    "units.port.tianxing": ("Tianxing",),
    "watch.paths": ("UnknownPlace",),
    "wire.link": ("Peer",),
    "wire.modbus_server": ("ModbusServer",),
}
"""The public names by the module that defines them; a name is imported when it is first used."""
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}
__all__ = sorted([*_HOME_OF, "__version__"])


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'fbvm' has no attribute {name!r}")
    return getattr(importlib.import_module(f"fbvm.{_HOME_OF[name]}"), name)

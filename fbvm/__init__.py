"""fbvm runs PLC function blocks off the PLC."""

__version__ = "0.1.0"

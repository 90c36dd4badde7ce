"""What the adapter says of itself in the answer to `initialize`, from the protocol's type `Capabilities`."""

from __future__ import annotations

from fbvm.dap.session import Body
from fbvm.step.filters import FILTERS

_CAN = (
    "supportsConfigurationDoneRequest", "supportsFunctionBreakpoints", "supportsConditionalBreakpoints",
    "supportsHitConditionalBreakpoints", "supportsLogPoints", "supportsDataBreakpoints", "supportsDataBreakpointBytes",
    "supportsExceptionFilterOptions", "supportsExceptionInfoRequest", "supportsStepBack", "supportsRestartFrame",
    "supportsSteppingGranularity", "supportsSetVariable", "supportsSetExpression", "supportsEvaluateForHovers",
    "supportsCompletionsRequest", "supportsCancelRequest", "supportsBreakpointLocationsRequest", "supportsReadMemoryRequest",
    "supportsWriteMemoryRequest", "supportsTerminateRequest", "supportTerminateDebuggee", "supportsRestartRequest",
    "supportsLoadedSourcesRequest", "supportsValueFormattingOptions", "supportsClipboardContext",
)  # fmt: skip


def capabilities() -> Body:
    """The capabilities.  `goto` is not among them: it would skip statements, which a scan cannot."""
    filters = [{"filter": row.name, "label": row.label, "description": row.description, "default": row.default,
                "supportsCondition": bool(row.condition), **({"conditionDescription": row.condition} if row.condition else {})}
               for row in FILTERS]  # fmt: skip
    return {**dict.fromkeys(_CAN, True), "exceptionBreakpointFilters": filters, "completionTriggerCharacters": ["."],
            "supportedChecksumAlgorithms": ["SHA256"]}  # fmt: skip

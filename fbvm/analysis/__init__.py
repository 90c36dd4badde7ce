"""Programs that are being edited: diagnostics after each change, and what stands at a place of a text; no server, no editor."""

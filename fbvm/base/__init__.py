"""The ground floor: types, arithmetic, memory areas, addresses, diagnostics and their codes."""

"""Networks: in memory with virtual time (`loop`), or over the real TCP of the host (`tcp`)."""

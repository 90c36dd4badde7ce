"""The reference engine: an Image becomes Python source over the flat memory."""

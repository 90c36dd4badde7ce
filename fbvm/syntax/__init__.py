"""Front ends: text of a language in, tree out; and tree in, canonical text out."""

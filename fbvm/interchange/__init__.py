"""Project files of other tools, to sources of ours and back."""

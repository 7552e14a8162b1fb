"""The command line: one file per command, thin; everything they do can be done from Python, too."""

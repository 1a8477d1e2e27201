"""Reference solutions to more than 30 digits, and the scripts that made them. Report and tests read the same files."""

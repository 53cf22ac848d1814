"""The commands: parse, call one function, report, return an exit code."""

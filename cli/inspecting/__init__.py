"""What `dance-inspect` shows: the evidence, and the checks."""

from cli.inspecting.evidence import checks_table, evidence

__all__ = ["checks_table", "evidence"]

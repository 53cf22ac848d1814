"""The sample dance, made by a script, in two formats."""

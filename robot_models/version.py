"""The release of all packages of this distribution; CHANGELOG.md has a section for it."""

__version__ = "0.2.0"

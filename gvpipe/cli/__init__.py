"""The command line: ``gvpipe encode``, ``decode``, ``info`` and the others."""

from gvpipe.cli.commands import main

__all__ = ["main"]

"""``python -m gvpipe``."""

from gvpipe.cli.commands import main

main()

"""``python -m gvpipe``."""

from gvpipe.cli import main

main()

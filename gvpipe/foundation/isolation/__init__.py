"""Processes that gvpipe starts run no code of the current folder; those that read strangers' files see one folder alone."""

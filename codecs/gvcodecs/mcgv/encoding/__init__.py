"""From a sequence to a bitstream: the routes, and the search for the step that leaves the target error."""

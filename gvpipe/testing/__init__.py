"""For those who write a codec: what every codec promises, sequences to try it on, and a package to begin with."""

from gvpipe.testing.checking import check_codec
from gvpipe.testing.new_codec import new_codec
from gvpipe.testing.promises import PROMISES, BrokenPromise, Promise, Subject

__all__ = ["PROMISES", "BrokenPromise", "Promise", "Subject", "check_codec", "new_codec"]

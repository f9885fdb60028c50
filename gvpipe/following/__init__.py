"""Following one mesh through frames whose connectivity changes."""

from gvpipe.following.follow import MeshFrames, follow
from gvpipe.following.places import Places, places_on
from gvpipe.following.runs import Run

__all__ = ["MeshFrames", "Places", "Run", "follow", "places_on"]

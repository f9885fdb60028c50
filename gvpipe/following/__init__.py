"""Following one mesh through frames whose connectivity changes."""

from gvpipe.following.follow import MeshFrames, follow
from gvpipe.following.places import OwnMesh, Places
from gvpipe.following.runs import Run

__all__ = ["MeshFrames", "OwnMesh", "Places", "Run", "follow"]

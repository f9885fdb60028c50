"""Geometry videos in Blender: import, play with the timeline, bake, export.

Nothing here decodes or encodes: that is gvpipe, which is imported when a file is opened first.
"""

from . import baking, exporting, importing, playing

ROOMS = (playing, importing, baking, exporting)


def register() -> None:
    """Called by Blender when the extension is switched on."""
    for room in ROOMS:
        room.register()


def unregister() -> None:
    """Called by Blender when it is switched off; meshes keep the frame that they show."""
    for room in reversed(ROOMS):
        room.unregister()

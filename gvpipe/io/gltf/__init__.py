"""glTF and GLB files: still ones as frames, animated ones as sequences, both ways."""

from __future__ import annotations

from gvpipe.io.gltf.reader import GltfLoader, read_animated, read_clips, read_poses
from gvpipe.io.gltf.skin_writing import write_skinned
from gvpipe.io.gltf.writer import encode_glb, write_animated

__all__ = ["GltfLoader", "encode_glb", "read_animated", "read_clips", "read_poses", "write_animated", "write_skinned"]

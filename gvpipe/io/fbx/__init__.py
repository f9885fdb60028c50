"""FBX scenes (.fbx) by ufbx: skins, blend shapes, node animation, geometry caches, several takes.

It is experimental, as the Python package of ufbx is.

Source: S. Raivio, ufbx (https://github.com/ufbx/ufbx), which evaluates all motion itself.
"""

"""Published codecs of animated meshes, written small, on the building blocks of gvpipe, and decoded for real."""

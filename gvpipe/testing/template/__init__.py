"""A package with a codec, which `gvpipe.testing.new_codec` writes under another name."""

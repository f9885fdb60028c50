"""Rate control: the quality, and the codec, that meets a target."""

"""Pictures and video: JPEG, H.264, and films that people look at."""

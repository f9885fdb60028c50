"""meshopt's compression of glTF's buffer views: EXT_meshopt_compression, KHR_meshopt_compression."""

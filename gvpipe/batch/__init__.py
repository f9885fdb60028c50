"""Many sequences, a geometry video each: found (`inputs`), encoded side by side (`runs`), written down (`manifest`)."""

"""What an asset has beside moving positions: attributes, fields, parts, materials, images, polygons and metadata."""

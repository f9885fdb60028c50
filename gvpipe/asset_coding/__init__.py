"""What lies beside any codec's sections: an asset's attributes, fields, parts, polygons, materials, images and metadata."""

"""Pictures of mesh sequences, painted on the CPU; see docs/render.md. No display and no GPU are needed.

camera            where a picture is taken from, and how a motion is framed
raster_kernels    which triangle every sample sees
shading_kernels   normals, light, and the mean over a pixel's samples
colours           sRGB, materials, the colour map of errors
renderer          a mesh and a camera in, a picture out
error_map         vertex errors as colours, and their legend
pictures          a sequence to PNG, GIF or MP4
"""

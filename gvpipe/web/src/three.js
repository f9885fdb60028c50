/** Geometry videos in scenes of three.js, and all that the module without it gives. */

export { GeometryVideo, GeometryVideoError } from "./geometry_video.js";
export { GeometryVideoLoader } from "./three/geometry_video_loader.js";
export { GeometryVideoMesh } from "./three/geometry_video_mesh.js";

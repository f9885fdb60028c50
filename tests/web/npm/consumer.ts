// What a project in TypeScript writes, and what its compiler must refuse.
import { PerspectiveCamera, Ray, Scene, type Mesh } from "three";
import { GeometryVideo, GeometryVideoError, type Attribute } from "gvpipe";
import { GeometryVideoElement } from "gvpipe/element";
import { GeometryVideoLoader, GeometryVideoMesh } from "gvpipe/three";

export async function read(source: string | Blob): Promise<Float32Array> {
  const video = await GeometryVideo.load(source);
  const uv: Attribute | undefined = video.attributes.get("uv");
  const values = await video.fields.get("height")?.frame(0);
  await video.play((positions: Float32Array, k: number) => positions[3 * k], { loop: true, rate: 2 });
  // @ts-expect-error it is read only
  video.fps = 25;
  // @ts-expect-error a frame is a number
  await video.frame("first");
  // @ts-expect-error videos are loaded, not made
  new GeometryVideo();
  return video.frame(uv?.indices?.[0] ?? values?.length ?? 0, new Float32Array(3 * video.vertexCount));
}

export async function show(scene: Scene, camera: PerspectiveCamera): Promise<GeometryVideoMesh> {
  const loader = new GeometryVideoLoader().setOptions({ scale: 2, centre: [0, 1, 0] });
  const mesh = await loader.loadAsync("walk.mp4");
  const plain: Mesh = mesh;
  scene.add(plain, await GeometryVideoMesh.create(await GeometryVideo.load("other.mp4"), { ownClock: true }));
  camera.lookAt(mesh.geometry.boundingSphere!.center);
  mesh.addEventListener("frame", ({ frame }) => frame.toFixed(0));
  mesh.loop = true;
  mesh.lod = "auto";
  await mesh.setLevel(mesh.video.levels.length - 1);
  mesh.currentTime = mesh.duration / 2;
  const range: [number, number] | null = await mesh.showField("height", { colormap: "magma", range: [0, 1] });
  // @ts-expect-error no such colour map
  await mesh.showField("height", { colormap: "rainbow" });
  await mesh.showField("height", { scale: "log" });
  const isMoved: boolean = await mesh.setWarp("displacement", 10);
  const picked: number | null | undefined = mesh.pick(new Ray(camera.position, mesh.position))?.vertex;
  mesh.setFlatShading(isMoved && picked === 0);
  await mesh.play();
  mesh.update(range?.[1] ?? 0.04);
  return mesh;
}

export function control(): number {
  const element = document.createElement("geometry-video");
  const same: GeometryVideoElement = element;
  same.addEventListener("frame", (event) => event.detail.toFixed(0));
  same.addEventListener("click", (event) => event.clientX);
  same.addEventListener("probe", ({ detail }) => detail.value?.toFixed(detail.vertex ?? detail.frame));
  same.scale = same.warp || same.camera?.[0] ? "log" : "linear";
  same.playbackRate = 2;
  // @ts-expect-error it follows from the file
  same.duration = 3;
  if (same.error instanceof GeometryVideoError && same.error.kind === "load") return NaN;
  return same.buffered.length ? same.buffered.end(0) : same.currentTime;
}

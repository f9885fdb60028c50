/** Geometry videos in scenes of three.js. */

import type { BufferGeometry, Loader, LoadingManager, Material as ThreeMaterial, Mesh, Object3DEventMap, Ray, Texture as ThreeTexture } from "three";
import type { Cut, GeometryVideo, Picked, Source } from "./geometry-video.js";

export * from "./geometry-video.js";

export interface GeometryVideoMeshOptions {
  /** In model units, the origin of the geometry. [0, 0, 0] if not given. */
  centre?: [number, number, number];
  /** Of the geometry; 1: model units. */
  scale?: number;
  /** false: Lambert materials in place of standard ones, for renderers that run on the processor. */
  gloss?: boolean;
  /** Of textures. */
  anisotropy?: number;
  /** What metal reflects; null: the scene's environment. */
  environment?: () => ThreeTexture | null;
  /** true: it plays by the page's clock, without `update`. */
  ownClock?: boolean;
}

export interface GeometryVideoMeshEvents extends Object3DEventMap {
  play: {};
  playing: {};
  pause: {};
  seeking: {};
  seeked: {};
  timeupdate: {};
  /** It waits for frames that are on their way, or not yet written. */
  waiting: {};
  /** Such frames have come. */
  progress: {};
  /** Such a file is finished. */
  durationchange: {};
  ended: {};
  ratechange: {};
  volumechange: {};
  /** `notes` has changed. */
  notes: {};
  /** A frame is shown. */
  frame: { frame: number };
  /** Another level of detail is shown; geometry and materials are new. */
  levelchange: { level: number };
  /** Another shot of a capture is shown; geometry and materials are new. */
  shotchange: { shot: number };
  /** Late values of a field, or textures, have come: the scene is to be drawn anew. */
  change: {};
  error: { error: Error };
}

type PlainMesh = Mesh<BufferGeometry, ThreeMaterial | ThreeMaterial[], GeometryVideoMeshEvents>;
declare const MeshOfVideo: new () => Omit<PlainMesh, "clone">;

/** A video as a mesh: its geometry follows what plays. Vertices are split where attributes need it. */
export class GeometryVideoMesh extends MeshOfVideo {
  private constructor();
  /** The video is closed with the mesh. */
  static create(video: GeometryVideo, options?: GeometryVideoMeshOptions): Promise<GeometryVideoMesh>;
  readonly video: GeometryVideo;
  /** (V, 3): the frame shown, in the geometry's units. */
  readonly framePositions: Float32Array;
  /** What is not shown as it should be, a line each. */
  readonly notes: string[];
  /** Goes on by so many seconds: what plays shows the frame that is due, once it is decoded. */
  update(delta: number): void;
  /** Plays on from the frame shown, from the start if that is the last. */
  play(): Promise<void>;
  pause(): void;
  /** Shows frame k, and pauses. Of many calls in a row the last counts. */
  seek(k: number): Promise<void>;
  /** "auto": a coarser level of detail where the page cannot keep up while it plays, a finer one again once it can; else the level. */
  lod: number | "auto";
  /** Shows another level of detail; a promise that it is shown. */
  setLevel(level: number | "coarsest"): Promise<void>;
  readonly currentFrame: number;
  /** The frame shown, or the one that is sought. */
  readonly soughtFrame: number;
  /** Seconds. To set it shows the frame of that time; what plays goes on there. */
  currentTime: number;
  readonly duration: number;
  readonly paused: boolean;
  readonly ended: boolean;
  readonly seeking: boolean;
  loop: boolean;
  /** 0.0625 to 16; 1 is the video's own. */
  playbackRate: number;
  /** Whether what plays is silent; while it is heard, frames follow the sound's clock. */
  muted: boolean;
  /** Of the sound, 0 to 1. */
  volume: number;
  readonly partNames: string[];
  /** Hides the parts of these names, and shows all others. */
  hide(names: string | Iterable<string>): void;
  /** Edges of polygons, without the diagonals of their triangles. */
  setWireframe(visible: boolean): void;
  /** true: each triangle has one normal, so that its edges show. */
  setFlatShading(isFlat: boolean): void;
  /**
   * Moves vertices by a field of two or three components at vertices, `scale` times as far; null: by none. A promise whether it is
   * shown; false if another call came since.
   */
  setWarp(name: string | null, scale?: number): Promise<boolean>;
  /**
   * Leaves out what lies on one side of a plane across an axis; null: nothing. The section of a volume is filled. The renderer needs
   * `localClippingEnabled`. A promise whether it is shown; false if another call came since.
   */
  setClip(cut: Cut | null): Promise<boolean>;
  /** (n, 3, 3) corners of the triangles of that section, model units, the file's origin apart; empty where the cut is hollow. */
  readonly section: Float32Array;
  /** Where the plane of the cut is, in the geometry's units: across axis 0, 1 or 2; `sign` 1 leaves out what lies above. Or null. */
  readonly cut: { axis: number; place: number; sign: number } | null;
  updateMatrixWorld(force?: boolean): void;
  /** The box that the motion stays in, displacements with it, model units. It may grow. */
  readonly bounds: { min: [number, number, number]; max: [number, number, number] };
  /** What of the frame shown a ray meets first, hidden parts apart, in the geometry's units; of a triangle, its nearest vertex. */
  pick(ray: Ray): Picked | null;
  /** Shows a field in colours; null: the materials. A promise of the range; null if another call came since. */
  showField(
    name: string | null,
    options?: {
      colormap?: "viridis" | "magma" | "coolwarm" | "gray";
      range?: [number, number] | null;
      /** "log": colours follow the logarithm, if the range lies above 0. */
      scale?: "linear" | "log";
    },
  ): Promise<[number, number] | null>;
  /** Values of the first and the last colour of the field that is shown. */
  readonly fieldRange: [number, number];
  /** A mesh that shares geometry and materials, and so moves with this one. */
  clone(recursive?: boolean): Mesh;
  /** Frees the video, and what the GPU has of it. */
  dispose(): void;
}

export class GeometryVideoLoader extends Loader<GeometryVideoMesh> {
  constructor(manager?: LoadingManager);
  options: GeometryVideoMeshOptions;
  setOptions(options: GeometryVideoMeshOptions): this;
  load(
    url: string,
    onLoad: (mesh: GeometryVideoMesh) => void,
    onProgress?: (event: ProgressEvent) => void,
    onError?: (error: unknown) => void,
  ): void;
  parseAsync(source: Source): Promise<GeometryVideoMesh>;
}

/** A geometry video: its mesh, and the positions of any frame. */

/** A file whose bytes a function gives, fewer where it ends; `stop` may be Infinity. */
export interface RangeSource {
  /** For messages. */
  readonly name: string;
  fetchRange(start: number, stop: number, signal: AbortSignal): Promise<{ data: Uint8Array; size: number }>;
}

export type Source = string | URL | Blob | ArrayBuffer | Uint8Array | RangeSource;
export type Domain = "vertex" | "corner" | "triangle" | "part";
export type Kind = "uv" | "normal" | "tangent" | "color" | "scalar" | "vector" | "label";
export type Values =
  | Float32Array
  | Float64Array
  | Int8Array
  | Uint8Array
  | Int16Array
  | Uint16Array
  | Int32Array
  | Uint32Array;

export type ErrorKind = "load" | "not-geometry-video" | "newer" | "stripped" | "truncated" | "corrupt" | "unsupported";

/** What the player raises on purpose; `message` is one line for users. */
export class GeometryVideoError extends Error {
  constructor(kind: ErrorKind, message: string);
  readonly kind: ErrorKind;
}

export interface PlayOptions {
  /** 1 is the video's own speed. */
  rate?: number;
  loop?: boolean;
  /** Called at the end, if it does not loop. */
  ended?: () => void;
  /** Called if a frame later on cannot be decoded. */
  failed?: (error: Error) => void;
  /** A clock in place of the page's: it calls `tick` once, at its next step, with milliseconds. */
  nextTick?: (tick: (now: number) => void) => void;
  /** Called at each step of the clock, with whether the frame that is due was there. */
  ticked?: (now: number, isThere: boolean) => void;
  /** Called when it waits for frames that are on their way or not yet written, and when it goes on. */
  waits?: (isWaiting: boolean) => void;
  /** Gives another position, in frames since the start, in place of what the time makes of it; null: none. */
  clock?: (position: number) => number | null;
}

/** A named mesh of the video: ranges `[start, stop]` of its vertices and triangles. */
export interface Part {
  readonly name: string;
  readonly vertices: [number, number];
  readonly triangles: [number, number];
  /** Index into `materials`. */
  readonly material: number | null;
  readonly parent: string;
}

/** Numbers that stay the same in every frame. */
export interface Attribute {
  readonly name: string;
  readonly domain: Domain;
  readonly kind: Kind;
  readonly components: number;
  readonly unit: string;
  /** As numpy names it, such as `float32`. */
  readonly type: string;
  /** Rows of `components`. */
  readonly values: Values;
  /** The row of each corner, vertex, triangle or part; null: its own. */
  readonly indices: Uint32Array | null;
  /** What colours of this type count as 1. */
  readonly fullScale: number;
}

/** Numbers that change from frame to frame. */
export interface Field {
  readonly name: string;
  /** Of a volume `point` or `cell`. */
  readonly domain: "vertex" | "triangle" | "point" | "cell";
  readonly kind: Kind;
  readonly components: number;
  readonly unit: string;
  readonly type: string;
  readonly frameCount: number;
  readonly rowCount: number;
  /** Largest difference of a value from the source's; degrees of normals. */
  readonly bound: number;
  /** Low and high of all components; null if all are holes. */
  readonly range: [number, number] | null;
  /** Rows of `components` in frame k, NaN for holes. */
  frame(k: number): Promise<Values>;
}

/** Cells inside of a surface. Points are numbered: first the surface's vertices, then inner points. */
export interface Grid {
  /** VTK's number of each cell's type. */
  readonly types: Uint8Array;
  /** Where each cell's nodes start, and the end. */
  readonly offsets: Int32Array;
  readonly nodes: Int32Array;
  /** The surface's triangle whose numbers a cell has; -1: an inner cell. */
  readonly triangles: Int32Array;
  /** Numbers of the inner cells. */
  readonly inner: Int32Array;
}

/** What lies inside of a surface. It is decoded when it is asked for. */
export interface Volume {
  readonly cellCount: number;
  /** Of inner points. */
  readonly pointCount: number;
  /** Largest error of a coordinate of an inner point. */
  readonly bound: number;
  /** Decodes the cells. */
  open(): Promise<Grid>;
  /** Coordinates of the inner points, once it is open; null: there are none. */
  readonly points: Field | null;
  /** Numbers of inner points, or of inner cells, once it is open; null: there are none of that name. */
  number(domain: "point" | "cell", name: string): { readonly field: Field | null; readonly moves: boolean } | null;
}

/** A plane across an axis. */
export interface Cut {
  /** 0, 1, 2: x, y, z. */
  readonly axis: number;
  /** Along the axis, model units with the file's origin; a part of the first frame's box if `isPart`. */
  readonly place: number;
  readonly isPart: boolean;
  /** 1: what lies above is left out; -1: what lies below. */
  readonly sign: 1 | -1;
}

/** A point of the mesh that was pointed at, or of the section of a cut. */
export interface Picked {
  /** The nearest vertex of the triangle, or of the points; null: a point inside, of a section. */
  readonly vertex: number | null;
  /** null: the mesh has no triangles, or it is a section. */
  readonly triangle: number | null;
  /** Name of its part; null if there are none. */
  readonly part: string | null;
  /** Of a section: a point of the grid near it. The surface's vertices come first, then inner points. */
  readonly point?: number;
  /** Of a section: the cell. */
  readonly cell?: number;
}

export interface Texture {
  /** Index into `images`. */
  readonly image: number;
  /** Name of the attribute with its coordinates. */
  readonly uv: string;
  readonly scale: number;
  readonly wrap: ["repeat" | "mirror" | "clamp", "repeat" | "mirror" | "clamp"];
  readonly filter: "linear" | "nearest";
  readonly offset: [number, number];
  readonly rotation: number;
  readonly tiling: [number, number];
}

export interface Material {
  readonly name: string;
  readonly base_color: [number, number, number, number];
  readonly metallic: number;
  readonly roughness: number;
  readonly emissive: [number, number, number];
  readonly alpha_mode: "opaque" | "mask" | "blend";
  readonly alpha_cutoff: number;
  readonly double_sided: boolean;
  readonly unlit: boolean;
  readonly base_color_texture: Texture | null;
  readonly metallic_roughness_texture: Texture | null;
  readonly normal_texture: Texture | null;
  readonly occlusion_texture: Texture | null;
  readonly emissive_texture: Texture | null;
  /** Factor of `emissive`, which is in it already. */
  readonly emissive_strength: number;
  readonly clearcoat: number;
  readonly clearcoat_texture: Texture | null;
  readonly clearcoat_roughness: number;
  readonly clearcoat_roughness_texture: Texture | null;
  readonly clearcoat_normal_texture: Texture | null;
  readonly transmission: number;
  readonly transmission_texture: Texture | null;
  readonly thickness: number;
  readonly thickness_texture: Texture | null;
  /** 0: without end. */
  readonly attenuation_distance: number;
  readonly attenuation_color: [number, number, number];
  readonly ior: number;
  readonly specular: number;
  readonly specular_texture: Texture | null;
  readonly specular_color: [number, number, number];
  readonly specular_color_texture: Texture | null;
  readonly sheen_color: [number, number, number];
  readonly sheen_color_texture: Texture | null;
  readonly sheen_roughness: number;
  readonly sheen_roughness_texture: Texture | null;
  readonly iridescence: number;
  readonly iridescence_texture: Texture | null;
  readonly iridescence_ior: number;
  readonly iridescence_thickness_minimum: number;
  readonly iridescence_thickness_maximum: number;
  readonly iridescence_thickness_texture: Texture | null;
  readonly anisotropy_strength: number;
  readonly anisotropy_rotation: number;
  readonly anisotropy_texture: Texture | null;
  readonly dispersion: number;
  readonly diffuse_transmission: number;
  readonly diffuse_transmission_texture: Texture | null;
  readonly diffuse_transmission_color: [number, number, number];
  readonly diffuse_transmission_color_texture: Texture | null;
}

export interface Image {
  readonly name: string;
  readonly mediaType: string;
  readonly data: Uint8Array;
}

/** A run of frames of one connectivity. */
export interface Shot {
  /** The first frame. */
  readonly start: number;
  readonly frames: number;
  readonly vertices: number;
  readonly triangles: number;
}

/** Images with a picture for each frame. */
export interface MovingImages {
  /** What is not shown, a line each. */
  readonly notes: string[];
  /** Called with a line when a track is given up. */
  lost: (note: string) => void;
  readonly isEmpty: boolean;
  /** That the pictures of a frame are here. */
  ready(frame: number): Promise<void>;
  /** The pictures of a frame by number of the image, until others are asked for; null if one is not here. */
  show(frame: number): Map<number, ImageBitmap> | null;
}

export class GeometryVideo {
  private constructor();
  /**
   * Rejects with a `GeometryVideoError` if it cannot be fetched, or is no geometry video that browsers play. A `level` of detail above
   * 0 is a coarser mesh, without attributes and fields. `signal` ends loading; then it rejects with the signal's reason.
   */
  static load(source: Source, options?: { level?: number | "coarsest"; signal?: AbortSignal }): Promise<GeometryVideo>;
  readonly frameCount: number;
  /** Frames per second. */
  readonly fps: number;
  /** What positions count from, model units: a point of the source. */
  readonly origin: [number, number, number];
  readonly vertexCount: number;
  readonly triangleCount: number;
  /** In order; a file whose vertices and triangles never change has one. */
  readonly shots: Shot[];
  /**
   * The number of the shot that is shown: of the frame that was given last. Numbers of vertices and triangles, `indices`, `basePoints`
   * and what lies beside positions are its own.
   */
  readonly shot: number;
  /** The number of a frame's shot. */
  shotOf(k: number): number;
  /** The number that a frame of the shot that is shown has in it, which is that of frames of its fields. */
  ownFrame(k: number): number;
  /** Bytes of the file. */
  readonly byteLength: number;
  /** Seconds; `Infinity` while the file is still written. */
  readonly duration: number;
  /** Whether the file is still written: `frameCount` grows. */
  readonly isLive: boolean;
  /** The frame that is shown first: 0; of a file that is still written, that where its latest clip began. */
  readonly startFrame: number;
  /** Called when frames have come to a file that is still written, and when it is finished. */
  grown: () => void;
  /** Called when it cannot be followed any longer. */
  lost: (error: Error) => void;
  /**
   * Hear of both, beside those two functions; returns what ends it. Of a capture, `ready` is called before a frame is shown, with its
   * shot and its number in it, and waited for; `closed` when a shot is let go of.
   */
  follow(follower: {
    grown: () => void;
    lost: (error: Error) => void;
    ready?: (video: GeometryVideo, shot: number, frame: number) => Promise<unknown>;
    closed?: (shot: number) => void;
  }): () => void;
  /** Seconds that play without a wait for the file: `[start, end]` of each stretch. */
  readonly buffered: [number, number][];
  /** Bits per second. */
  readonly bitRate: number;
  /** What is heard with it; `start` in seconds after frame 0, `url` of a file, or a track of one, that browsers play. */
  readonly sound: {
    readonly codec: "aac" | "opus";
    readonly channels: number;
    readonly rate: number;
    readonly seconds: number;
    readonly start: number;
    readonly url: string;
  } | null;
  /** (T, 3): vertices of triangles, counter-clockwise. */
  readonly indices: Uint32Array;
  /** (V, 3): frame 0 on the file's lattice; vertices with equal rows are one point of the surface. */
  readonly basePoints: Int32Array;
  /** Vertices of each level of detail, the whole mesh first. */
  readonly levels: number[];
  /** The level of detail that is shown; 0: the whole mesh. */
  readonly level: number;
  /**
   * Shows another level of detail from now on: numbers of vertices and triangles, `indices`, `basePoints` and what lies beside
   * positions change. What plays goes on.
   */
  setLevel(level: number | "coarsest"): Promise<void>;
  /** Whether a part of the file is on its way. */
  readonly isWaiting: boolean;
  /** The box that the motion stays in, model units. It may grow as segments of the file are read. */
  readonly bounds: { min: [number, number, number]; max: [number, number, number] };
  readonly parts: Part[];
  readonly attributes: Map<string, Attribute>;
  readonly fields: Map<string, Field>;
  readonly materials: Material[];
  readonly images: Image[];
  /** Corners of each polygon; null if all are triangles. */
  readonly polygons: Int32Array | null;
  /** What lies inside of the surface; null: nothing. */
  readonly volume: Volume | null;
  readonly metadata: Record<string, unknown>;
  /** What of the file is not read, a line each. */
  readonly notes: string[];
  /** (V, 3) of frame k, model units, in `positions` if it is given. It ends `play`. Calls that overlap are answered in turn. */
  frame(k: number, positions?: Float32Array): Promise<Float32Array>;
  /** Plays on from the frame last shown. `show` gets (V, 3) in an array that is used again for the next frame. */
  play(show: (positions: Float32Array, k: number) => void, options?: PlayOptions): Promise<void>;
  pause(): void;
  /**
   * Has the pictures of images that move from now on, those of these numbers: no frame is given before they are here. Of a capture,
   * those of the shot that is shown. They are closed with the video.
   */
  openMoving(wanted: Iterable<number>): Promise<MovingImages>;
  /** Frees it; it is of no use afterwards. What is under way rejects with an `AbortError`. */
  close(): void;
}

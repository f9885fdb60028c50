/** The element `<geometry-video>`; to import this defines it. */

import type { Cut, GeometryVideo, Picked, Shot, Source } from "./geometry-video.js";

export * from "./geometry-video.js";

export interface GeometryVideoElementEventMap extends Omit<HTMLElementEventMap, "error"> {
  /** All is there to play. */
  ready: CustomEvent<null>;
  /** The number of the frame that is shown. */
  frame: CustomEvent<number>;
  /** Azimuth and elevation, degrees, that a user or `turnTo` turned to. */
  viewchange: CustomEvent<[number, number]>;
  /** Names of the parts that are hidden, after a choice in the menu. */
  partschange: CustomEvent<string[]>;
  /** The level of detail that is shown. */
  levelchange: CustomEvent<number>;
  /** The number of the shot that is shown, of a capture. */
  shotchange: CustomEvent<number>;
  /** The cut that is shown, or null. */
  clip: CustomEvent<Cut | null>;
  /** A point was clicked on. */
  probe: CustomEvent<Probed>;
  /** `detail` is a `GeometryVideoError` if the file or its server is at fault. */
  error: CustomEvent<Error>;
}

export interface Probed extends Picked {
  readonly frame: number;
  /** Of the field shown, vectors by their length; null if none is shown, or it has no value there. */
  readonly value: number | null;
}

/** Stretches of time, in seconds. */
export interface TimeRangesLike {
  readonly length: number;
  start(index: number): number;
  end(index: number): number;
}

/** Members are as in `HTMLMediaElement` where it has them. */
export class GeometryVideoElement extends HTMLElement {
  constructor();
  /** An address, or `#id` of an element that holds the file as base64 text. */
  src: string;
  readonly currentSrc: string;
  autoplay: boolean;
  loop: boolean;
  /** Whether what plays is silent. */
  muted: boolean;
  /** 0 to 1. */
  volume: number;
  /** 0.0625 to 16; attribute `speed`. */
  playbackRate: number;
  readonly speed: number;
  /** "auto", or the number of a level of detail; attribute `lod`. */
  lod: number | "auto";
  /** Seconds: where the frame shown begins, or the one that is sought. To set it keeps what plays playing. */
  currentTime: number;
  /** Seconds; NaN while nothing is loaded. */
  readonly duration: number;
  readonly paused: boolean;
  readonly ended: boolean;
  readonly seeking: boolean;
  readonly buffered: TimeRangesLike;
  readonly seekable: TimeRangesLike;
  /** 0: nothing is there, 1: metadata, 4: it can play. */
  readonly readyState: number;
  readonly error: Error | null;
  /** Until a file is loaded, it waits for it. Rejects with an AbortError if it is paused before it plays. */
  play(): Promise<void>;
  pause(): void;
  load(source?: Source): Promise<void>;

  readonly video: GeometryVideo | null;
  readonly currentFrame: number;
  /** Runs of frames of one connectivity; [] while nothing is loaded. */
  readonly shots: Shot[];
  /** The number of the shot that is shown. */
  readonly shot: number;
  /** Shows frame k, and pauses; while a file loads, once it is there. Of many calls in a row the last counts. */
  seek(k: number): Promise<void>;
  readonly colormap: string;
  readonly range: [number, number] | null;
  /** How colours follow values; attribute `scale`. */
  scale: "linear" | "log";
  /** The field that moves vertices, and how far; attribute `warp`, such as "displacement:10". */
  readonly warp: { name: string; scale: number } | null;
  /** The plane that cuts the mesh; attribute `clip`, such as "x=0.3", "y=30%" or "-x=0.3". */
  readonly clip: Cut | null;
  /** (n, 3, 3) corners of the triangles of the cut's section, model units, the file's origin apart; empty where it is hollow. */
  readonly section: Float32Array;
  /** Azimuth and elevation of the first view, degrees, or null: the player's own; attribute `camera`. */
  readonly camera: [number, number] | null;
  /** Azimuth and elevation of the view as it is, degrees; null while nothing is loaded. */
  readonly view: [number, number] | null;
  /** Turns the camera about its target; degrees. */
  turnTo(azimuth: number, elevation: number): void;
  readonly hiddenParts: Set<string>;
  /** Hides the parts of these names, and shows all others. */
  hide(names: string | Iterable<string>): void;
  /** (4, 4) by columns: from model units to clip space. */
  readonly projection: number[] | null;
  /** The picture as a PNG file. */
  still(): Promise<Blob | null>;

  addEventListener<K extends keyof GeometryVideoElementEventMap>(
    type: K,
    listener: (this: GeometryVideoElement, event: GeometryVideoElementEventMap[K]) => unknown,
    options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener(type: string, listener: EventListenerOrEventListenerObject, options?: boolean | AddEventListenerOptions): void;
  removeEventListener<K extends keyof GeometryVideoElementEventMap>(
    type: K,
    listener: (this: GeometryVideoElement, event: GeometryVideoElementEventMap[K]) => unknown,
    options?: boolean | EventListenerOptions,
  ): void;
  removeEventListener(type: string, listener: EventListenerOrEventListenerObject, options?: boolean | EventListenerOptions): void;
}

declare global {
  interface HTMLElementTagNameMap {
    "geometry-video": GeometryVideoElement;
  }
}

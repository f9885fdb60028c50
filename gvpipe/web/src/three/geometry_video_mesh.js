/**
 * A geometry video as a mesh of three.js: its geometry frame by frame, its materials, the parts and the field that are shown.
 *
 *     const mesh = await new GeometryVideoLoader().loadAsync("walk.mp4");
 *     scene.add(mesh);
 *     mesh.play();
 *     renderer.setAnimationLoop(() => { mesh.update(clock.getDelta()); renderer.render(scene, camera) });
 */

import {
  Box3,
  BufferAttribute,
  BufferGeometry,
  DynamicDrawUsage,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  Plane,
  Points,
  PointsMaterial,
  Sphere,
  Vector3,
} from "three";
import { stretch } from "../format/points.js";
import { Playback, checkSeconds } from "../playback.js";
import { FieldColours, fieldMaterial, isLogarithmic, linearTable, rangeOf } from "./field_colours.js";
import { FilledCut } from "./filled_cut.js";
import { makeMaterial, plainMaterial } from "./materials.js";
import { Normals, groupCorners, groupVertices } from "./normals.js";
import { PartIndex } from "./part_index.js";
import { pickPoint, pickTriangle } from "./picking.js";
import { polygonEdges } from "./polygon_edges.js";
import { cornerEntries, splitVertices } from "./render_vertices.js";
import { ShotTextures } from "./shot_textures.js";
import { openTextures, shownImages } from "./textures.js";
import { colourAttribute, colourArray, uvArray, uvChannels } from "./vertex_attributes.js";
import { Warp, canMove } from "./warp.js";

const PIXELS = 3; // of a point's side, where there are no triangles

export class GeometryVideoMesh extends Mesh {
  /**
   * The mesh of a video; the video is closed with it.
   *
   * @param {import("../geometry_video.js").GeometryVideo} video
   * @param {object} [options]
   * @param {[number, number, number]} [options.centre] in model units, the origin of the geometry
   * @param {number} [options.scale] of the geometry; 1: model units
   * @param {boolean} [options.gloss] false: materials without it, for renderers that run on the processor
   * @param {number} [options.anisotropy] of textures
   * @param {() => import("three").Texture|null} [options.environment] what metal reflects; null: the scene's
   * @param {boolean} [options.ownClock] true: it plays by the page's clock, without `update`
   * @returns {Promise<GeometryVideoMesh>}
   */
  static async create(video, { centre = [0, 0, 0], scale = 1, gloss = true, anisotropy = 1, environment = () => null, ownClock = false } = {}) {
    const moving = await video.openMoving(shownImages(video));
    const positions = await video.frame(video.startFrame);
    const textures = await openTextures(video, anisotropy, moving, video.startFrame);
    return new GeometryVideoMesh(video, positions, textures, { moving, centre, scale, gloss, anisotropy, environment, ownClock });
  }

  #view;
  #textures;
  #shotTextures = null; // of a capture
  #moving; // MovingImages, of the shot that is drawn
  #playback;
  #now = 0; // ms of `update`'s clock
  #tick = null; // what waits for its next step
  #level; // that is drawn
  #shot; // that is drawn
  #left = []; // what was drawn before: freed once something else was, since three.js forgets shaders that nothing uses
  #seenRanges = new Map(); // of fields by name, over the shots so far
  #opening = null; // a promise of textures, where a level has others
  #groupsOf = new Map(); // level -> groups
  #groups = null; // (3T) corners that share a normal
  #normals = null;
  #render = null; // RenderVertices
  #isByTriangle = false; // whether no vertex is shared by two triangles: for fields per triangle
  #parts;
  #channels; // uv sets by name
  #colours; // attribute, or null
  #materials = [];
  #field = null; // FieldColours
  #wanted = { name: null, field: null }; // shown, or to be shown once it is loaded, and how
  #fieldRange = [0, 0];
  #isLog = false; // whether the field's colours follow the logarithm
  #warp = null; // Warp
  #wantedWarp = { name: null, field: null, scale: 1 }; // shown, or to be shown once its field is loaded
  #unmoved = null; // (V, 3) the frame shown, in the geometry's units, before the warp moved it
  #wantedCut = null; // shown, or to be shown once the volume is here
  #plane = null; // of the cut: three.js's, in the scene
  #fill = null; // FilledCut
  #firstBox = null; // of the first frame shown, model units
  #isFlat = false; // whether each triangle has one normal
  #drawn = this; // what the materials are of: the mesh, or points
  #wires = null;
  #isWired = false;
  #unfollow;
  #isDisposed = false;

  /** Made by `create`. */
  constructor(video, positions, textures, view) {
    super(undefined, []);
    this.type = "GeometryVideoMesh";
    /** The `GeometryVideo`. */
    this.video = video;
    this.#view = view;
    this.#textures = textures;
    this.#moving = view.moving;
    view.moving.lost = (note) => (this.notes = [...this.notes, note]);
    this.frustumCulled = false; // the box of the motion may be a little small
    this.#open(positions, new Set());
    const on = {
      show: (shown, k) => this.#show(shown, k),
      prepare: (k) => (video.level || video.shotOf(k) !== video.shot ? undefined : this.#prepare(k)),
      tell: (type) => this.dispatchEvent({ type }),
      fail: (error) => this.dispatchEvent({ type: "error", error }),
      silent: () => {
        this.notes = [...this.notes, `this browser cannot play the sound (${video.sound.codec})`];
        this.dispatchEvent({ type: "notes" });
      },
    };
    const grown = () => this.dispatchEvent({ type: video.isLive ? "progress" : "durationchange" });
    if (video.shots.length > 1) this.#shotTextures = new ShotTextures(video.shot, textures, view.moving, view.anisotropy);
    const ready = (shot, number, own) => Promise.all([this.#shotTextures.ready(shot, number), this.#loadFields(shot, own)]);
    this.#unfollow = video.follow({ grown, lost: on.fail, ready, closed: (number) => this.#shotTextures.closed(number) });
    this.#playback = new Playback(video, on, view.ownClock ? undefined : (tick) => (this.#tick = tick));
  }

  /** Go on by so many seconds: what plays shows the frame that is due, once it is decoded. @param {number} delta */
  update(delta) {
    this.#now += 1000 * checkSeconds(delta, "delta");
    const tick = this.#tick;
    this.#tick = null;
    tick?.(this.#now);
  }

  /** Play on from the frame shown, from the start if that is the last; a promise that it plays. */
  play() {
    return this.#playback.play();
  }

  pause() {
    this.#playback.pause();
  }

  /** Show frame k, and pause; a promise that it is shown. Of many calls in a row the last counts. */
  seek(k) {
    return this.#playback.seek(k);
  }

  /** The frame shown. */
  get currentFrame() {
    return this.#playback?.currentFrame ?? 0;
  }

  /** The frame shown, or the one that is sought. */
  get soughtFrame() {
    return this.#playback.aim;
  }

  /** Seconds; to set it shows the frame of that time, and what plays goes on there. */
  get currentTime() {
    return this.#playback.currentTime;
  }

  set currentTime(seconds) {
    this.#playback.currentTime = seconds;
  }

  /** Seconds. */
  get duration() {
    return this.video.duration;
  }

  get paused() {
    return this.#playback.paused;
  }

  get ended() {
    return this.#playback.ended;
  }

  get seeking() {
    return this.#playback.seeking;
  }

  get loop() {
    return this.#playback.loop;
  }

  set loop(loops) {
    this.#playback.loop = loops;
  }

  /** 0.0625 to 16; 1 is the video's own. */
  get playbackRate() {
    return this.#playback.playbackRate;
  }

  set playbackRate(rate) {
    this.#playback.playbackRate = rate;
  }

  /** Whether what plays is silent; while it is heard, frames follow the sound's clock. */
  get muted() {
    return this.#playback.muted;
  }

  set muted(muted) {
    this.#playback.muted = muted;
  }

  /** Of the sound, 0 to 1. */
  get volume() {
    return this.#playback.volume;
  }

  set volume(volume) {
    this.#playback.volume = volume;
  }

  /** "auto": a coarser level of detail where the page cannot keep up while it plays, a finer one again once it can; else the level. */
  get lod() {
    return this.#playback.choosesLevel ? "auto" : this.video.level;
  }

  set lod(lod) {
    this.#playback.choosesLevel = lod === "auto";
    if (lod !== "auto") this.setLevel(lod).catch((error) => this.#tellError(error));
  }

  /** Show another level of detail: a promise that it is shown. What plays goes on. @param {number|"coarsest"} level */
  async setLevel(level) {
    await this.#playback.setLevel(level);
    await this.#opening;
  }

  /** Names of the parts, in order, each once. */
  get partNames() {
    return this.#parts.names;
  }

  /** Hide the parts of these names, and show all others. @param {string|Iterable<string>} names */
  hide(names) {
    this.#parts.hide(new Set(typeof names === "string" ? [names] : names));
    if (this.video.triangleCount) this.#parts.fill(this.geometry, this.#render.index);
    if (this.#wires) this.#fillWires();
  }

  /** Show the edges of polygons. @param {boolean} visible */
  setWireframe(visible) {
    this.#isWired = visible;
    if (visible && !this.#wires && this.video.triangleCount) this.#openWires();
    if (this.#wires) this.#wires.visible = visible;
  }

  /** Whether each triangle has one normal, so that its edges show; else the surface looks smooth. @param {boolean} isFlat */
  setFlatShading(isFlat) {
    this.#isFlat = isFlat;
    for (const material of [this.#materials, this.#drawn.material].flat()) this.#shade(material);
  }

  /**
   * Move vertices by a field of displacements.
   *
   * @param {string|null} name of a field of two or three components at vertices; null: none
   * @param {number} [scale] so many times as far
   * @returns {Promise<boolean>} whether it is shown; false if another call came since
   */
  async setWarp(name, scale = 1) {
    const field = this.#fieldOf(name);
    if (field === undefined || (field && !canMove(field))) throw new RangeError(`there is no field '${name}' of displacements of vertices`);
    const wanted = (this.#wantedWarp = { name, field, scale });
    await field?.load(this.#own);
    if (wanted !== this.#wantedWarp || this.#isDisposed) return false;
    if (!field && !this.#warp) return true;
    this.#unmoved ??= this.framePositions.slice();
    this.#warp = field && (field === this.#warp?.field ? Object.assign(this.#warp, { scale }) : new Warp(field, scale));
    this.#moveVertices();
    if (!field) this.#unmoved = null;
    return true;
  }

  /**
   * Leave out what lies on one side of a plane across an axis; the section of a volume is filled. The renderer needs
   * `localClippingEnabled`.
   *
   * @param {import("../volume/plane.js").Cut|null} cut model units, the file's origin included; null: nothing is left out
   * @returns {Promise<boolean>} whether it is shown; false if another call came since
   */
  async setClip(cut) {
    const wanted = (this.#wantedCut = cut);
    this.#plane = cut && (this.#plane ?? new Plane());
    this.updateMatrixWorld(true);
    for (const material of [this.#materials, this.#drawn.material, this.#wires?.material ?? []].flat()) this.#shade(material);
    if (this.#fill) this.#showFill();
    const { volume } = this.video;
    if (!cut || !volume) {
      this.#closeFill();
      return true;
    }
    await volume.open();
    if (wanted !== this.#wantedCut || this.video.volume !== volume || this.#isDisposed) return false;
    if (!this.#fill) {
      this.#fill = new FilledCut(volume, this.video.vertexCount);
      this.#fill.visible = false;
      this.#colourFill();
      this.add(this.#fill);
    }
    await this.#fill.load(this.#own, this.#warp);
    if (wanted !== this.#wantedCut || !this.#fill || this.#isDisposed) return false;
    this.#showFill();
    return true;
  }

  /** (n, 3, 3) corners of the triangles of the section that is shown, model units, the file's origin apart; empty where the cut is hollow. */
  get section() {
    const { centre, scale } = this.#view;
    return this.#fill?.corners.map((value, i) => value / scale + centre[i % 3]) ?? new Float32Array(0);
  }

  /** Where the plane of the cut is, in the geometry's units: `{axis, place, sign}`, or null. */
  get cut() {
    const cut = this.#wantedCut;
    if (!cut) return null;
    const { axis, place, isPart, sign } = cut;
    const { centre, scale } = this.#view;
    const { min, max } = this.#firstBox ?? this.video.bounds;
    const own = isPart ? min[axis] + place * (max[axis] - min[axis]) : place - this.video.origin[axis];
    return { axis, place: (own - centre[axis]) * scale, sign };
  }

  updateMatrixWorld(force) {
    super.updateMatrixWorld(force);
    if (!this.#plane) return;
    const { axis, place, sign } = this.cut;
    this.#plane.normal.set(0, 0, 0).setComponent(axis, -sign);
    this.#plane.constant = sign * place;
    this.#plane.applyMatrix4(this.matrixWorld);
  }

  /** `{min, max}`: the box that the motion stays in, displacements with it, model units, as far as it is known. */
  get bounds() {
    return this.#warp ? this.#warp.widened(this.video.bounds) : this.video.bounds;
  }

  /**
   * What of the frame shown a ray meets first, hidden parts apart.
   *
   * @param {import("three").Ray} ray in the geometry's units
   * @returns {import("../volume/volume.js").Picked|null} a triangle and its nearest vertex; of the section of a cut a cell and its point
   */
  pick({ origin, direction }) {
    const { video, framePositions } = this;
    if (!video.triangleCount) {
      const met = pickPoint(origin.toArray(), direction.toArray(), framePositions);
      return met && { ...met, part: partOf(video.parts, "vertices", met.vertex) };
    }
    const { start, most, enters } = uncutRay(origin.toArray(), direction.toArray(), this.cut);
    const inside = enters ? this.#fill?.pick(start, direction.toArray()) : null;
    if (inside) return { ...inside, vertex: inside.point < video.vertexCount ? inside.point : null, triangle: null, part: null };
    const met = pickTriangle(start, direction.toArray(), framePositions, video.indices, this.#parts.visible, most);
    return met && { ...met, part: partOf(video.parts, "triangles", met.triangle) };
  }

  /**
   * Show a field in colours, in place of the materials.
   *
   * @param {string|null} name of a field of the video; null: the materials
   * @param {{colormap?: string, range?: [number, number]|null, scale?: string}} [options] `range`: values of the first and the last
   *   colour; null: the field's own. `scale`: "log" lets colours follow the logarithm, if the range lies above 0
   * @returns {Promise<[number, number]|null>} that range; null if another call came since
   */
  async showField(name, { colormap = "viridis", range = null, scale = "linear" } = {}) {
    const field = this.#fieldOf(name);
    if (field === undefined) throw new RangeError(`there is no field '${name}'; fields: ${[...this.video.fields.keys()].join(", ") || "none"}`);
    const wanted = (this.#wanted = { name, field, colormap, range, scale });
    await field?.load(this.#own);
    if (wanted !== this.#wanted) return null;
    return this.#setField(wanted);
  }

  /** Values of the first and the last colour of the field that is shown. */
  get fieldRange() {
    return this.#fieldRange;
  }

  /** A mesh that shares geometry and materials, and so moves with this one. */
  clone(recursive = true) {
    return new Mesh().copy(this, recursive);
  }

  /** Free the video, and what the GPU has of it. */
  dispose() {
    this.#isDisposed = true;
    this.#wanted = { name: null, field: null };
    this.#wantedWarp = { name: null, field: null, scale: 1 };
    this.#playback.close();
    this.#unfollow();
    this.#tick = null;
    this.#closeField();
    this.#wantedCut = null;
    this.#closeFill();
    for (const left of [this.#left, this.#materials, this.#wires?.material].flat()) left?.dispose();
    this.#wires?.geometry.dispose();
    this.#textures.dispose();
    this.#shotTextures?.dispose();
    this.geometry.dispose();
    this.video.close();
  }

  /** Of what was asked for by the way. */
  #tellError(error) {
    if (!this.#isDisposed) this.dispatchEvent({ type: "error", error });
  }

  #show(positions, k) {
    const isSame = this.video.level === this.#level && this.video.shot === this.#shot;
    if (isSame && !this.#showPictures(k)) return;
    if (isSame) {
      this.#place(positions);
      this.#setBounds();
      this.#update();
      this.#updateField();
      this.#showFill();
    } else {
      this.#changeMesh(positions);
    }
    this.dispatchEvent({ type: "frame", frame: k });
  }

  /** Show the pictures of textures that move; false where they are gone by now, and the frame is not shown. */
  #showPictures(k) {
    const moving = this.#moving;
    if (!moving || this.video.level > 0) return true;
    const pictures = moving.show(this.video.ownFrame(k));
    if (pictures) this.#textures.show(pictures);
    else if (this.paused) this.#playback.seek(k); // another frame was asked for meanwhile
    return pictures !== null;
  }

  /** Make all that depends on vertices and triangles; of these parts none is drawn. */
  #open(positions, hidden) {
    const { video } = this;
    this.#level = video.level;
    this.#shot = video.shot;
    /** `Float32Array` (V, 3): the frame shown, in the geometry's units. */
    this.framePositions = new Float32Array(positions.length);
    this.#place(positions);
    if (!video.level && !this.#firstBox) {
      this.#firstBox = { min: [Infinity, Infinity, Infinity], max: [-Infinity, -Infinity, -Infinity] };
      stretch(this.#firstBox, positions);
    }
    this.#parts = new PartIndex(video.parts, video.triangleCount);
    this.#parts.hide(hidden);
    this.#colours = colourAttribute(video.attributes);
    const { channels, notes } = uvChannels(video.materials, video.attributes);
    this.#channels = channels;
    /** What is not shown as it should be, a line each. */
    this.notes = [...video.notes, ...notes, ...this.#textures.notes, ...(this.#moving?.notes ?? [])];
    if (video.triangleCount && !this.#groupsOf.has(video.level)) this.#groupsOf.set(video.level, this.#groupNormals());
    this.#groups = this.#groupsOf.get(video.level) ?? null;
    this.#normals = null;
    this.#build(false);
    if (video.triangleCount) this.#openSurface();
    else this.#openPoints();
  }

  /** Draw another shot, or another level of detail. */
  #changeMesh(positions) {
    const { video } = this;
    const isShot = video.shot !== this.#shot;
    const before = this.#left;
    this.#left = [];
    this.#dropField(false);
    this.#closeDrawn();
    this.#closeFill();
    this.#warp = this.#unmoved = null; // it comes back with the whole mesh
    if (isShot) {
      this.#groupsOf.clear();
      this.#textures = this.#shotTextures.show(video.shot) ?? this.#textures;
      this.#moving = this.#shotTextures.moving;
      const pictures = this.#moving?.show(this.#own);
      if (pictures) this.#textures.show(pictures);
    }
    this.#open(positions, this.#parts.hidden);
    if (this.#isWired && !this.#wires) this.setWireframe(true);
    this.#bringBackFields();
    for (const left of before) left.dispose();
    this.dispatchEvent(isShot ? { type: "shotchange", shot: video.shot } : { type: "levelchange", level: video.level });
    if (!video.images.length || this.#textures.images === video.images || (isShot && this.#shotTextures.isShown(video.shot))) return;
    const { anisotropy } = this.#view;
    const opened = isShot ? this.#shotTextures.ready(video, video.shot) : openTextures(video, anisotropy, this.#moving, this.currentFrame);
    this.#opening = opened.then((textures) => this.#takeTextures(textures, video.shot));
  }

  /** Late ones, of a shot. */
  #takeTextures(textures, shot) {
    if (this.#isDisposed || this.video.shot !== shot) {
      if (!this.#shotTextures) textures.dispose();
      return;
    }
    if (this.#shotTextures) {
      this.#shotTextures.show(shot);
      this.#moving = this.#shotTextures.moving;
    } else {
      this.#textures.dispose();
    }
    this.#textures = textures;
    this.notes = [...this.notes, ...textures.notes];
    if (this.video.images !== textures.images || !this.video.triangleCount) return;
    const isFieldShown = this.#field !== null;
    const { material } = this;
    this.#closeDrawn();
    this.#openSurface();
    if (isFieldShown) this.material = material;
    this.dispatchEvent({ type: "change" });
  }

  /** A field of the shot that is shown; undefined: none of that name; null: none, or of other shots. */
  #fieldOf(name) {
    return name === null ? null : (this.video.fields.get(name) ?? (this.video.shots.length > 1 ? null : undefined));
  }

  /** The number of the frame shown in its shot. */
  get #own() {
    return this.video.ownFrame(this.currentFrame);
  }

  /** Have what is shown of a frame of the shot that is drawn. */
  #prepare(k) {
    const own = this.video.ownFrame(k);
    return Promise.all([this.#loadFields(this.video, own), this.#fill?.load(own, this.#warp)]);
  }

  /** Have values of the fields that are to be shown. @param {import("../geometry_video.js").GeometryVideo} video of the shot @param {number} own frame */
  #loadFields({ fields }, own) {
    return Promise.all([this.#wanted, this.#wantedWarp].map(({ name }) => fields.get(name)?.load(own)));
  }

  /** Show the fields that are wanted on a mesh that is new, at once where their values are here. */
  #bringBackFields() {
    const isHere = (field) => field.row(this.#own, 0) !== null;
    const { name, ...options } = this.#wanted;
    const field = this.video.fields.get(name);
    if (field && isHere(field)) this.#setField((this.#wanted = { name, ...options, field }));
    else if (field) this.showField(name, options).catch((error) => this.#tellError(error));
    const { name: mover, scale } = this.#wantedWarp;
    const moves = this.video.fields.get(mover);
    if (moves && canMove(moves) && isHere(moves)) {
      this.#unmoved = this.framePositions.slice();
      this.#warp = new Warp(moves, scale);
      this.#moveVertices();
    } else if (moves && canMove(moves)) {
      const moved = this.setWarp(mover, scale);
      moved.then(() => this.dispatchEvent({ type: "change" }), (error) => this.#tellError(error));
    }
    if (this.#wantedCut) {
      const cut = this.setClip(this.#wantedCut);
      cut.then(() => this.dispatchEvent({ type: "change" }), (error) => this.#tellError(error));
    }
  }

  /** Free materials, and points in place of triangles. */
  #closeDrawn() {
    this.#left.push(...[this.#materials].flat());
    if (this.#drawn !== this) this.remove(this.#drawn);
    this.#drawn = this;
    this.material = [];
  }

  #setField({ field, colormap, range, scale }) {
    this.#closeField();
    if (!field) {
      this.#drawn.material = this.#materials;
      this.#colourFill();
      return [0, 0];
    }
    const isByTriangle = field.domain === "triangle";
    if (isByTriangle && !this.#isByTriangle) this.#build(true);
    const { vertices, corners } = this.#render;
    const rows = isByTriangle ? corners.map((c) => (c / 3) | 0) : vertices;
    const isPoints = !this.video.triangleCount;
    this.#field = new FieldColours(field, rows, isPoints ? linearTable(colormap) : null);
    this.#fieldRange = range ?? this.#rangeOf(field, colormap);
    this.#isLog = isLogarithmic(scale, this.#fieldRange);
    this.geometry.setAttribute(this.#field.name, this.#field.attribute);
    if (isPoints) this.#drawn.material = this.#shade(pointsMaterial(0xffffff, true));
    else this.#drawn.material = this.#shade(fieldMaterial(colormap, this.#field.isColour));
    this.#updateField();
    this.#colourFill();
    return this.#fieldRange;
  }

  /** The range of a field; of a capture, over the shots that were shown so far. */
  #rangeOf(field, colormap) {
    const range = rangeOf(field, colormap);
    if (!this.#shotTextures || !field.range) return range;
    const [low, high] = this.#seenRanges.get(field.name) ?? range;
    const seen = [Math.min(low, range[0]), Math.max(high, range[1])];
    this.#seenRanges.set(field.name, seen);
    return seen;
  }

  /** Colours of the field that is shown, on the section. */
  #colourFill() {
    if (!this.#fill) return;
    const { colormap } = this.#wanted;
    const field = this.#field?.field;
    this.#fill.setColours(field ? { field, colormap, range: this.#fieldRange, isLog: this.#isLog } : null);
    this.#showFill();
  }

  /** The section of the frame shown; until what lies inside is in memory, there is none. */
  #showFill() {
    const [fill, warp, k, own] = [this.#fill, this.#warp, this.currentFrame, this.#own];
    if (!fill || !this.#plane || this.video.level) return;
    const shown = { k: own, surface: this.framePositions, view: this.#view, warp };
    if (fill.update(shown, this.cut)) {
      if (this.#isOfShot(k + 1)) fill.load(own + 1, warp).catch(() => {}); // reported when it is shown
      return;
    }
    fill.load(own, warp).then(
      () => {
        if (this.#fill !== fill || this.currentFrame !== k || this.#isDisposed) return; // another one is shown by now
        if (fill.update({ ...shown, warp: this.#warp }, this.cut)) this.dispatchEvent({ type: "change" });
      },
      (error) => this.#fill === fill && this.#tellError(error),
    );
  }

  /** Whether there is such a frame, and it is of the shot that is shown. */
  #isOfShot(k) {
    return k < this.video.frameCount && this.video.shotOf(k) === this.video.shot;
  }

  #closeFill() {
    if (!this.#fill) return;
    this.remove(this.#fill);
    this.#fill.dispose();
    this.#fill = null;
  }

  #place(positions) {
    const points = this.#warp ? this.#unmoved : this.framePositions;
    const { centre, scale } = this.#view;
    for (let i = 0; i < points.length; i += 3) {
      points[i] = (positions[i] - centre[0]) * scale;
      points[i + 1] = (positions[i + 1] - centre[1]) * scale;
      points[i + 2] = (positions[i + 2] - centre[2]) * scale;
    }
    if (this.#warp) this.#move();
  }

  /** Move the vertices of the frame shown; until its displacements are in memory, by those of the frame before. */
  #move() {
    const warp = this.#warp;
    const k = this.currentFrame;
    const isThere = warp.read(this.#own);
    this.framePositions.set(this.#unmoved);
    warp.move(this.framePositions, this.#view.scale);
    if (isThere) return;
    warp.field.load(this.#own).then(
      () => {
        if (this.#warp !== warp || this.currentFrame !== k || this.#isDisposed) return; // another one is shown by now
        this.#moveVertices();
        this.dispatchEvent({ type: "change" });
      },
      (error) => this.#warp === warp && this.#tellError(error),
    );
  }

  /** Show the frame's vertices moved by the warp as it is now. */
  #moveVertices() {
    if (this.#warp) this.#move();
    else this.framePositions.set(this.#unmoved);
    this.#setBounds();
    this.#update();
    this.#showFill();
  }

  /** (3T) which corners share a normal, by the attribute, or by the angles of the frame shown. */
  #groupNormals() {
    const { indices, basePoints, attributes, parts } = this.video;
    const normal = attributes.get("normal");
    if (normal?.kind === "normal" && normal.components === 3) {
      return groupCorners(indices, basePoints, cornerEntries(normal, indices, parts), normal.values);
    }
    const groups = groupVertices(indices, basePoints, this.framePositions);
    return indices.map((vertex) => groups[vertex]);
  }

  /** Split vertices as attributes need it, and make the geometry. */
  #build(isByTriangle) {
    const { indices, vertexCount, attributes, parts } = this.video;
    const used = [...[...this.#channels.keys()].map((name) => attributes.get(name)), this.#colours].filter(Boolean);
    const entries = new Map(used.map((attribute) => [attribute, cornerEntries(attribute, indices, parts)]));
    const tables = used.filter(({ domain }) => domain !== "vertex").map((attribute) => entries.get(attribute));
    const normal = attributes.get("normal");
    if (normal && normal.domain !== "vertex" && this.#groups) tables.push(this.#groups);
    if (isByTriangle) tables.push(Uint32Array.from(indices, (_, c) => (c / 3) | 0));
    this.#isByTriangle = isByTriangle;
    this.#render = splitVertices(indices, vertexCount, tables);
    const { index, corners, vertices } = this.#render;
    this.geometry?.dispose();
    this.geometry = new BufferGeometry();
    const dynamic = (array) => new BufferAttribute(array, 3).setUsage(DynamicDrawUsage);
    this.geometry.setAttribute("position", dynamic(this.#render.isSplit ? new Float32Array(3 * vertices.length) : this.framePositions));
    if (this.#groups) {
      this.geometry.setAttribute("normal", dynamic(new Float32Array(3 * vertices.length)));
      this.#normals = new Normals(indices, this.#groups, corners.map((c) => this.#groups[c]));
      this.geometry.setIndex(new BufferAttribute(new Uint32Array(index.length), 1));
      this.#parts.fill(this.geometry, index);
    }
    const rowsOf = (attribute) => entryOf(attribute, entries.get(attribute), this.#render);
    for (const [name, channel] of this.#channels) {
      const array = uvArray(attributes.get(name), rowsOf(attributes.get(name)));
      this.geometry.setAttribute(channel ? `uv${channel}` : "uv", new BufferAttribute(array, 2));
    }
    if (this.#colours) {
      this.geometry.setAttribute("color", new BufferAttribute(colourArray(this.#colours, rowsOf(this.#colours), !this.video.materials.length), 4));
    }
    this.#setBounds();
    this.#drawn.geometry = this.geometry;
    if (this.#wires) this.#fillWires();
    this.#update();
  }

  /** The box that the whole motion stays in, as far as it is known. */
  #setBounds() {
    const { centre, scale } = this.#view;
    const { min, max } = this.bounds;
    const [low, high] = [min, max].map((corner) => new Vector3(...corner.map((value, axis) => (value - centre[axis]) * scale)));
    this.geometry.boundingBox = new Box3(low, high);
    this.geometry.boundingSphere = this.geometry.boundingBox.getBoundingSphere(new Sphere());
  }

  #openSurface() {
    const { materials } = this.video;
    const hasColours = Boolean(this.#colours);
    const scene = { hasColours, gloss: this.#view.gloss };
    this.#materials = this.#parts.materials.map((number) =>
      number === null ? plainMaterial(hasColours) : makeMaterial(materials[number], this.#textures, this.#channels, scene),
    );
    for (const material of this.#materials) {
      if (material.metalness > 0) material.envMap = this.#view.environment();
      this.#shade(material);
    }
    this.material = this.#materials;
  }

  #openWires() {
    const material = this.#shade(new LineBasicMaterial({ color: 0x1d2a38, transparent: true, opacity: 0.35 }));
    this.#wires = Object.assign(new LineSegments(new BufferGeometry(), material), { frustumCulled: false, raycast() {} });
    this.#fillWires();
    this.add(this.#wires);
  }

  /** Edges of the polygons of visible parts, between the vertices that the geometry draws. */
  #fillWires() {
    const { video } = this;
    const edges = video.triangleCount ? polygonEdges(this.#render.index, video.polygons, this.#parts.visible) : new Uint32Array();
    this.#wires.geometry.dispose();
    this.#wires.geometry = new BufferGeometry();
    this.#wires.geometry.setAttribute("position", this.geometry.attributes.position);
    this.#wires.geometry.setIndex(new BufferAttribute(edges, 1));
  }

  #shade(material) {
    if (material.flatShading !== undefined && material.flatShading !== this.#isFlat) {
      material.flatShading = this.#isFlat;
      material.needsUpdate = true;
    }
    material.clippingPlanes = this.#plane && [this.#plane];
    return material;
  }

  /** Without triangles the mesh itself draws nothing: it has no material. */
  #openPoints() {
    this.#materials = this.#shade(pointsMaterial(this.#colours ? 0xffffff : 0x6f8296, Boolean(this.#colours)));
    this.#drawn = Object.assign(new Points(this.geometry, this.#materials), { frustumCulled: false });
    this.add(this.#drawn);
  }

  /** The frame's positions and normals go to the GPU. */
  #update() {
    const { position, normal } = this.geometry.attributes;
    const { framePositions: points } = this;
    const { vertices, isSplit } = this.#render;
    if (isSplit) {
      const { array } = position;
      for (let r = 0; r < vertices.length; r++) {
        array[3 * r] = points[3 * vertices[r]];
        array[3 * r + 1] = points[3 * vertices[r] + 1];
        array[3 * r + 2] = points[3 * vertices[r] + 2];
      }
    }
    position.needsUpdate = true;
    if (!this.#normals) return;
    this.#normals.compute(points, normal.array);
    normal.needsUpdate = true;
  }

  #updateField() {
    const colours = this.#field;
    const k = this.currentFrame;
    if (!colours || colours.update(this.#own, this.#fieldRange, this.#isLog)) return;
    colours.field.load(this.#own).then(
      () => {
        if (this.#field !== colours || this.currentFrame !== k) return; // another one is shown by now
        colours.update(this.#own, this.#fieldRange, this.#isLog);
        this.dispatchEvent({ type: "change" });
      },
      (error) => this.#field === colours && this.dispatchEvent({ type: "error", error }),
    );
  }

  #closeField() {
    if (!this.#field) return;
    const { name } = this.#field;
    this.#dropField(true);
    this.geometry.deleteAttribute(name);
    if (this.#isByTriangle || (name === "color" && this.#colours)) this.#build(false); // as it was before the field
  }

  /** @param {boolean} isFreed at once */
  #dropField(isFreed) {
    if (!this.#field) return;
    const { material } = this.#drawn;
    const old = material.map ? [material, material.map] : [material];
    if (isFreed) for (const each of old) each.dispose();
    else this.#left.push(...old);
    this.#field = null;
  }
}

/** Where a ray enters what a cut leaves, and how far along it that ends; `start` is its origin where it lies in it. */
function uncutRay(origin, direction, cut) {
  if (!cut) return { start: origin, most: Infinity, enters: false };
  const { axis, place, sign } = cut;
  const [height, rise] = [sign * (origin[axis] - place), sign * direction[axis]];
  const met = -height / rise;
  if (height <= 0) return { start: origin, most: rise > 0 ? met : Infinity, enters: false };
  if (!(rise < 0)) return { start: origin, most: 0, enters: false };
  return { start: origin.map((value, k) => value + met * direction[k]), most: Infinity, enters: true };
}

/** Name of the part that has a vertex or a triangle, or null. */
function partOf(parts, things, number) {
  return parts.find(({ [things]: [start, stop] }) => start <= number && number < stop)?.name ?? null;
}

/** Which value of an attribute each render vertex has. */
function entryOf({ domain, indices }, entries, { corners, vertices }) {
  if (domain !== "vertex") return corners.map((c) => entries[c]);
  return indices ? vertices.map((v) => indices[v]) : vertices; // of vertices without a triangle, too
}

function pointsMaterial(color, vertexColors) {
  return new PointsMaterial({ color, size: PIXELS, sizeAttenuation: false, vertexColors });
}

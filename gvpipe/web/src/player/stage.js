/** The picture: a mesh drawn by three.js, and a camera that frames the whole motion and orbits it. */

import {
  Box3,
  BufferAttribute,
  BufferGeometry,
  DirectionalLight,
  HemisphereLight,
  Matrix4,
  PMREMGenerator,
  PerspectiveCamera,
  Points,
  PointsMaterial,
  Ray,
  Scene,
  Spherical,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { RoomEnvironment } from "three/addons/environments/RoomEnvironment.js";
import { GeometryVideoMesh } from "../three/geometry_video_mesh.js";
import { CutHandle } from "./cut_handle.js";

const FIELD_OF_VIEW = 35; // degrees, of the shorter side
const FAR = 100; // balls that the motion fits in, at least
const MARGIN = 1.06; // around what is framed
const FOLLOWING_ROOM = 1.15; // around a mesh that is followed, which may stretch out later
const VIEW = [180 / 7, 15]; // azimuth and elevation of the first view, degrees: from the front, a little from the right and above
const STEEPEST = 89.9; // degrees of elevation: from straight above no azimuth would be left
const MAX_PIXEL_RATIO = 2;
const MAX_ANISOTROPY = 8; // of textures seen at a flat angle
const MARK = { color: 0xe0532f, size: 9, sizeAttenuation: false, depthTest: false }; // of a vertex that is pointed at
const ROOM_PIXELS = 64; // a side of what metal reflects
const ROOM_BLUR = 0.04; // radians
const SOFTWARE = /SwiftShader|llvmpipe|softpipe|software|Basic Render/i; // renderers that run on the processor
const MAX_SOFTWARE_PIXELS = 512 * 768; // drawn without a GPU: larger pictures are scaled up, and play on smoothly

export class Stage {
  /** @param {HTMLCanvasElement} canvas sized by its page */
  constructor(canvas) {
    this.hasGpu = probeGpu();
    // without a GPU smooth edges would cost more than all else together
    this.renderer = new WebGLRenderer({ canvas, antialias: this.hasGpu, alpha: true });
    this.renderer.localClippingEnabled = true;
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, FAR);
    this.scene.add(this.camera);
    const key = new DirectionalLight(0xffffff, 2.2);
    key.position.set(-1.2, 1.6, 1); // light goes with the camera, so that nothing looked at is dark
    this.camera.add(key, key.target);
    this.scene.add(new HemisphereLight(0xffffff, 0x8c8a88, 1.4));
    this.handle = new CutHandle(canvas, this.camera, (place) => this.cutMoved(this.#modelPlace(place))); // hears of pointers first
    this.scene.add(this.handle);
    this.cutMoved = () => {}; // called with where the cut is dragged to, model units
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => {
      this.requestRender();
      if (!this.isFramed) this.turned();
    });
    this.controls.addEventListener("start", () => (this.isFramed = false));
    this.isFollowing = false; // whether the camera goes where the mesh goes
    this.isFramed = false; // whether the view is still the first one, which follows the picture's shape
    this.view = VIEW;
    this.mesh = null;
    this.marked = null; // a vertex
    this.mark = new Points(new BufferGeometry(), new PointsMaterial(MARK));
    this.mark.geometry.setAttribute("position", new BufferAttribute(new Float32Array(3), 3));
    Object.assign(this.mark, { visible: false, frustumCulled: false, renderOrder: 1 });
    this.scene.add(this.mark);
    this.turned = () => {}; // called when a user turns the camera
    this.turn = 0; // counts meshes, so that a late one does not replace its successor
    this.pending = 0;
    this.size = ""; // of the picture, as it is
    this.observer = new ResizeObserver(() => this.#resize());
    this.observer.observe(canvas);
  }

  /** Show a video's mesh, in `this.mesh`, until another one is set. `up` is the axis, "y" or "z", that stands upright. */
  async setMesh(video, up) {
    this.clear();
    const { min, max } = video.bounds;
    this.centre = min.map((low, axis) => (low + max[axis]) / 2);
    this.scale = 1 / (Math.hypot(...max.map((high, axis) => high - min[axis])) / 2 || 1); // the scene is a unit ball
    const { centre, scale, hasGpu } = this;
    const anisotropy = hasGpu ? Math.min(MAX_ANISOTROPY, this.renderer.capabilities.getMaxAnisotropy()) : 1;
    const turn = ++this.turn;
    const environment = () => this.#environment();
    const mesh = await GeometryVideoMesh.create(video, { centre, scale, gloss: hasGpu, anisotropy, environment, ownClock: true });
    if (turn !== this.turn) return mesh.dispose(); // another mesh has come meanwhile, or the stage is closed
    this.mesh = mesh;
    mesh.addEventListener("frame", () => this.#frameShown());
    mesh.addEventListener("change", () => this.setMark(this.marked));
    for (const name of ["levelchange", "shotchange"]) {
      mesh.addEventListener(name, () => {
        this.used = null;
        this.marked = null; // it has other vertices
      });
    }
    this.used = null;
    this.middle = new Vector3();
    this.scene.add(mesh);
    this.camera.up.set(0, up === "z" ? 0 : 1, up === "z" ? 1 : 0);
    this.#resize();
    this.resetView();
    return undefined;
  }

  get hasMesh() {
    return this.mesh !== null;
  }

  /** (4, 4) by columns: from model units to clip space. */
  get projection() {
    const { centre, scale, camera } = this;
    camera.updateMatrixWorld();
    const toBall = new Matrix4().makeScale(scale, scale, scale).setPosition(...centre.map((value) => -value * scale));
    return new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).multiply(toBall).elements;
  }

  setWireframe(visible) {
    this.mesh?.setWireframe(visible);
    this.requestRender();
  }

  setFlatShading(isFlat) {
    this.mesh?.setFlatShading(isFlat);
    this.requestRender();
  }

  /** Azimuth and elevation of the view as it is, degrees, as of `gvpipe.render`. */
  get angles() {
    const offset = this.camera.position.clone().sub(this.controls.target);
    const { x, y, z } = offset;
    const [rise, turn] = this.camera.up.z ? [z, Math.atan2(x, -y)] : [y, Math.atan2(x, z)];
    return [turn, Math.asin(rise / (offset.length() || 1))].map((angle) => (angle * 180) / Math.PI);
  }

  /** Turn the camera about its target, from where it is. @param {[number, number]} view azimuth and elevation, degrees */
  turnTo(view) {
    const distance = this.camera.position.distanceTo(this.controls.target);
    this.camera.position.copy(this.#direction(view)).multiplyScalar(distance).add(this.controls.target);
    this.#moved();
  }

  /** Where the first view looks from. @param {[number, number]|null} view azimuth and elevation, degrees, as of `gvpipe.render` */
  setView(view) {
    this.view = view ?? VIEW;
    if (this.mesh) this.resetView();
  }

  /** Move vertices by a field (`GeometryVideoMesh.setWarp`). */
  async setWarp(name, scale) {
    const { mesh } = this;
    if ((await mesh.setWarp(name, scale)) && mesh === this.mesh) this.#frameShown();
  }

  /** Cut by a plane (`GeometryVideoMesh.setClip`). */
  async setClip(cut) {
    const { mesh } = this;
    const cutting = mesh.setClip(cut);
    this.#showHandle();
    try {
      return await cutting;
    } finally {
      if (mesh === this.mesh) this.requestRender();
    }
  }

  /** `{axis, low, high, place}`: where a cut can be along its axis, and where it is, model units; null if there is none. */
  get cutRange() {
    const { cut } = this.mesh;
    if (!cut) return null;
    const { min, max } = this.#motion();
    const [low, high, place] = [min.getComponent(cut.axis), max.getComponent(cut.axis), cut.place].map((value) => this.#modelPlace(value, cut.axis));
    return { axis: cut.axis, low, high, place };
  }

  /** A place along an axis in model units, of one in the scene. */
  #modelPlace(place, axis = this.mesh.cut.axis) {
    return place / this.scale + this.centre[axis] + this.mesh.video.origin[axis];
  }

  #showHandle() {
    this.handle.show(this.mesh.cut, this.#motion());
    this.requestRender();
  }

  /** What is seen at a point of the picture (`GeometryVideoMesh.pick`). @param {number} x @param {number} y CSS pixels, from its upper left */
  pick(x, y) {
    const { camera } = this;
    const { clientWidth: width, clientHeight: height } = this.renderer.domElement;
    camera.updateMatrixWorld();
    const origin = new Vector3().setFromMatrixPosition(camera.matrixWorld);
    const beyond = new Vector3((2 * x) / width - 1, 1 - (2 * y) / height, 0.5).unproject(camera);
    return this.mesh.pick(new Ray(origin, beyond.sub(origin)));
  }

  /** Mark a vertex of the mesh, or none. @param {number|null} vertex */
  setMark(vertex) {
    this.marked = vertex;
    this.mark.visible = vertex !== null && this.mesh !== null;
    if (this.mark.visible) this.mark.position.fromArray(this.mesh.framePositions, 3 * vertex);
    this.requestRender();
  }

  /** Show a field in colours (`GeometryVideoMesh.showField`). */
  async showField(name, options) {
    const range = await this.mesh.showField(name, options);
    this.requestRender();
    return range;
  }

  /** Hide the parts of these names. @param {Set<string>} names */
  setHidden(names) {
    this.mesh.hide(names);
    this.requestRender();
  }

  /** Whether the camera goes where the mesh goes; it then frames the mesh as it is now, and else the whole motion. */
  setFollowing(isFollowing) {
    if (this.isFollowing === isFollowing) return;
    this.isFollowing = isFollowing;
    if (this.mesh) this.resetView();
  }

  /** Look from where the first view does at the whole motion, or at the mesh that is followed. */
  resetView() {
    const direction = this.#direction(this.view);
    this.box = this.#motion();
    this.middle = this.isFollowing ? this.#findMiddle() : this.box.getCenter(new Vector3());
    const half = this.isFollowing ? this.#findReach(this.middle) : this.box.getSize(new Vector3()).divideScalar(2).toArray();
    const distance = this.#distance(direction, half);
    this.camera.far = Math.max(FAR, 4 * distance);
    this.camera.updateProjectionMatrix();
    this.camera.position.copy(direction).multiplyScalar(distance).add(this.middle);
    this.controls.target.copy(this.middle);
    this.controls.update();
    this.isFramed = true;
    this.requestRender();
  }

  /** Turn about the target by angles in radians, for those who orbit by keyboard. */
  orbit(azimuth, elevation) {
    const turn = this.camera.up.z ? (v) => v.set(v.x, v.z, -v.y) : (v) => v;
    const back = this.camera.up.z ? (v) => v.set(v.x, -v.z, v.y) : (v) => v;
    const offset = turn(this.camera.position.clone().sub(this.controls.target));
    const angles = new Spherical().setFromVector3(offset);
    angles.theta += azimuth;
    angles.phi = Math.min(Math.PI - 0.01, Math.max(0.01, angles.phi - elevation));
    this.camera.position.copy(back(offset.setFromSpherical(angles)).add(this.controls.target));
    this.#moved();
  }

  zoom(factor) {
    this.camera.position.sub(this.controls.target).multiplyScalar(factor).add(this.controls.target);
    this.#moved();
  }

  /** Draw before the browser's next repaint, once however often asked. */
  requestRender() {
    this.pending ||= requestAnimationFrame(() => {
      this.pending = 0;
      this.renderer.render(this.scene, this.camera);
    });
  }

  /** The picture drawn anew, without a mark, as a promise of a PNG file. */
  still() {
    this.mark.visible = false;
    this.handle.isDrawn = false;
    this.renderer.render(this.scene, this.camera); // what was drawn before is gone once it is on the screen
    const picture = new Promise((resolve) => this.renderer.domElement.toBlob(resolve, "image/png"));
    this.handle.isDrawn = true;
    this.setMark(this.marked);
    return picture;
  }

  clear() {
    if (this.mesh) {
      this.scene.remove(this.mesh);
      this.mesh.dispose();
    }
    this.mesh = this.marked = null;
    this.mark.visible = false;
    this.handle.show(null);
    this.isFramed = false;
    this.requestRender();
  }

  close() {
    this.turn++;
    this.clear();
    cancelAnimationFrame(this.pending);
    this.observer.disconnect();
    this.controls.dispose();
    this.handle.dispose();
    this.reflected?.dispose();
    this.mark.geometry.dispose();
    this.mark.material.dispose();
    this.renderer.dispose();
  }

  /** What metal reflects: a room with lamps, made once it is needed. */
  #environment() {
    if (!this.reflected) {
      const [room, generator] = [new RoomEnvironment(), new PMREMGenerator(this.renderer)];
      this.reflected = generator.fromScene(room, ROOM_BLUR, 0.1, 100, { size: ROOM_PIXELS });
      room.dispose();
      generator.dispose();
    }
    return this.reflected.texture;
  }

  /** The box of the motion, as far as it is known, in the scene. */
  #motion() {
    const { centre, scale } = this;
    const { min, max } = this.mesh.bounds;
    const [low, high] = [min, max].map((corner) => new Vector3(...corner.map((value, axis) => (value - centre[axis]) * scale)));
    return new Box3(low, high);
  }

  /** Of unit length, from the target to the camera. @param {[number, number]} view azimuth and elevation, degrees */
  #direction([azimuth, steep]) {
    const upright = this.camera.up.z ? [0, -1, 0, 0, 0, 1] : [0, 0, 1, 0, 1, 0];
    const front = new Vector3(...upright.slice(0, 3));
    const up = new Vector3(...upright.slice(3));
    const [turn, rise] = [azimuth, Math.min(STEEPEST, Math.max(-STEEPEST, steep))].map((degrees) => (degrees * Math.PI) / 180);
    return front.multiplyScalar(Math.cos(rise)).addScaledVector(up, Math.sin(rise)).applyAxisAngle(up, turn);
  }

  /** Which vertices are drawn. */
  #findUsed() {
    const { indices, vertexCount, triangleCount } = this.mesh.video;
    this.used ??= triangleCount ? Uint32Array.from(new Set(indices)) : Uint32Array.from({ length: vertexCount }, (_, v) => v);
    return this.used;
  }

  /** The mean of the vertices drawn, in the scene. */
  #findMiddle() {
    const array = this.mesh.framePositions;
    const sum = [0, 0, 0];
    const used = this.#findUsed();
    for (const v of used) for (let axis = 0; axis < 3; axis++) sum[axis] += array[3 * v + axis];
    return new Vector3(...sum).divideScalar(used.length || 1);
  }

  /** How far the mesh reaches from a point, along each axis, with room to move. */
  #findReach(point) {
    const array = this.mesh.framePositions;
    const reach = [0, 0, 0];
    for (const v of this.#findUsed()) {
      for (let axis = 0; axis < 3; axis++) {
        reach[axis] = Math.max(reach[axis], Math.abs(array[3 * v + axis] - point.getComponent(axis)));
      }
    }
    return reach.map((value) => FOLLOWING_ROOM * value);
  }

  #frameShown() {
    if (this.mesh.cut) this.#showHandle(); // the box may have grown
    if (this.isFollowing) this.#follow(this.#findMiddle());
    else if (this.isFramed && !this.box.containsBox(this.#motion())) this.resetView(); // the motion goes farther than was known
    this.setMark(this.marked);
  }

  #follow(middle) {
    const step = middle.clone().sub(this.middle);
    this.middle = middle;
    this.camera.position.add(step);
    this.controls.target.add(step);
    this.camera.updateMatrixWorld();
  }

  #moved() {
    this.isFramed = false;
    this.controls.update();
    this.requestRender();
  }

  /** From where, looking along -direction, a box of these half sides about the target just fits. */
  #distance(direction, halfSides) {
    const view = this.camera.clone();
    view.position.copy(direction);
    view.lookAt(0, 0, 0);
    view.updateMatrixWorld();
    const axes = [0, 1, 2].map((column) => new Vector3().setFromMatrixColumn(view.matrixWorld, column));
    const vertical = Math.tan((view.fov * Math.PI) / 360);
    let distance = 0;
    for (let corner = 0; corner < 8; corner++) {
      const point = new Vector3(...halfSides.map((half, axis) => (corner & (1 << axis) ? half : -half)));
      const [x, y, z] = axes.map((axis) => axis.dot(point));
      distance = Math.max(distance, z + Math.abs(y) / vertical, z + Math.abs(x) / (vertical * view.aspect));
    }
    return Math.max(MARGIN * distance, 0.1);
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.renderer.domElement;
    if (!width || !height) return;
    const most = this.hasGpu ? MAX_PIXEL_RATIO : Math.min(1, Math.sqrt(MAX_SOFTWARE_PIXELS / (width * height)));
    const ratio = Math.min(devicePixelRatio, most);
    const size = `${width} ${height} ${ratio}`;
    if (size === this.size) return; // to set it, even to what it was, takes time
    this.size = size;
    this.renderer.setDrawingBufferSize(width, height, ratio);
    const aspect = width / height;
    this.camera.aspect = aspect;
    const shorter = Math.tan((FIELD_OF_VIEW * Math.PI) / 360);
    this.camera.fov = (360 / Math.PI) * Math.atan(aspect < 1 ? shorter / aspect : shorter);
    this.camera.updateProjectionMatrix();
    if (this.isFramed) this.resetView();
    this.requestRender();
  }
}

let found = null; // what `probeGpu` has found

/** Whether WebGL is drawn by hardware, by the name that the browser gives its renderer. */
export function probeGpu() {
  found ??= probe();
  return found;
}

function probe() {
  const context = document.createElement("canvas").getContext("webgl2");
  if (!context) return false;
  const named = context.getExtension("WEBGL_debug_renderer_info");
  const name = context.getParameter(named ? named.UNMASKED_RENDERER_WEBGL : context.RENDERER);
  context.getExtension("WEBGL_lose_context")?.loseContext();
  return !SOFTWARE.test(name);
}

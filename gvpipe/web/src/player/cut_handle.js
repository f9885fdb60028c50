/** A frame where a plane cuts the mesh, and a ball in its middle that is dragged along the plane's normal. */

import { BufferAttribute, BufferGeometry, Group, LineBasicMaterial, LineLoop, Points, PointsMaterial, Raycaster, Vector2, Vector3 } from "three";

const COLOUR = 0x2f6fb3;
const SIZE = 14; // pixels of the ball
const REACH = 16; // CSS pixels around it, where a pointer takes it
const LOOK = { color: COLOUR, depthTest: false, transparent: true };

export class CutHandle extends Group {
  #canvas;
  #camera;
  #dragged;
  #cut = null;
  #box = null;
  #drag = null; // {pointer, offset}
  #listeners = { pointerdown: (event) => this.#down(event), pointermove: (event) => this.#move(event), pointerup: (event) => this.#up(event), pointercancel: (event) => this.#up(event) };

  /**
   * @param {HTMLCanvasElement} canvas @param {import("three").Camera} camera
   * @param {(place: number) => void} dragged called with the place along the axis that the plane is dragged to, in the scene
   */
  constructor(canvas, camera, dragged) {
    super();
    this.#canvas = canvas;
    this.#camera = camera;
    this.#dragged = dragged;
    const points = (count) => new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(3 * count), 3));
    this.frame = new LineLoop(points(4), new LineBasicMaterial({ ...LOOK, opacity: 0.7 }));
    this.ball = new Points(points(1), new PointsMaterial({ ...LOOK, size: SIZE, sizeAttenuation: false }));
    for (const each of [this.frame, this.ball]) this.add(Object.assign(each, { frustumCulled: false, renderOrder: 1 }));
    for (const [name, listener] of Object.entries(this.#listeners)) canvas.addEventListener(name, listener, { capture: true });
    this.show(null);
  }

  /** Whether it is drawn where there is a cut. */
  set isDrawn(isDrawn) {
    this.visible = isDrawn && this.#cut !== null;
  }

  /** @param {{axis: number, place: number}|null} cut in the scene @param {import("three").Box3|null} box of the motion */
  show(cut, box = null) {
    this.#cut = cut;
    this.#box = box;
    this.visible = cut !== null;
    if (!cut) return;
    const [u, v] = [(cut.axis + 1) % 3, (cut.axis + 2) % 3];
    const { array } = this.frame.geometry.attributes.position;
    [["min", "min"], ["max", "min"], ["max", "max"], ["min", "max"]].forEach(([first, second], corner) => {
      array[3 * corner + cut.axis] = cut.place;
      array[3 * corner + u] = box[first].getComponent(u);
      array[3 * corner + v] = box[second].getComponent(v);
    });
    this.ball.geometry.attributes.position.array.set(this.#middle().toArray());
    for (const each of [this.frame, this.ball]) each.geometry.attributes.position.needsUpdate = true;
  }

  dispose() {
    for (const [name, listener] of Object.entries(this.#listeners)) this.#canvas.removeEventListener(name, listener, { capture: true });
    for (const each of [this.frame, this.ball]) {
      each.geometry.dispose();
      each.material.dispose();
    }
  }

  #middle() {
    return this.#box.getCenter(new Vector3()).setComponent(this.#cut.axis, this.#cut.place);
  }

  #down(event) {
    if (!this.visible || event.button !== 0) return;
    const { left, top, width, height } = this.#canvas.getBoundingClientRect();
    const place = this.#middle().project(this.#camera);
    const away = Math.hypot(left + ((place.x + 1) / 2) * width - event.clientX, top + ((1 - place.y) / 2) * height - event.clientY);
    if (away > REACH) return;
    event.stopImmediatePropagation();
    this.#drag = { pointer: event.pointerId, offset: this.#cut.place - this.#along(event) };
    this.#canvas.setPointerCapture?.(event.pointerId);
  }

  #move(event) {
    if (event.pointerId !== this.#drag?.pointer || !this.#cut) return;
    event.stopImmediatePropagation();
    const { axis } = this.#cut;
    const wanted = this.#along(event) + this.#drag.offset;
    if (Number.isFinite(wanted)) this.#dragged(Math.min(this.#box.max.getComponent(axis), Math.max(this.#box.min.getComponent(axis), wanted)));
  }

  #up(event) {
    if (event.pointerId !== this.#drag?.pointer) return;
    event.stopImmediatePropagation();
    this.#drag = null;
  }

  /** Where on the line through the ball along the axis a pointer's ray comes closest to it; NaN where both are parallel. */
  #along({ clientX, clientY }) {
    const { left, top, width, height } = this.#canvas.getBoundingClientRect();
    const caster = new Raycaster();
    caster.setFromCamera(new Vector2((2 * (clientX - left)) / width - 1, 1 - (2 * (clientY - top)) / height), this.#camera);
    const { origin, direction } = caster.ray;
    const { axis } = this.#cut;
    const between = this.#middle().sub(origin);
    const slope = direction.getComponent(axis);
    const across = 1 - slope * slope;
    return across < 1e-6 ? NaN : this.#cut.place + (slope * direction.dot(between) - between.getComponent(axis)) / across;
  }
}

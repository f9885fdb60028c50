/** What a plane shows of the inside of a mesh: the section of its volume, in one colour or in the colours of a field. */

import { BufferAttribute, BufferGeometry, DynamicDrawUsage, Mesh } from "three";
import { frameOf } from "../fields/coded_field.js";
import { length } from "../fields/length.js";
import { Section } from "../volume/section.js";
import { UV_NAME, fieldMaterial, partsOf, placeInMap } from "./field_colours.js";
import { plainMaterial } from "./materials.js";
import { pickTriangle } from "./picking.js";

const NEAR = 1e-6; // behind the plane, as a part of a ray's direction

/**
 * @typedef {object} Shown a frame, and how it is shown
 * @property {number} k its number @property {Float32Array} surface (V, 3) its vertices, in the geometry's units
 * @property {{centre: number[], scale: number}} view of these units
 * @property {{field: import("../fields/coded_field.js").CodedField, scale: number}|null} warp what moves vertices
 *
 * @typedef {object} Colours
 * @property {import("../fields/coded_field.js").CodedField} field @property {string} colormap
 * @property {[number, number]} range @property {boolean} isLog
 */

export class FilledCut extends Mesh {
  #volume;
  #points; // (N, 3) of all points, in the geometry's units
  #section = new Section();
  #plain = plainMaterial(false);
  #colours = null; // Colours

  /** @param {import("../volume/volume.js").Volume} volume that is open @param {number} vertexCount V */
  constructor(volume, vertexCount) {
    super(new BufferGeometry());
    this.material = this.#plain;
    Object.assign(this, { frustumCulled: false, raycast() {} });
    this.#volume = volume;
    this.#points = new Float32Array(3 * (vertexCount + volume.pointCount));
  }

  /** (n, 3, 3) corners of the triangles that are shown, in the geometry's units. */
  get corners() {
    const position = this.visible && this.geometry.getAttribute("position");
    return position ? position.array.subarray(0, 9 * this.#section.count) : new Float32Array(0);
  }

  /** Show a field's colours, or one colour. @param {Colours|null} colours */
  setColours(colours) {
    if (this.material !== this.#plain) freeMaterial(this.material);
    this.#colours = colours?.field.kind === "color" ? null : colours;
    this.material = this.#colours ? fieldMaterial(colours.colormap, false) : this.#plain;
  }

  /** A promise that frame k is in memory, moved by a warp or by none. */
  load(k, warp) {
    const fields = [this.#volume.points, warp && this.#inside(warp.field), this.#colours?.field, this.#colours && this.#inside(this.#colours.field)];
    return Promise.all(fields.map((field) => field?.load(frameOf(field, k))));
  }

  /**
   * @param {Shown} shown @param {{axis: number, place: number, sign: number}} plane in the geometry's units
   * @returns {boolean} whether all of it was in memory; if not, nothing is shown, and `load` brings it
   */
  update(shown, { axis, place, sign }) {
    this.visible = this.#placePoints(shown) && this.#isHere(shown.k);
    if (!this.visible) return false;
    this.#section.cut(this.#volume.grid, this.#points, axis, place, sign);
    this.#fill(axis, sign);
    if (this.#colours) this.#colour(shown.k);
    return true;
  }

  /**
   * What a ray that starts at the plane meets of the section there: the nearest point of the grid, of those whose edges meet at the nearest
   * corner of a triangle, and the cell of that triangle.
   *
   * @param {number[]} start @param {number[]} direction @returns {{point: number, cell: number}|null}
   */
  pick(start, direction) {
    const { corners } = this;
    const indices = Uint32Array.from({ length: corners.length / 3 }, (_, i) => i);
    const before = start.map((value, axis) => value - direction[axis]);
    const met = pickTriangle(before, direction, corners, indices, [[0, indices.length / 3]], 1 + NEAR);
    if (!met) return null;
    const { ends, parts, cells } = this.#section;
    return { point: ends[2 * met.vertex + (parts[met.vertex] > 0.5 ? 1 : 0)], cell: cells[met.triangle] };
  }

  dispose() {
    this.setColours(null);
    this.#plain.dispose();
    this.geometry.dispose();
  }

  /** A field's numbers inside, or null. */
  #inside(field) {
    return this.#volume.number(field.domain === "triangle" ? "cell" : "point", field.name)?.field ?? null;
  }

  #isHere(k) {
    if (!this.#colours) return true;
    const inside = this.#inside(this.#colours.field);
    return Boolean(valuesOf(this.#colours.field, k) && (!inside || valuesOf(inside, k)));
  }

  #placePoints({ k, surface, view: { centre, scale }, warp }) {
    const [points, start] = [this.#points, surface.length];
    points.set(surface);
    if (!this.#volume.points) return true;
    const inner = valuesOf(this.#volume.points, k);
    const moves = warp && this.#inside(warp.field);
    const moved = moves && valuesOf(moves, k);
    if (!inner || (moves && !moved)) return false;
    for (let i = 0; i < inner.length; i++) points[start + i] = (inner[i] - centre[i % 3]) * scale;
    const width = moves?.components ?? 0;
    for (let i = 0; i < width * this.#volume.pointCount; i++) {
      points[start + 3 * Math.floor(i / width) + (i % width)] += warp.scale * scale * moved[i] || 0; // holes move nothing
    }
    return true;
  }

  #fill(axis, sign) {
    const section = this.#section;
    const position = this.#room("position", 3);
    const normal = this.#room("normal", 3).fill(0);
    for (let t = 0; t < section.count; t++) {
      section.place(t, this.#points, position);
      if (sign * area(position, 9 * t, axis) < 0) {
        section.turn(t); // to be seen from the side that is left out
        section.place(t, this.#points, position);
      }
      for (let i = 0; i < 3; i++) normal[9 * t + 3 * i + axis] = sign;
    }
    this.geometry.setDrawRange(0, 3 * section.count);
  }

  #colour(k) {
    const { field, range, isLog } = this.#colours;
    const [inside, section, grid] = [this.#inside(field), this.#section, this.#volume.grid];
    const [on, within] = [valuesOf(field, k), inside && valuesOf(inside, k)];
    const partOf = partsOf(range, isLog);
    const part = (values, row) => (values ? partOf(numberOf(values, row, field.components)) : NaN);
    const places = this.#room(UV_NAME, 2);
    const byCell = field.domain === "triangle";
    const ofPoint = (node) => (node < field.rowCount ? part(on, node) : part(within, node - field.rowCount));
    const ofCell = (cell) => (grid.triangles[cell] >= 0 ? part(on, grid.triangles[cell]) : part(within, grid.rows[cell]));
    for (let corner = 0; corner < 3 * section.count; corner++) {
      const [a, b] = [section.ends[2 * corner], section.ends[2 * corner + 1]];
      const from = byCell ? ofCell(section.cells[Math.floor(corner / 3)]) : ofPoint(a);
      const found = byCell || a === b ? from : from + section.parts[corner] * (ofPoint(b) - from);
      placeInMap(places, corner, found);
    }
  }

  /** The array of a geometry's attribute, with room for all corners; it goes to the GPU. */
  #room(name, width) {
    const size = 3 * width * this.#section.count;
    let attribute = this.geometry.getAttribute(name);
    if (!attribute || attribute.array.length < size) {
      if (attribute) this.geometry.dispose();
      attribute = new BufferAttribute(new Float32Array(2 * size), width).setUsage(DynamicDrawUsage);
      this.geometry.setAttribute(name, attribute);
    }
    attribute.needsUpdate = true;
    return attribute.array;
  }
}

function numberOf(values, row, width) {
  return width > 1 ? length(values, row * width, width) : values[row];
}

function valuesOf(field, k) {
  return field.values(frameOf(field, k));
}

/** Twice the area of a triangle, seen along an axis; below 0 if it runs clockwise. */
function area(position, start, axis) {
  const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
  const [x, y] = [position[start + u], position[start + v]];
  return (position[start + 3 + u] - x) * (position[start + 6 + v] - y) - (position[start + 3 + v] - y) * (position[start + 6 + u] - x);
}

function freeMaterial(material) {
  material.map?.dispose();
  material.dispose();
}

/**
 * What lies inside of a surface: cells, inner points, and numbers on both, decoded when they are asked for. Mirrors
 * `gvpipe.asset_coding.volume_list` and `gvpipe.asset_coding.volume_reader`.
 */

import {
  DIRECTORY_MOST as MAX_ITEMS,
  DIRECTORY_REDUCED as REDUCED,
  ENCODER_CODED as CODED,
  VOLUME_LIST_CELLS as CELLS,
  VOLUME_LIST_MAX_BYTES as MAX_BYTES,
  VOLUME_LIST_MOST_CELLS as MOST_CELLS,
  VOLUME_LIST_MOST_POINTS as MOST_POINTS,
  VOLUME_LIST_ORDER as ORDER,
  VOLUME_LIST_POINTS as POINTS,
  VOLUME_LIST_SECTION as SECTION,
  VOLUME_LIST_VERSION as VERSION,
  VOLUME_READER_BYTES_PER_CELL as BYTES_PER_CELL,
  VOLUME_READER_BYTES_PER_POINT as BYTES_PER_POINT,
  VOLUME_READER_SECONDS_PER_CELL as SECONDS_PER_CELL,
  VOLUME_READER_SECONDS_PER_POINT as SECONDS_PER_POINT,
} from "../constants.js";
import { AssetEntry } from "../asset/asset_entry.js";
import { readJson } from "../asset/json.js";
import { CodedField } from "../fields/coded_field.js";
import { FieldHost } from "../fields/field_host.js";
import { TYPES } from "../fields/head.js";
import { readReduction } from "../fields/reduction.js";
import { corrupt } from "../format/errors.js";

const MAX_COMPONENTS = 64;
const HUGE = 3.5e38; // above float32's largest number
const NO_REDUCTION = { polygons: null, columns: null, offsets: null, components: 3 };

/** Whether a file has something inside of its surface. @param {import("../format/payload.js").Payload} payload */
export function hasVolume(payload) {
  return payload.sections.has(SECTION) || payload.late.has(SECTION);
}

/**
 * @param {import("../format/payload.js").Payload} payload of a file that `hasVolume`
 * @param {{code: Uint8Array, faces: Int32Array, vertexCount: number, polygons: Int32Array|null, frameCount: number}} surface and the
 *   code of kernels
 * @param {string[]} notes to which a line is added where nothing is returned
 * @returns {Promise<Volume|null>} null: a newer gvpipe wrote it, or it has polyhedra
 * @throws {GeometryVideoError} it is not as gvpipe writes it
 */
export async function readVolume(payload, surface, notes) {
  const data = await sectionOf(payload, SECTION);
  const list = new AssetEntry(await readJson(data, payload.budget, MAX_BYTES, SECTION), "the volume's list");
  if (list.integer("version", undefined, 1, 2 ** 31) > VERSION) {
    notes.push("what lies inside is not shown: a newer gvpipe wrote it");
    return null;
  }
  if (list.flag("polyhedra", false)) {
    notes.push("what lies inside is not shown: it has polyhedra, which gvpipe's Python alone decodes");
    return null;
  }
  const counts = {
    vertices: surface.vertexCount,
    inner: list.integer("points", undefined, 0, MOST_POINTS),
    cells: list.integer("cells", undefined, 0, MOST_CELLS),
  };
  counts.points = counts.vertices + counts.inner;
  const numbers = list.list("numbers", MAX_ITEMS).map((given) => readNumber(new AssetEntry(given, "a volume's number")));
  if (new Set(numbers.map(({ entry }) => `${entry.domain} ${entry.name}`)).size !== numbers.length) {
    throw corrupt(SECTION, "two numbers of points or of cells have one name");
  }
  return new Volume(payload, surface, counts, list.number("bound", undefined, 0, HUGE), numbers);
}

function readNumber(listed) {
  const coding = listed.integer("coding", undefined, 0, MAX_ITEMS);
  const entry = {
    name: listed.text("name"),
    domain: listed.word("domain", ["point", "cell"]),
    type: listed.word("dtype", TYPES),
    kind: listed.text("kind"),
    components: listed.integer("components", undefined, 0, MAX_COMPONENTS),
    unit: listed.text("unit", ""),
    bound: listed.number("bound", 0, 0, HUGE),
    range: listed.given.range == null ? null : listed.numbers("range", 2, undefined, -HUGE, HUGE),
    section: listed.text("section"),
    fullScale: 1,
  };
  const member = coding === REDUCED ? new AssetEntry(listed.given.reduced, `number ${entry.name}`) : null;
  const reduction = readReduction(member, entry.components || 1, entry.domain, null);
  return { entry, reduction, isKnown: coding === CODED || coding === REDUCED, moves: listed.flag("moves", true) };
}

async function sectionOf(payload, name) {
  return payload.late.has(name) ? payload.late.get(name)() : payload.section(name);
}

/**
 * What a ray meets: of the surface a triangle and its nearest vertex; of a section a cell, and a point of the grid near it, which is a vertex or
 * lies inside.
 *
 * @typedef {object} Picked
 * @property {number|null} vertex @property {number|null} triangle @property {string|null} part
 * @property {number} [point] @property {number} [cell] of a section alone
 */

/**
 * Points are numbered: the surface's vertices, then inner ones.
 *
 * @typedef {object} Grid
 * @property {Uint8Array} types (M) VTK's numbers @property {Int32Array} offsets (M + 1) @property {Int32Array} nodes
 * @property {Int32Array} triangles (M) the surface's triangle whose numbers a cell has, -1 for inner cells
 * @property {Int32Array} inner numbers of the inner cells @property {Int32Array} rows (M) of inner cells among these, else -1
 */
export class Volume {
  #payload;
  #surface;
  #counts;
  #numbers;
  #opening = null; // a promise of the grid
  #host = null;
  #fields = new Map(); // section -> CodedField

  constructor(payload, surface, counts, bound, numbers) {
    this.#payload = payload;
    this.#surface = surface;
    this.#counts = counts;
    this.#numbers = new Map(numbers.filter(({ isKnown }) => isKnown).map((each) => [`${each.entry.domain} ${each.entry.name}`, each]));
    this.cellCount = counts.cells;
    /** I, of inner points. */
    this.pointCount = counts.inner;
    /** Largest error of a coordinate of an inner point. */
    this.bound = bound;
    /** The `Grid`, once it is open, else null. */
    this.grid = null;
    /** A `CodedField` of the inner points' coordinates, (I, 3) a frame; null before it is open, and where there are none. */
    this.points = null;
  }

  /** Decode the cells: a promise of the grid. What fails is tried again by the next call. @returns {Promise<Grid>} */
  open() {
    this.#opening ??= this.#open().catch((error) => {
      this.#opening = null;
      throw error;
    });
    return this.#opening;
  }

  async #open() {
    const { cells, points, inner } = this.#counts;
    const memory = BYTES_PER_CELL * cells + BYTES_PER_POINT * points;
    this.#payload.budget.keep("the volume", memory, SECONDS_PER_CELL * cells + SECONDS_PER_POINT * points);
    const sections = { cells: await sectionOf(this.#payload, CELLS), order: await sectionOf(this.#payload, ORDER) };
    const { code, faces, vertexCount, polygons } = this.#surface;
    const volume = { sections: { cells: sections.cells.slice(), order: sections.order.slice() }, counts: this.#counts };
    this.#host?.close();
    const none = () => Promise.reject(corrupt(SECTION, "its values follow from positions of the surface"));
    this.#host = new FieldHost(code, faces, vertexCount, polygons, none, volume);
    this.grid = await this.#host.decode({ domain: "grid", name: CELLS });
    const about = { name: "points", kind: "vector", domain: "point", type: "float32", components: 3, unit: "", range: null, fullScale: 1 };
    if (inner) this.points = this.#fieldOf({ ...about, section: POINTS, bound: this.bound }, this.#surface.frameCount, inner, NO_REDUCTION);
    return this.grid;
  }

  /**
   * Numbers of inner points (I) or of inner cells, once the volume is open.
   *
   * @param {"point"|"cell"} domain @param {string} name
   * @returns {{field: CodedField|null, moves: boolean}|null} `field` is null where all rows are the surface's; null: there are none of that name
   */
  number(domain, name) {
    const found = this.#numbers.get(`${domain} ${name}`);
    if (!found || !this.grid) return null;
    const rows = domain === "point" ? this.#counts.inner : this.grid.inner.length;
    const field = rows ? this.#fieldOf(found.entry, found.moves ? this.#surface.frameCount : 1, rows, found.reduction) : null;
    return { field, moves: found.moves };
  }

  /**
   * Where a field has the value of what was picked on a section: in a row of its own, or of its numbers inside.
   *
   * @param {CodedField} field of the surface @param {{point: number, cell: number}} picked
   * @returns {{field: CodedField, row: number}|null} null: nothing is known there
   */
  rowOf(field, { point, cell }) {
    const isCell = field.domain === "triangle";
    const own = isCell ? this.grid.triangles[cell] : point < this.#counts.vertices ? point : -1;
    if (own >= 0) return { field, row: own };
    const inside = this.number(isCell ? "cell" : "point", field.name)?.field;
    return inside ? { field: inside, row: isCell ? this.grid.rows[cell] : point - this.#counts.vertices } : null;
  }

  #fieldOf(entry, frameCount, rowCount, reduction) {
    if (!this.#fields.has(entry.section)) {
      const shape = { frameCount, rowCount, isOctahedral: false, reduction };
      this.#fields.set(entry.section, new CodedField(entry, shape, this.#host, this.#payload));
    }
    return this.#fields.get(entry.section);
  }

  close() {
    this.#host?.close();
  }
}

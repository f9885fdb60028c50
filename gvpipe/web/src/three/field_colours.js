/** A field's values as colours of the mesh: a number per vertex looks its colour up in a texture, pixel by pixel. */

import {
  BufferAttribute,
  ClampToEdgeWrapping,
  DataTexture,
  DoubleSide,
  DynamicDrawUsage,
  LinearFilter,
  MeshLambertMaterial,
  SRGBColorSpace,
} from "three";
import { length } from "../fields/length.js";
import { HOLE, SIZE, colourTable } from "./colormaps.js";
import { OFFSET } from "./materials.js";
import { toLinear } from "./vertex_attributes.js";

const UV_CHANNEL = 3; // the last of three.js's uv sets; materials have the others
export const UV_NAME = `uv${UV_CHANNEL}`;
const HOLE_ROW = 1; // v of vertices without a value; 0 for the others
const ROWS = 16; // of pixels of the texture

/** A field's colours at the vertices of a mesh, frame by frame, in arrays that stay. */
export class FieldColours {
  /**
   * @param {import("../fields/coded_field.js").CodedField} field
   * @param {Uint32Array} rows (R) the field's row of each render vertex
   * @param {Float32Array|null} table (SIZE, 3) linear colours for vertices; null: vertices get their place in a texture
   */
  constructor(field, rows, table) {
    this.field = field;
    this.rows = rows;
    this.table = table;
    const Values = field.type === "float64" ? Float64Array : Float32Array;
    this.values = new Values(field.rowCount * field.components);
    this.isColour = field.kind === "color";
    /** Of the geometry's attribute: vertex colours, or coordinates in the texture. */
    this.name = this.isColour || table ? "color" : UV_NAME;
    const width = this.name === "color" ? 3 : 2;
    this.attribute = new BufferAttribute(new Float32Array(width * rows.length), width).setUsage(DynamicDrawUsage);
    this.frame = -1;
  }

  /**
   * Make the colours of frame k.
   *
   * @param {number} k @param {[number, number]} range @param {boolean} isLog whether places follow the logarithm
   * @returns {boolean} whether its values were in memory; if not, `field.load` brings them
   */
  update(k, [low, high], isLog) {
    if (!this.field.read(k, this.values)) return false;
    this.frame = k;
    if (this.isColour) this.#copyColours();
    else this.#place(low, high, isLog);
    this.attribute.needsUpdate = true;
    return true;
  }

  #place(low, high, isLog) {
    const { values, rows, table } = this;
    const { components } = this.field;
    const { array } = this.attribute;
    const part = partsOf([low, high], isLog);
    for (let r = 0; r < rows.length; r++) {
      let value = values[rows[r] * components];
      if (components > 1) value = length(values, rows[r] * components, components);
      const found = part(value);
      if (table) {
        const colour = found !== found ? 3 * SIZE : 3 * Math.round(within(found) * (SIZE - 1)); // NaN
        for (let i = 0; i < 3; i++) array[3 * r + i] = table[colour + i];
      } else {
        placeInMap(array, r, found);
      }
    }
  }

  #copyColours() {
    const { values, rows } = this;
    const { components } = this.field;
    const { array } = this.attribute;
    const { fullScale } = this.field;
    for (let r = 0; r < rows.length; r++) {
      for (let i = 0; i < 3; i++) {
        const value = values[rows[r] * components + i] / fullScale || 0;
        array[3 * r + i] = fullScale > 1 ? toLinear(value) : value; // integers are sRGB
      }
    }
  }
}

/** What part of a range a value has reached, as a function of the value; NaN for what has no colour. */
export function partsOf([lowest, highest], isLog) {
  const [low, high] = isLog ? [Math.log(lowest), Math.log(highest)] : [lowest, highest];
  const scale = high > low ? 1 / (high - low) : 0;
  const offset = high > low ? 0 : 0.5;
  return (given) => {
    const value = !isLog ? given : given > 0 ? Math.log(given) : NaN;
    return (value - low) * scale + offset;
  };
}

/** Where a vertex's part of the range is in the texture of a colour map. @param {Float32Array} array (R, 2) @param {number} r */
export function placeInMap(array, r, part) {
  const isHole = part !== part; // NaN
  array[2 * r] = isHole ? 0 : within(part) * (1 - 1 / SIZE) + 0.5 / SIZE; // middles of pixels
  array[2 * r + 1] = isHole ? HOLE_ROW : 0;
}

function within(part) {
  return Math.min(1, Math.max(0, part));
}

/** (SIZE + 1, 3): the colour map and the colour of holes as linear light, for vertices of their own. */
export function linearTable(colormap) {
  return Float32Array.from([...colourTable(colormap), ...HOLE], (byte) => toLinear(byte / 255));
}

/** The colours' range: that of the field, from 0 for lengths; about 0 for a diverging map. */
export function rangeOf(field, colormap) {
  if (!field.range) return [0, 0];
  if (field.components > 1) return [0, field.largest];
  const [low, high] = field.range;
  if (colormap !== "coolwarm" || low >= 0 || high <= 0) return [low, high];
  const most = Math.max(-low, high);
  return [-most, most];
}

/** Whether colours follow the logarithm: where that is asked for, and the range lies above 0. */
export function isLogarithmic(scale, [low, high]) {
  return scale === "log" && low > 0 && high > low;
}

/** A material that shows a colour map by texture coordinates; of colours, vertex colours. */
export function fieldMaterial(colormap, isColour) {
  const material = new MeshLambertMaterial({ side: DoubleSide, vertexColors: isColour, ...OFFSET });
  if (!isColour) material.map = mapTexture(colormap);
  return material;
}

/** The colour map in one row of pixels, and the colour of holes in the others: a triangle with a hole is nearly all a hole. */
function mapTexture(colormap) {
  const table = colourTable(colormap);
  const data = new Uint8Array(4 * ROWS * SIZE);
  for (let i = 0; i < ROWS * SIZE; i++) {
    const colour = i < SIZE ? table.subarray(3 * i, 3 * i + 3) : HOLE;
    data.set([...colour, 255], 4 * i);
  }
  const texture = new DataTexture(data, SIZE, ROWS);
  texture.channel = UV_CHANNEL;
  texture.colorSpace = SRGBColorSpace;
  texture.magFilter = texture.minFilter = LinearFilter;
  texture.wrapS = texture.wrapT = ClampToEdgeWrapping;
  texture.needsUpdate = true;
  return texture;
}

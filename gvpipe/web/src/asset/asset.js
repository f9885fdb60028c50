/**
 * What an asset has beside moving positions: section `asset`, JSON that lists it, and the sections that it names. Mirrors what
 * `gvpipe.asset` models; `docs/format.md` has the members.
 */

import {
  DIRECTORY_MAX_BYTES as MAX_BYTES,
  DIRECTORY_MOST as MAX_ITEMS,
  DIRECTORY_SECTION as SECTION,
  DIRECTORY_SURFACE as SURFACE,
  DIRECTORY_OCTAHEDRAL as OCTAHEDRAL,
  DIRECTORY_REDUCED as REDUCED,
  DIRECTORY_VERSION as VERSION,
  ENCODER_ARRANGEMENT as ARRANGEMENT,
  ENCODER_CODED as CODED,
  TIMES_SECTION as TIMES,
} from "../constants.js";
import { decodeAttribute } from "../attributes/attribute_coding.js";
import { Surface } from "../attributes/surface.js";
import { decodeArrangement } from "../attributes/triangle_order.js";
import { corrupt } from "../format/errors.js";
import { CodedField } from "../fields/coded_field.js";
import { FieldHost } from "../fields/field_host.js";
import { TYPES } from "../fields/head.js";
import { readReduction } from "../fields/reduction.js";
import { Kernels } from "../wasm/kernels.js";
import { hasVolume, readVolume } from "../volume/volume.js";
import { kernelCode } from "../wasm/inflated.js";
import { AssetEntry } from "./asset_entry.js";
import { readJson } from "./json.js";
import { readImages, readMaterials } from "./materials.js";
import { readTimes } from "./times.js";

const MAX_PARTS = 2 ** 22;
const MAX_COMPONENTS = 64;
const HUGE = 3.5e38; // above float32's largest number
export const KINDS = ["uv", "normal", "tangent", "color", "scalar", "vector", "label"];
export const DOMAINS = ["vertex", "corner", "triangle", "part"];
const WIDTHS = { uv: [2], normal: [3], tangent: [3, 4], color: [3, 4] }; // components of a kind; others have any number
const NEWER = "what the file has beside positions is not shown: a newer gvpipe wrote it";
const FULL_SCALES = { uint8: 255, uint16: 65535, uint32: 2 ** 32 - 1 };

export const NO_ASSET = {
  indices: null,
  parts: [],
  attributes: new Map(),
  fields: new Map(),
  materials: [],
  images: [],
  polygons: null,
  volume: null,
  metadata: {},
  notes: [],
  close() {},
};

/**
 * @param {import("../format/payload.js").Payload} payload
 * @param {import("../geometry_video.js").GeometryVideo} video of its positions
 * @param {(frame: number) => Promise<Float32Array>} positions of any frame, beside what the video shows
 * @returns {Promise<typeof NO_ASSET>} `indices` are the triangles in the asset's order
 * @throws {GeometryVideoError} a member or a section is not as gvpipe writes it
 */
export async function readAsset(payload, video, positions) {
  const list = await readList(payload);
  if (!list) return payload.sections.has(SECTION) ? { ...NO_ASSET, notes: [NEWER] } : NO_ASSET;
  const images = readImages(list.list("images", MAX_ITEMS), payload);
  const materials = readMaterials(list.list("materials", MAX_ITEMS), images.length);
  const notes = [];
  const code = await kernelCode();
  const kernels = await Kernels.open(code);
  const { parts, indices, polygons } = readParts(kernels, list, payload, video, materials.length);
  const first = list.flag("geometry", false) ? await video.frame(0) : null;
  const attributes = readAttributes(list, payload, new Surface(kernels, indices, video.vertexCount, first, parts.length), notes);
  const faces = Int32Array.from(indices);
  const host = new FieldHost(code, faces, video.vertexCount, polygons, positions);
  const { frameCount, vertexCount, triangleCount } = video;
  const fields = readFields(list, payload, { frameCount, vertexCount, triangleCount, polygons, host }, notes);
  const metadata = await readMetadata(list, payload);
  const surface = { code, faces, vertexCount, polygons, frameCount };
  const volume = hasVolume(payload) ? await readVolume(payload, surface, notes) : null;
  const close = () => {
    host.close();
    volume?.close();
  };
  return { indices, parts, attributes, fields, materials, images, polygons, volume, metadata, notes, close };
}

/** What a coarser level of detail has of an asset: its metadata. @returns {Promise<typeof NO_ASSET>} @throws {GeometryVideoError} */
export async function readCoarseAsset(payload) {
  const list = await readList(payload);
  return { ...NO_ASSET, metadata: list ? await readMetadata(list, payload) : {} };
}

/** What a scene says of itself; `times` of the frames as a Float64Array, where they do not follow from the rate. */
async function readMetadata(list, payload) {
  const metadata = { ...list.given.metadata };
  const data = payload.sections.get(TIMES);
  if (data) metadata.times = await readTimes(data, payload.header.frames);
  return metadata;
}

/** The list of what an asset has; null if a file has none, or one of a newer gvpipe. */
async function readList(payload) {
  if (!payload.sections.has(SECTION)) return null;
  const list = new AssetEntry(await readJson(payload.section(SECTION), payload.budget, MAX_BYTES, SECTION), "the list");
  return list.integer("version", undefined, 1, 2 ** 31) > VERSION ? null : list;
}

function readParts(kernels, list, payload, { indices: decoded, vertexCount }, nMaterials) {
  const parts = list.list("parts", MAX_PARTS).map((given, number) => {
    const entry = new AssetEntry(given, `part ${number}`);
    const [start, stop] = entry.numbers("vertices", 2, undefined, 0, vertexCount);
    if (!(Number.isInteger(start) && Number.isInteger(stop) && start <= stop)) throw corrupt(SECTION, `part ${number}: its vertices are none`);
    const material = given.material == null ? null : entry.integer("material", undefined, 0, nMaterials - 1);
    return { name: entry.text("name", ""), vertices: [start, stop], triangles: [0, 0], material, parent: entry.text("parent", "") };
  });
  const data = payload.sections.get(ARRANGEMENT) ?? new Uint8Array(0);
  const arranged = decodeArrangement(kernels, data, decoded, parts.length || 1, vertexStarts(parts, vertexCount), ARRANGEMENT);
  parts.forEach((part, number) => (part.triangles = arranged.partStarts.slice(number, number + 2)));
  return { parts, indices: arranged.faces, polygons: arranged.polygons };
}

/** First vertex of each part, then V, if each has vertices of its own; else null. */
function vertexStarts(parts, vertexCount) {
  const starts = [...parts.map(({ vertices }) => vertices[0]), vertexCount];
  const isOwn = parts.length > 0 && starts[0] === 0 && parts.every(({ vertices }, number) => vertices[1] === starts[number + 1]);
  return isOwn ? starts : null;
}

function readAttributes(list, payload, surface, notes) {
  const attributes = new Map();
  const references = [];
  let isBeyond = false;
  for (const given of list.list("attributes", MAX_ITEMS)) {
    const entry = new AssetEntry(given, "an attribute");
    const name = entry.text("name");
    const section = entry.text("section");
    const domain = entry.word("domain", DOMAINS);
    const kind = entry.word("kind", KINDS);
    if (attributes.has(name)) throw corrupt(SECTION, `there are two attributes ${name}`);
    if (isBeyond || entry.integer("coding", undefined, 0, MAX_ITEMS) !== CODED) {
      notes.push(`attribute ${name} is not shown: a newer gvpipe wrote it`);
      isBeyond ||= domain === "corner"; // later ones may refer to it
      continue;
    }
    const { values, components, type, corners } = decodeAttribute(payload.section(section), surface, section, domain, references);
    if (components !== given.components || type !== given.dtype) throw corrupt(section, "it does not hold what section 'asset' lists");
    if (WIDTHS[kind] && !WIDTHS[kind].includes(components)) throw corrupt(SECTION, `attribute ${name} has ${components} components`);
    if (corners) references.push(corners);
    const [unit, fullScale] = [entry.text("unit", ""), FULL_SCALES[type] ?? 1];
    attributes.set(name, { name, domain, kind, components, unit, type, values, indices: corners, fullScale });
  }
  return attributes;
}

function readFields(list, payload, { frameCount, vertexCount, triangleCount, polygons, host }, notes) {
  const fields = new Map();
  const names = new Set();
  for (const given of list.list("fields", MAX_ITEMS)) {
    const entry = new AssetEntry(given, "a field");
    const name = entry.text("name");
    if (names.has(name)) throw corrupt(SECTION, `there are two fields ${name}`);
    names.add(name);
    const coding = entry.integer("coding", undefined, 0, MAX_ITEMS);
    const problem = obstacle(coding, given);
    if (problem) {
      notes.push(`field ${name} is not shown: ${problem}`);
      continue;
    }
    const checked = {
      name,
      domain: entry.word("domain", ["vertex", "triangle"]),
      type: entry.word("dtype", TYPES),
      kind: entry.word("kind", KINDS),
      components: entry.integer("components", undefined, 0, MAX_COMPONENTS),
      unit: entry.text("unit", ""),
      bound: entry.number("bound", 0, 0, HUGE),
      range: given.range == null ? null : entry.numbers("range", 2, undefined, -HUGE, HUGE),
      section: entry.text("section"),
    };
    const rows = checked.domain === "vertex" ? vertexCount : triangleCount;
    const fullScale = FULL_SCALES[checked.type] ?? 1;
    const member = coding === REDUCED ? new AssetEntry(given.reduced, `field ${name}`) : null;
    const reduction = readReduction(member, checked.components || 1, checked.domain, polygons);
    const shape = { frameCount, rowCount: rows, isOctahedral: coding === OCTAHEDRAL, reduction };
    fields.set(name, new CodedField({ ...checked, fullScale }, shape, host, payload));
  }
  return fields;
}

/** Why a field cannot be read; "" if it can. */
function obstacle(coding, { kind, components }) {
  if (coding === SURFACE) return "it follows from the surface, as the player's own normals do";
  const isKnown = coding === CODED || coding === REDUCED || (coding === OCTAHEDRAL && kind === "normal" && components === 3);
  return isKnown ? "" : "a newer gvpipe wrote it";
}

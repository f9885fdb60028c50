/** The mesh in the scene: its geometry frame by frame, its materials, the parts and the field that are shown. */

import { BufferAttribute, BufferGeometry, DynamicDrawUsage, Group, Mesh, MeshBasicMaterial, Points, PointsMaterial } from "three";
import { FieldColours, fieldMaterial, linearTable, rangeOf } from "./field_colours.js";
import { makeMaterial, plainMaterial } from "./materials.js";
import { Normals, groupCorners, groupVertices } from "./normals.js";
import { PartIndex } from "./part_index.js";
import { cornerEntries, splitVertices } from "./render_vertices.js";
import { Textures } from "./textures.js";
import { colourAttribute, colourArray, uvArray, uvChannels } from "./vertex_attributes.js";

export class Model {
  /**
   * @param {import("../geometry_video.js").GeometryVideo} video
   * @param {Float32Array} positions (V, 3) its first frame
   * @param {{centre: number[], scale: number, hasGpu: boolean, anisotropy: number, environment: () => object}} view how model
   *   units become the scene's, and what the renderer can do
   * @returns {Promise<Model>}
   */
  static async open(video, positions, view) {
    const shown = new Set();
    for (const material of video.materials) {
      for (const value of Object.values(material)) if (value?.uv !== undefined) shown.add(value.image);
    }
    return new Model(video, positions, view, await Textures.open(video.images, shown, view.anisotropy));
  }

  #video;
  #view;
  #textures;
  #groups = null; // (3T) corners that share a normal
  #normals = null;
  #render = null; // RenderVertices
  #isByTriangle = false; // whether no vertex is shared by two triangles: for fields per triangle
  #materials = [];
  #field = null; // FieldColours
  #fieldRange = [0, 0];
  #surface = null; // Mesh or Points
  #wires = null;

  constructor(video, positions, view, textures) {
    this.#video = video;
    this.#view = view;
    this.#textures = textures;
    this.group = new Group();
    /** (V, 3) the frame shown, in the scene's units. */
    this.points = new Float32Array(positions.length);
    this.#place(positions);
    this.frame = 0;
    this.geometry = null;
    this.parts = new PartIndex(video.parts, video.triangleCount);
    this.colours = colourAttribute(video.attributes);
    const { channels, notes } = uvChannels(video.materials, video.attributes);
    this.channels = channels;
    /** What is not shown as it should be, a line each. */
    this.notes = [...notes, ...textures.notes];
    if (video.triangleCount) this.#groupNormals();
    this.#build(false);
    if (video.triangleCount) this.#openSurface();
    else this.#openPoints();
    for (const object of this.group.children) object.frustumCulled = false; // its bounds change with every frame
    this.setPositions(positions, 0);
  }

  /** Show `positions (V, 3)`, model units, and the field's frame k. */
  setPositions(positions, k) {
    this.#place(positions);
    this.frame = k;
    this.#update();
    this.#updateField();
  }

  setWireframe(visible) {
    if (this.#wires) this.#wires.visible = visible;
  }

  /** Show a field by a colour map, from low to high of `range` or of its own; null: the materials. @returns {[number, number]} the range */
  setField(field, colormap = "viridis", range = null) {
    this.#closeField();
    if (!field) {
      this.#surface.material = this.#materials;
      return [0, 0];
    }
    const isByTriangle = field.domain === "triangle";
    if (isByTriangle && !this.#isByTriangle) this.#build(true);
    const { vertices, corners } = this.#render;
    const rows = isByTriangle ? corners.map((c) => (c / 3) | 0) : vertices;
    const isPoints = !this.#video.triangleCount;
    this.#field = new FieldColours(field, rows, isPoints ? linearTable(colormap) : null);
    this.#fieldRange = range ?? rangeOf(field, colormap);
    this.geometry.setAttribute(this.#field.name, this.#field.attribute);
    if (isPoints) this.#surface.material = new PointsMaterial({ size: 3, sizeAttenuation: false, vertexColors: true });
    else this.#surface.material = fieldMaterial(colormap, this.#field.isColour);
    this.#updateField();
    return this.#fieldRange;
  }

  /** Hide the parts of these names. @param {Set<string>} names */
  setHidden(names) {
    this.parts.hide(names);
    if (this.#video.triangleCount) this.parts.fill(this.geometry, this.#render.index);
  }

  dispose() {
    this.#closeField();
    for (const material of [...this.#materials, this.#wires?.material]) material?.dispose();
    this.#textures.dispose();
    this.geometry.dispose();
  }

  /** Called when late values of the field have come, and the scene is to be drawn anew. */
  onChange = () => {};

  /** Called with the error if the field cannot be read. */
  onError = () => {};

  #place(positions) {
    const { points } = this;
    const { centre, scale } = this.#view;
    for (let i = 0; i < points.length; i += 3) {
      points[i] = (positions[i] - centre[0]) * scale;
      points[i + 1] = (positions[i + 1] - centre[1]) * scale;
      points[i + 2] = (positions[i + 2] - centre[2]) * scale;
    }
  }

  #groupNormals() {
    const { indices, basePoints, attributes, parts } = this.#video;
    const normal = attributes.get("normal");
    if (normal?.kind === "normal" && normal.components === 3) {
      this.#groups = groupCorners(indices, basePoints, cornerEntries(normal, indices, parts), normal.values);
    } else {
      const groups = groupVertices(indices, basePoints, this.points);
      this.#groups = indices.map((vertex) => groups[vertex]);
    }
  }

  /** Split vertices as attributes need it, and make the geometry. */
  #build(isByTriangle) {
    const { indices, vertexCount, attributes, parts } = this.#video;
    const used = [...[...this.channels.keys()].map((name) => attributes.get(name)), this.colours].filter(Boolean);
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
    this.geometry.setAttribute("position", dynamic(this.#render.isSplit ? new Float32Array(3 * vertices.length) : this.points));
    if (this.#groups) {
      this.geometry.setAttribute("normal", dynamic(new Float32Array(3 * vertices.length)));
      this.#normals = new Normals(indices, this.#groups, corners.map((c) => this.#groups[c]));
      this.geometry.setIndex(new BufferAttribute(new Uint32Array(index.length), 1));
      this.parts.fill(this.geometry, index);
    }
    const rowsOf = (attribute) => entryOf(attribute, entries.get(attribute), this.#render);
    for (const [name, channel] of this.channels) {
      const array = uvArray(attributes.get(name), rowsOf(attributes.get(name)));
      this.geometry.setAttribute(channel ? `uv${channel}` : "uv", new BufferAttribute(array, 2));
    }
    if (this.colours) {
      this.geometry.setAttribute("color", new BufferAttribute(colourArray(this.colours, rowsOf(this.colours), !this.#video.materials.length), 4));
    }
    for (const object of this.group.children) object.geometry = this.geometry;
    if (this.#surface) this.#update();
  }

  #openSurface() {
    const { materials } = this.#video;
    const hasColours = Boolean(this.colours);
    const scene = { hasColours, hasGpu: this.#view.hasGpu };
    this.#materials = this.parts.materials.map((number) =>
      number === null ? plainMaterial(hasColours) : makeMaterial(materials[number], this.#textures, this.channels, scene),
    );
    for (const material of this.#materials) if (material.metalness > 0) material.envMap = this.#view.environment();
    this.#surface = new Mesh(this.geometry, this.#materials);
    this.#wires = new Mesh(
      this.geometry,
      new MeshBasicMaterial({ color: 0x1d2a38, wireframe: true, transparent: true, opacity: 0.35 }),
    );
    this.#wires.visible = false;
    this.group.add(this.#surface, this.#wires);
  }

  #openPoints() {
    const color = this.colours ? 0xffffff : 0x6f8296;
    this.#materials = new PointsMaterial({ color, size: 3, sizeAttenuation: false, vertexColors: Boolean(this.colours) });
    this.#surface = new Points(this.geometry, this.#materials);
    this.group.add(this.#surface);
  }

  /** The frame's positions and normals go to the GPU. */
  #update() {
    const { position, normal } = this.geometry.attributes;
    const { points } = this;
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
    if (!colours || colours.update(this.frame, this.#fieldRange)) return;
    const { frame } = this;
    colours.field.load(frame).then(
      () => {
        if (this.#field !== colours || this.frame !== frame) return; // another one is shown by now
        colours.update(frame, this.#fieldRange);
        this.onChange();
      },
      (error) => this.#field === colours && this.onError(error),
    );
  }

  #closeField() {
    if (!this.#field) return;
    this.#surface.material.map?.dispose();
    this.#surface.material.dispose();
    const { name } = this.#field;
    this.geometry.deleteAttribute(name);
    this.#field = null;
    if (this.#isByTriangle || (name === "color" && this.colours)) this.#build(false); // as it was before the field
  }
}

/** Which value of an attribute each render vertex has. */
function entryOf({ domain, indices }, entries, { corners, vertices }) {
  if (domain !== "vertex") return corners.map((c) => entries[c]);
  return indices ? vertices.map((v) => indices[v]) : vertices; // of vertices without a triangle, too
}

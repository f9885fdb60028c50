/** The triangles that are drawn: those of the parts that are not hidden, in order of materials, one draw call each. */

export class PartIndex {
  /**
   * @param {{name: string, triangles: [number, number], material: number|null}[]} parts of the video; [] for one mesh
   * @param {number} nTriangles
   */
  constructor(parts, nTriangles) {
    const all = parts.length ? parts : [{ name: "", triangles: [0, nTriangles], material: null }];
    /** Material of each slot: its number, or null. */
    this.materials = [...new Set(all.map(({ material }) => material))];
    this.slots = this.materials.map((material) => all.filter((part) => part.material === material));
    /** Names, in order, each once. */
    this.names = [...new Set(parts.map(({ name }) => name))];
    this.hidden = new Set();
    this.all = all;
  }

  /** Triangles that are visible: `[start, stop]` of each part. @returns {[number, number][]} */
  get visible() {
    return this.all.filter(({ name }) => !this.hidden.has(name)).map(({ triangles }) => triangles);
  }

  /** @param {Set<string>} names */
  hide(names) {
    this.hidden = names;
  }

  /** Put the visible triangles into the geometry's index. @param {Uint32Array} index (3T) of all, in the video's order */
  fill(geometry, index) {
    const { array } = geometry.index;
    let end = 0;
    geometry.clearGroups();
    this.slots.forEach((parts, slot) => {
      const start = end;
      for (const { name, triangles } of parts) {
        if (this.hidden.has(name)) continue;
        array.set(index.subarray(3 * triangles[0], 3 * triangles[1]), end);
        end += 3 * (triangles[1] - triangles[0]);
      }
      geometry.addGroup(start, end - start, slot);
    });
    geometry.setDrawRange(0, end);
    geometry.index.needsUpdate = true;
  }
}

/** Geometry videos for three.js: `new GeometryVideoLoader().loadAsync("walk.mp4")` gives a `GeometryVideoMesh`. */

import { Loader } from "three";
import { GeometryVideo } from "../geometry_video.js";
import { GeometryVideoMesh } from "./geometry_video_mesh.js";

export class GeometryVideoLoader extends Loader {
  /** Of `GeometryVideoMesh.create`. */
  options = {};

  /** @param {object} options of `GeometryVideoMesh.create` */
  setOptions(options) {
    this.options = options;
    return this;
  }

  /**
   * @param {string} url below the loader's `path`
   * @param {(mesh: GeometryVideoMesh) => void} onLoad
   * @param {unknown} [onProgress] not called
   * @param {(error: Error) => void} [onError] given a `GeometryVideoError`
   */
  load(url, onLoad, onProgress, onError = console.error) {
    const address = this.manager.resolveURL(this.path + url);
    this.manager.itemStart(address);
    const failed = (error) => {
      onError(error);
      this.manager.itemError(address);
    };
    this.parseAsync(address)
      .then(onLoad, failed)
      .finally(() => this.manager.itemEnd(address));
  }

  /** The mesh of a file: an address, `Blob`, `ArrayBuffer` or `Uint8Array`. @returns {Promise<GeometryVideoMesh>} */
  async parseAsync(source) {
    const video = await GeometryVideo.load(source);
    try {
      return await GeometryVideoMesh.create(video, this.options);
    } catch (error) {
      video.close();
      throw error;
    }
  }
}

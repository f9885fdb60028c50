// Decodes geometry videos as the player does, without a browser: node run_frames.mjs BUNDLE.js FOLDER, which has jobs.json; writes
// frames.bin and results.json. A job is {"path", "level", "frames": [k]}; its result has triangles and positions of these frames, as
// bytes of frames.bin, or the error. Node decodes no video: "planes" names a file with the luma of a job's pictures, "size" is theirs.
import { readFileSync, writeFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const { process } = globalThis;
delete globalThis.process; // Draco's wrapper then takes this for a page
globalThis.window = globalThis;
const { GeometryVideo } = await import(pathToFileURL(process.argv[2]));
const folder = process.argv[3];
const [parts, results] = [[], []];
let end = 0;
const keep = (array) => {
  parts.push(Buffer.from(array.buffer, array.byteOffset, array.byteLength));
  end += array.byteLength;
  return [end - array.byteLength, end];
};
let luma = null; // of the job: {data, width, height}
globalThis.EncodedVideoChunk = class {
  constructor(chunk) {
    Object.assign(this, chunk);
  }
};
class LumaDecoder extends EventTarget {
  state = "unconfigured";
  decodeQueueSize = 0;
  constructor({ output }) {
    super();
    this.output = output;
  }
  configure() {
    this.state = "configured";
  }
  decode({ timestamp }) {
    const { data, width, height } = luma;
    const own = data.subarray(((timestamp / 1000) * width * height), (timestamp / 1000 + 1) * width * height);
    const copyTo = async (buffer) => {
      buffer.set(own);
      return [{ offset: 0, stride: width }];
    };
    this.output({ format: "I420", visibleRect: { width, height }, timestamp, allocationSize: () => own.length, copyTo, close() {} });
  }
  async flush() {}
  close() {
    this.state = "closed";
  }
}
for (const { path, level, frames, planes, size } of JSON.parse(readFileSync(`${folder}/jobs.json`, "utf8"))) {
  luma = planes && { data: readFileSync(planes), width: size[0], height: size[1] };
  globalThis.VideoDecoder = luma ? LumaDecoder : undefined;
  try {
    const video = await GeometryVideo.load(new Uint8Array(readFileSync(path)), { level });
    const found = { levels: video.levels, bounds: video.bounds, indices: keep(video.indices), frames: [] };
    for (const k of frames) found.frames.push(keep(await video.frame(k)));
    video.close();
    results.push(found);
  } catch (error) {
    results.push({ error: `${error.kind}: ${error.message}` });
  }
}
writeFileSync(`${folder}/results.json`, JSON.stringify(results));
writeFileSync(`${folder}/frames.bin`, Buffer.concat(parts));

// Opens what lies inside of damaged files: node run_damaged_volumes.mjs BUNDLE FILE ...; prints what became of each, a line each.
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const { process } = globalThis;
delete globalThis.process; // Draco's wrapper then takes this for a page
globalThis.window = globalThis;
globalThis.location = new URL("http://localhost/");
const [bundle, ...files] = process.argv.slice(2);
const { GeometryVideo } = await import(pathToFileURL(bundle));
for (const file of files) {
  let video = null;
  try {
    video = await GeometryVideo.load(new Uint8Array(readFileSync(file)));
    await video.volume?.open();
    await video.volume?.points?.frame(0);
    for (const [domain, name] of [["point", "heat"], ["cell", "energy"]]) await video.volume?.number(domain, name)?.field?.frame(0);
    console.log("read");
  } catch (error) {
    console.log(`${error.name} ${error.kind}: ${error.message}`);
  }
  video?.close();
}
process.exit(0);

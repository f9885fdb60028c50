// What three.js shows of an animated glTF file at some times: node run_skin.mjs FOLDER_OF_THREE FILE SECONDS...
// Prints JSON: for each time the positions of all vertices of all meshes, in the file's order, in the world.
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [folder, file, ...times] = process.argv.slice(2);
const load = (name) => import(pathToFileURL(`${folder}/${name}`).href);
const THREE = await load("build/three.module.js");
const { GLTFLoader } = await load("examples/jsm/loaders/GLTFLoader.js");

globalThis.self = globalThis; // pictures are made with what a page has
const data = readFileSync(file);
const bytes = data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength);
const { MeshoptDecoder } = await load("examples/jsm/libs/meshopt_decoder.module.js");
const { dracoLoader } = await import("./three_draco.mjs");
const draco = await dracoLoader(folder);
const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).setDRACOLoader(draco);
const { scene, animations } = await loader.parseAsync(bytes, "");
draco.dispose();
const mixer = new THREE.AnimationMixer(scene);
animations.forEach((clip) => mixer.clipAction(clip).setLoop(THREE.LoopOnce).play());
animations.forEach((clip) => (mixer.clipAction(clip).clampWhenFinished = true));
const shown = times.map((seconds) => {
  mixer.setTime(Number(seconds));
  scene.updateMatrixWorld(true);
  const positions = [];
  const point = new THREE.Vector3();
  scene.traverse((mesh) => {
    if (!mesh.isMesh) return;
    mesh.skeleton?.update();
    for (let v = 0; v < mesh.geometry.attributes.position.count; v++) {
      mesh.getVertexPosition(v, point).applyMatrix4(mesh.matrixWorld);
      positions.push(point.x, point.y, point.z);
    }
  });
  return positions;
});
process.stdout.write(JSON.stringify(shown));

// What Babylon.js shows of an animated glTF file at some times: node run_babylon.mjs FOLDER_OF_PACKAGES FILE SECONDS...
// Prints JSON: for each time the positions of all vertices of all meshes, in the file's order, in the world.
import { readFileSync, writeFileSync } from "node:fs";
import { pathToFileURL } from "node:url";
import { useMeshopt } from "./babylon_meshopt.mjs";

const [folder, file, ...times] = process.argv.slice(2);
const load = (name) => import(pathToFileURL(`${folder}/${name}`).href);
const BABYLON = await load("@babylonjs/core/index.js");
await load("@babylonjs/loaders/glTF/index.js");

const { NullEngine, Scene, LoadAssetContainerAsync, FreeCamera, Vector3 } = BABYLON;
BABYLON.Logger.LogLevels = BABYLON.Logger.NoneLogLevel; // its greeting goes to standard output
const { MeshoptDecoder } = await load("three/examples/jsm/libs/meshopt_decoder.module.js");
useMeshopt(BABYLON, MeshoptDecoder);
const { dracoModule, dracoBytes } = await import("./three_draco.mjs");
const jsModule = () => dracoModule(`${folder}/three`)({ wasmBinary: dracoBytes(`${folder}/three`) });
BABYLON.DracoDecoder._Default = new BABYLON.DracoDecoder({ numWorkers: 0, jsModule });
const FRAMES_A_SECOND = 60; // in which its loader counts
const scene = new Scene(new NullEngine());
scene.useRightHandedSystem = true;
scene.activeCamera = new FreeCamera("camera", Vector3.Zero(), scene);
const container = await LoadAssetContainerAsync(new Uint8Array(readFileSync(file)), scene, { pluginExtension: ".glb" });
container.addAllToScene();
const [animation] = scene.animationGroups;
animation.start(false);
animation.pause();
const shown = times.map((seconds) => {
  animation.goToFrame(Number(seconds) * FRAMES_A_SECOND);
  scene.render();
  const positions = [];
  for (const mesh of scene.meshes.filter((each) => each.getTotalVertices())) {
    mesh.skeleton?.prepare();
    const world = mesh.computeWorldMatrix(true);
    const own = mesh.getPositionData(true, true);
    for (let i = 0; i < own.length; i += 3) positions.push(...Vector3.TransformCoordinates(Vector3.FromArray(own, i), world).asArray());
  }
  return positions;
});
writeFileSync(1, JSON.stringify(shown)); // whole before the process ends, which an engine would not do
process.exit(0);

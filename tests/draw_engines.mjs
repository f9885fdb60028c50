// Pictures of an animated glTF file by two engines, in a page: bundled by tests/web/test_engines.py, which calls `draw`.
import * as BABYLON from "@babylonjs/core";
import "@babylonjs/loaders/glTF";
import * as THREE from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { MeshoptDecoder } from "three/examples/jsm/libs/meshopt_decoder.module.js";
import { useMeshopt } from "./babylon_meshopt.mjs";

const FRAMES_A_SECOND = 60; // in which Babylon.js counts

async function byThree(canvas, bytes, seconds, { eye, target, fov }) {
  const renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
  renderer.setSize(canvas.width, canvas.height, false);
  const loaded = await new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).parseAsync(bytes, "");
  const scene = new THREE.Scene().add(loaded.scene);
  scene.background = new THREE.Color(1, 1, 1);
  const light = new THREE.DirectionalLight(0xffffff, 2);
  light.position.set(...eye);
  scene.add(light, new THREE.AmbientLight(0xffffff, 0.8));
  const camera = new THREE.PerspectiveCamera(fov, canvas.width / canvas.height, 0.01, 1000);
  camera.position.set(...eye);
  camera.lookAt(...target);
  const mixer = new THREE.AnimationMixer(loaded.scene);
  for (const clip of loaded.animations) mixer.clipAction(clip).play();
  mixer.setTime(seconds);
  renderer.render(scene, camera);
}

async function byBabylon(canvas, bytes, seconds, { eye, target, fov }) {
  useMeshopt(BABYLON, MeshoptDecoder);
  const engine = new BABYLON.Engine(canvas, true, { preserveDrawingBuffer: true });
  const scene = new BABYLON.Scene(engine);
  scene.useRightHandedSystem = true;
  scene.clearColor = new BABYLON.Color4(1, 1, 1, 1);
  const camera = new BABYLON.FreeCamera("camera", new BABYLON.Vector3(...eye), scene);
  camera.setTarget(new BABYLON.Vector3(...target));
  camera.fov = (fov * Math.PI) / 180;
  camera.minZ = 0.01;
  const light = new BABYLON.HemisphericLight("light", new BABYLON.Vector3(...eye), scene);
  light.intensity = 1.2;
  const container = await BABYLON.LoadAssetContainerAsync(new Uint8Array(bytes), scene, { pluginExtension: ".glb" });
  container.addAllToScene();
  const [animation] = scene.animationGroups;
  animation.start(false);
  animation.pause();
  animation.goToFrame(seconds * FRAMES_A_SECOND);
  await scene.whenReadyAsync();
  scene.render();
}

window.draw = async (name, address, seconds, camera, side) => {
  const canvas = Object.assign(document.createElement("canvas"), { width: side, height: side });
  const bytes = await (await fetch(address)).arrayBuffer();
  await { three: byThree, babylon: byBabylon }[name](canvas, bytes, seconds, camera);
  return canvas.toDataURL("image/png");
};

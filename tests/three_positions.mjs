// Positions of all vertices of an animated .glb, frame by frame, by three.js: node three_positions.mjs THREE FILE N_FRAMES FPS
// Standard output: float64, three numbers a vertex, meshes in the order of the scene.

import { readFileSync, writeSync } from 'node:fs';

const [three, file, nFrames, fps] = process.argv.slice(2);
const THREE = await import(`${three}/build/three.module.js`);
const { GLTFLoader } = await import(`${three}/examples/jsm/loaders/GLTFLoader.js`);

globalThis.self = globalThis; // the loader looks for it
const loader = new GLTFLoader();
loader.register(() => ({ name: 'no pictures', loadTexture: () => Promise.resolve(new THREE.Texture()) }));
const bytes = readFileSync(file);
const gltf = await loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength), '');

const mixer = new THREE.AnimationMixer(gltf.scene);
for (const clip of gltf.animations.slice(0, 1)) {
  const action = mixer.clipAction(clip).setLoop(THREE.LoopOnce, 1);
  action.clampWhenFinished = true;
  action.play();
}
const vertex = new THREE.Vector3();
for (let frame = 0; frame < Number(nFrames); frame++) {
  mixer.setTime(Math.fround(frame / Number(fps)));
  gltf.scene.updateMatrixWorld(true);
  const found = [];
  gltf.scene.traverse((mesh) => {
    if (!mesh.isMesh) return;
    for (let i = 0; i < mesh.geometry.attributes.position.count; i++) {
      mesh.getVertexPosition(i, vertex).applyMatrix4(mesh.matrixWorld);
      found.push(vertex.x, vertex.y, vertex.z);
    }
  });
  const block = Buffer.from(new Float64Array(found).buffer);
  for (let at = 0; at < block.length; ) at += writeSync(1, block, at);
}

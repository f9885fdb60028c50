// Babylon.js decodes meshopt by the decoder that three.js ships, else it loads its own from a page's network.
export const useMeshopt = (BABYLON, MeshoptDecoder) => {
  BABYLON.MeshoptCompression._Default = {
    decodeGltfBufferAsync: async (source, count, stride, mode, filter) => {
      await MeshoptDecoder.ready;
      const target = new Uint8Array(count * stride);
      MeshoptDecoder.decodeGltfBuffer(target, count, stride, source, mode, filter);
      return target;
    },
  };
};

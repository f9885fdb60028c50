/** The page in the editor. Only scripts with the nonce run, and nothing is fetched: the file comes as a message. */

"use strict";

/** @param {(name: string) => string} address of a file in `media` @param {string} nonce */
exports.pageOf = (address, nonce) => `<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src 'nonce-${nonce}' 'wasm-unsafe-eval'; style-src 'unsafe-inline'; media-src blob:; worker-src blob:; img-src data:">
<title>Geometry video</title>
<style>
  html, body { height: 100%; margin: 0; padding: 0 }
  geometry-video { height: 100vh; --backdrop: var(--vscode-editor-background, #222) }
  main { padding: 2rem; font: 1rem/1.5 var(--vscode-font-family, sans-serif); color: var(--vscode-foreground, inherit) }
</style>
<body>
<geometry-video loop></geometry-video>
<main hidden>
  <p role="alert"></p>
  <button>Open with the default viewer</button>
</main>
<script type="module" nonce="${nonce}" src="${address("player.js")}"></script>
<script type="module" nonce="${nonce}" src="${address("viewer.js")}"></script>
</body>
</html>
`;

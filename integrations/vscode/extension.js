/** A read-only editor of VS Code that plays geometry videos. Ordinary .mp4 files keep their viewer: its priority is "option". */

"use strict";

const { randomBytes } = require("node:crypto");
const vscode = require("vscode");
const { pageOf } = require("./page.js");

const VIEW = "gvpipe.geometryVideo";

exports.activate = (context) => {
  const media = vscode.Uri.joinPath(context.extensionUri, "media");
  const play = (uri) => vscode.commands.executeCommand("vscode.openWith", uri, VIEW);
  context.subscriptions.push(
    vscode.commands.registerCommand("gvpipe.play", play),
    vscode.window.registerCustomEditorProvider(VIEW, new Player(media), {
      webviewOptions: { retainContextWhenHidden: false }, // a hidden player keeps no frames
      supportsMultipleEditorsPerDocument: true,
    }),
  );
};

class Player {
  constructor(media) {
    this.media = media;
  }

  openCustomDocument(uri) {
    return { uri, dispose() {} };
  }

  resolveCustomEditor({ uri }, { webview }) {
    webview.options = { enableScripts: true, localResourceRoots: [this.media] };
    webview.onDidReceiveMessage(async ({ type }) => {
      if (type === "ready") await send(webview, uri);
      else if (type === "other") await vscode.commands.executeCommand("vscode.openWith", uri, "default");
    });
    const address = (name) => String(webview.asWebviewUri(vscode.Uri.joinPath(this.media, name)));
    webview.html = pageOf(address, randomBytes(16).toString("hex"));
  }
}

async function send(webview, uri) {
  try {
    const file = await vscode.workspace.fs.readFile(uri);
    await webview.postMessage({ bytes: new Uint8Array(file) }); // a Buffer, as remote folders give, would come as an object
  } catch (error) {
    await webview.postMessage({ error: error.message });
  }
}

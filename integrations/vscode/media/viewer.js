/** In the editor's page: plays the file that the extension sends, or says why it cannot. */

const api = acquireVsCodeApi();
const element = document.querySelector("geometry-video");
const main = document.querySelector("main");

async function show({ bytes, error }) {
  try {
    if (error) throw new Error(error);
    await element.load(bytes);
    await element.play();
  } catch (reason) {
    if (reason.name === "AbortError") return;
    document.querySelector("[role=alert]").textContent = `This file cannot be played as a geometry video: ${reason.message}`;
    element.remove();
    main.hidden = false;
  }
}

addEventListener("message", ({ data }) => show(data));
document.querySelector("button").addEventListener("click", () => api.postMessage({ type: "other" }));
api.postMessage({ type: "ready" });

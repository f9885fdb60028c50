/** The page that plays a file of the user's: chosen or dropped. Its Content Security Policy lets nothing leave it. */

import "./player.js";

const element = document.querySelector("geometry-video");
const input = document.querySelector("input");
const line = document.querySelector("[role=status]");

async function open(file) {
  if (!file) return;
  line.textContent = `Opening ${file.name} ...`;
  try {
    await element.load(file);
    const { frameCount, vertexCount } = element.video;
    line.textContent = `${file.name}: ${frameCount} frames of ${vertexCount} vertices. Nothing was uploaded.`;
    document.title = file.name;
    await element.play();
  } catch (error) {
    if (error.name !== "AbortError") line.textContent = `${file.name} cannot be played: ${error.message}`;
  }
}

input.addEventListener("change", () => open(input.files[0]));
for (const name of ["dragover", "drop", "dragleave"]) {
  addEventListener(name, (event) => {
    event.preventDefault(); // else the browser leaves the page for the file
    document.body.classList.toggle("over", name === "dragover");
    if (name === "drop") open(event.dataTransfer.files[0]);
  });
}

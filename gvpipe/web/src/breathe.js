/** A moment for the page between two pieces of work: it repaints and answers. @returns {Promise<void>} */
export function breathe() {
  return globalThis.scheduler?.yield?.() ?? new Promise((resolve) => setTimeout(resolve));
}

/** Long work in slices, so that a worker answers between them. */

const SLICE = 25; // ms of work at once
const REST = 5; // ms, while other work goes first

/**
 * @template T
 * @param {Generator<void, T>} steps of work
 * @param {() => boolean} mustWait whether other work goes first now
 * @returns {Promise<T>} what the steps return
 */
export async function inSlices(steps, mustWait) {
  for (;;) {
    const end = performance.now() + SLICE;
    do {
      const { done, value } = steps.next();
      if (done) return value;
    } while (performance.now() < end);
    await messagesTaken();
    while (mustWait()) await new Promise((resolve) => setTimeout(resolve, REST));
  }
}

/** When messages that have come meanwhile are taken: sooner than by a timer, which browsers slow down. */
function messagesTaken() {
  return new Promise((resolve) => {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = () => {
      port1.close();
      resolve();
    };
    port2.postMessage(null);
  });
}

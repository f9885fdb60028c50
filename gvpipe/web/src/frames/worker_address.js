/** Where the code of workers is: one address for all workers of a page. */

let address = "";

/** @throws {Error} the page has no such addresses */
export function workerAddress() {
  address ||= URL.createObjectURL(new Blob([WORKER_SOURCE], { type: "text/javascript" }));
  return address;
}

/** What `request` says of an address: argv is the address, and how many bytes are asked for. Prints bytes that came, or the error. */

import { pathToFileURL } from "node:url";

const [source, url, most, seconds] = process.argv.slice(2);
const { request, TIMES } = await import(pathToFileURL(source).href);
if (seconds) TIMES.least = Number(seconds);
try {
  const asked = await request(url, new AbortController().signal, most ? { most: Number(most) } : {});
  console.log((await asked.bytes()).length);
} catch (error) {
  console.log(error.message);
}

/** Copies what the package has from elsewhere: the player's bundle, and licences. `vsce package` runs it. */

"use strict";

const { copyFileSync, cpSync } = require("node:fs");
const { join } = require("node:path");

const root = join(__dirname, "..", "..");
copyFileSync(join(root, "gvpipe", "web", "bundle", "player.js"), join(__dirname, "media", "player.js"));
cpSync(join(root, "gvpipe", "web", "LICENSES"), join(__dirname, "LICENSES"), { recursive: true });
copyFileSync(join(root, "LICENSE"), join(__dirname, "LICENSE"));

// The physics as a page takes it: compressed.
import { readFileSync, writeFileSync } from "node:fs";
import { gzipSync } from "node:zlib";

writeFileSync("../built/mujoco.wasm.gz", gzipSync(readFileSync("node_modules/@mujoco/mujoco/mujoco.wasm"), { level: 9 }));

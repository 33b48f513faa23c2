#!/usr/bin/env bash
# Runs the Khronos glTF validator on files; exit code 1 at any error or warning.
#
#   tools/reference/gltf_validate.sh FILE.glb ...
#
# OSCULATE_NODE_DIR: a folder to install the validator in and keep; default: a throw-away one.
set -euo pipefail

if [ $# -eq 0 ]; then
    sed -n '2,6p' "$0" >&2
    exit 2
fi
dir=${OSCULATE_NODE_DIR:-}
if [ -z "$dir" ]; then
    dir=$(mktemp -d)
    trap 'rm -rf "$dir"' EXIT
fi
if [ ! -d "$dir/node_modules/gltf-validator" ]; then
    npm install --silent --no-fund --no-audit --prefix "$dir" gltf-validator@2.0.0-dev.3.10 >/dev/null
fi
cat >"$dir/validate.cjs" <<'JS'
const fs = require("fs");
const path = require("path");
const validator = require("gltf-validator");

async function main() {
  let failed = false;
  for (const file of process.argv.slice(2)) {
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {
      uri: path.basename(file),
      externalResourceFunction: async (uri) =>
        new Uint8Array(fs.readFileSync(path.join(path.dirname(file), decodeURIComponent(uri)))),
    });
    const { numErrors, numWarnings, numInfos, messages } = report.issues;
    console.log(`${file}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos`);
    for (const m of messages) console.log(`  ${["error", "warning", "info", "hint"][m.severity]} ${m.code} ${m.pointer}: ${m.message}`);
    failed ||= numErrors + numWarnings > 0;
  }
  process.exit(failed ? 1 : 0);
}
main().catch((e) => { console.error(String(e)); process.exit(1); });
JS
node "$dir/validate.cjs" "$@"

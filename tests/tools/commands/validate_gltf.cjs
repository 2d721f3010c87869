// SPDX-License-Identifier: GPL-3.0-or-later
//
// Khronos' validator on each file: one line of what it says, and exit code 1 where it finds an error or a warning.
// Exit code 77 where the npm package gltf-validator is not to be found (NODE_PATH may say where it is).
const fs = require('fs');

let validator;
try {
  validator = require('gltf-validator');
} catch (error) {
  console.log('the npm package gltf-validator is not installed');
  process.exit(77);
}

(async () => {
  for (const path of process.argv.slice(2)) {
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(path)), {maxIssues: 100});
    const issues = report.issues;
    console.log(`${path}: ${issues.numErrors} errors, ${issues.numWarnings} warnings`);
    for (const message of issues.messages) {
      if (message.severity < 2) console.log(`  ${message.code} ${message.pointer}: ${message.message}`);
    }
    if (issues.numErrors + issues.numWarnings > 0) process.exitCode = 1;
  }
})();

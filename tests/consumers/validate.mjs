// Usage: node validate.mjs FILE...
//
// Prints what the Khronos validator says about glTF and GLB files, as JSON:
// {FILE: [{code, severity, message, pointer}, ...], ...}. Severity 0 is an error, 1 a warning,
// 2 an information and 3 a hint. The packages are in the folder $FAM_CONSUMERS.

import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { dirname, join } from 'node:path';

const require = createRequire(join(process.env.FAM_CONSUMERS, 'package.json'));
const { validateBytes } = require('gltf-validator');

const reports = {};
for (const file of process.argv.slice(2)) {
  const report = await validateBytes(new Uint8Array(await readFile(file)), {
    uri: file,
    externalResourceFunction: async (uri) =>
      new Uint8Array(await readFile(join(dirname(file), decodeURIComponent(uri)))),
    maxIssues: 0,
    writeTimestamp: false,
  });
  reports[file] = report.issues.messages;
}
process.stdout.write(JSON.stringify(reports));

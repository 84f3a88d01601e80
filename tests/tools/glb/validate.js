// Prints what the glTF validator of Khronos says about a file; fails when there is an error or a
// warning. node validate.js FILE.glb
const fs = require('fs');
const validator = require('gltf-validator');

validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[2]))).then((report) => {
  const {numErrors, numWarnings, messages} = report.issues;
  for (const message of messages) console.log(JSON.stringify(message));
  console.log(`${numErrors} errors, ${numWarnings} warnings, ` +
              `${report.info.totalTriangleCount} triangles`);
  process.exit(numErrors + numWarnings > 0 ? 1 : 0);
});

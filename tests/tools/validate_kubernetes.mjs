// Are the manifests of deploy/kubernetes what Kubernetes's published schemas take?
//   cd $(mktemp -d) && npm install kubernetes-models yaml && node .../validate_kubernetes.mjs FOLDER
// Not part of the tests: they install no npm packages.
import fs from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";
import { pathToFileURL } from "node:url";

const require = createRequire(path.join(process.cwd(), "package.json"));
const load = (name) => import(pathToFileURL(require.resolve(name)).href);
const { default: YAML } = await load("yaml");
const kinds = {};
for (const group of ["apps/v1", "v1", "autoscaling/v2", "policy/v1", "networking.k8s.io/v1"]) {
  Object.assign(kinds, await load(`kubernetes-models/${group}`));
}
const folder = process.argv[2];
let valid = 0;
let failed = false;
for (const name of fs.readdirSync(folder).filter((file) => file.endsWith(".yaml"))) {
  for (const document of YAML.parseAllDocuments(fs.readFileSync(path.join(folder, name), "utf8"))) {
    const manifest = document.toJS();
    if (manifest.kind === "Kustomization") continue;
    try {
      new kinds[manifest.kind](manifest).validate();
      ++valid;
    } catch (error) {
      failed = true;
      console.log(`${name}: ${manifest.kind}: ${error.message ?? error}`);
    }
  }
}
console.log(`${valid} manifests are valid`);
process.exit(failed || valid === 0 ? 1 : 0);

// Writes inline.js: the module with SIMD in the text of an ES module, by gzip and base64.
//   node make_inline.mjs cab_simd.wasm inline.js
import {readFileSync, writeFileSync} from 'node:fs';
import {gzipSync} from 'node:zlib';

const [from, to] = process.argv.slice(2);
const packed = gzipSync(readFileSync(from), {level: 9}).toString('base64');
writeFileSync(to, `// cab-collision with its module inside. Made by engine/bindings/wasm/make_inline.mjs: do not edit.
import {hasSimd, load as loadFrom} from './index.js';

export * from './index.js';

const PACKED = '${packed}';

export async function load({checkViews, ...rest} = {}) {
  for (const key of Object.keys(rest)) {
    throw new TypeError(\`cab: load of cab-collision/inline takes no '\${key}'; that of cab-collision may\`);
  }
  if (!hasSimd()) throw new Error('cab: there is no SIMD here; cab_scalar.wasm by load of cab-collision needs none');
  const packed = Uint8Array.from(atob(PACKED), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'));
  return loadFrom({bytes: await new Response(stream).arrayBuffer(), checkViews});
}
`);

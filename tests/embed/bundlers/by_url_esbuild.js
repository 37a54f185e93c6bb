import {load} from 'cab-collision';
import url from 'cab-collision/cab_simd.wasm';
import {touching} from './arms.js';

async function main() {
  document.body.textContent = touching(await load({url}));
}
main();

import {load} from 'cab-collision';
// quote
import url from 'cab-collision/cab_simd.wasm';
// end quote
import {touching} from './arms.js';

async function main() {
  document.body.textContent = touching(await load({url}));
}
main();
